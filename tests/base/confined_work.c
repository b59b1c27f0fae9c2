/* What a foreign FMU may do in its confinement: each function that succeeds adds its number. */
#include <dlfcn.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
static double did;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int sum, threads_set;
static void *work(void *nothing) {
  cpu_set_t all;
  int set = !sched_getaffinity(0, sizeof all, &all) && !sched_setaffinity(0, sizeof all, &all);
  int lower = !setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + 1); /* at any niceness of the tests */
  pthread_mutex_lock(&lock);
  for (int k = 0; k < 1000; k++) sum += k;
  threads_set += set && lower && !pthread_kill(pthread_self(), 0);
  pthread_mutex_unlock(&lock);
  return nothing;
}
static int threads(void) {
  pthread_t made[4];
  pthread_attr_t attr;
  pthread_attr_init(&attr);
  pthread_attr_setstacksize(&attr, 1 << 20);
  for (int k = 0; k < 4; k++)
    if (pthread_create(&made[k], &attr, work, 0)) return 0;
  for (int k = 0; k < 4; k++) pthread_join(made[k], 0);
  return sum == 4 * 499500 && threads_set == 4;
}
static int cancelled(void) {
  pthread_t made;
  void *result;
  return !pthread_create(&made, 0, (void *(*)(void *))pause, 0) && !pthread_cancel(made) &&
         !pthread_join(made, &result) && result == PTHREAD_CANCELED;
}
static int files(void) {
  char path[4096], line[8] = "";
  FILE *here = fopen("here.txt", "w+");
  snprintf(path, sizeof path, "%s/XXXXXX", getenv("TMPDIR"));
  int made = mkstemp(path);
  if (!here || made < 0) return 0;
  fputs("words", here);
  rewind(here);
  return fgets(line, sizeof line, here) && !strcmp(line, "words") && !rename("here.txt", "there.txt") && !unlink(path);
}
static int limits(void) {
  struct rlimit files;
  return !getrlimit(RLIMIT_NOFILE, &files) && !setrlimit(RLIMIT_NOFILE, &files) && nice(1) != -1;
}
static int processes(void) {
  int status, child = fork();
  if (!child)
    for (;;) pause();
  if (kill(child, SIGTERM) || waitpid(child, &status, 0) != child || !WIFSIGNALED(status)) return 0;
  child = fork();
  if (!child) abort();
  return waitpid(child, &status, 0) == child && WTERMSIG(status) == SIGABRT && !system("sleep 60 & kill $!");
}
static int python(void) { /* as an FMU that is written in Python: it finds the interpreter in its process */
  int (*ensure)(void), (*run)(const char *);
  void (*release)(int);
  *(void **)&ensure = dlsym(RTLD_DEFAULT, "PyGILState_Ensure");
  *(void **)&run = dlsym(RTLD_DEFAULT, "PyRun_SimpleString");
  *(void **)&release = dlsym(RTLD_DEFAULT, "PyGILState_Release");
  if (!ensure || !run || !release) return 1; /* an interpreter without names */
  int held = ensure();
  int failed =
      run("import json, sqlite3, subprocess, sys, tempfile, threading\n"
          "t = threading.Thread(target=json.dumps, args=([1],))\n"
          "t.start(), t.join()\n"
          "tempfile.NamedTemporaryFile().write(b'x')\n"
          "assert subprocess.run([sys.executable, '-c', 'import hystfmu']).returncode == 0\n");
  release(held);
  return !failed;
}
static void all(void) {
  did += 1 * threads();
  did += 2 * cancelled();
  did += 4 * files();
  did += 8 * limits();
  did += 16 * processes();
  did += 32 * python();
}
