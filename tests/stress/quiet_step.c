/* Runs set, step and get of every model while the kernel kills the process at any system call but exit, and counts all
 * calls of the allocator and of locks.    quiet_step BINARY MODELS */
#define _GNU_SOURCE
#include <errno.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <stddef.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "binary.h"

/* these definitions replace those of libc, for the loaded binary too */
static long calls;
void *__libc_malloc(size_t n);
void *__libc_calloc(size_t n, size_t size);
void *__libc_realloc(void *p, size_t n);
void __libc_free(void *p);
void *malloc(size_t n) { return calls++, __libc_malloc(n); }
void *calloc(size_t n, size_t size) { return calls++, __libc_calloc(n, size); }
void *realloc(void *p, size_t n) { return calls++, __libc_realloc(p, n); }
void free(void *p) { calls++, __libc_free(p); }
int pthread_mutex_lock(pthread_mutex_t *m) { return calls++, (void)m, 0; } /* one thread: no lock is ever held */

static void forbid_system_calls(void) {
  struct sock_filter rules[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
  };
  struct sock_fprog program = {sizeof rules / sizeof *rules, rules};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program)) _exit(77);
}

int main(int argc, char **argv) {
  enum { MOST = 200, STEPS = 300 };
  static model models[MOST];
  static void *c[2][MOST];
  uint64_t hash = 0;
  DEMAND(argc >= 3);
  const binary b = load(argv[1]);
  const int n = read_models(argv[2], models, MOST);
  for (int k = 0; k < n; k++)
    for (int v = 0; v < 2; v++) c[v][k] = start(&b, models + k, 2 + v);
  DEMAND(n > 0 && calls > 0); /* checks the counter itself */
  forbid_system_calls();
  calls = 0;
  if (argc > 3) free(malloc(1)); /* with a further argument the test must fail */
  if (argc > 4) (void)getppid();
  for (int k = 0; k < n; k++)
    for (int v = 0; v < 2; v++)
      for (int i = 0; i < STEPS; i++)
        if (advance(&b, models + k, c[v][k], 2 + v, i, &hash)) _exit(2);
  _exit(calls ? 3 : 0);
}
