/* Which functions run during which test: linked into a library that is compiled with -finstrument-functions.
 * The folder $HYSTFMU_CALLS has the number of the present test in `test`; each first call of a function in a test
 * appends that number and the place of the function in the library to `calls`. */
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#define PLAIN __attribute__((no_instrument_function, visibility("hidden")))
#define PLACES 16384 /* more than the library has functions */

extern const char __ehdr_start[] __attribute__((visibility("hidden"))); /* where the library begins */
static const volatile int32_t *test;
static int out = -1;
static struct {
  uintptr_t function;
  int32_t test;
} seen[PLACES];

PLAIN __attribute__((constructor)) void calls_open(void) {
  const char *folder = getenv("HYSTFMU_CALLS");
  char path[4096];
  if (!folder || snprintf(path, sizeof path, "%s/test", folder) >= (int)sizeof path) return;
  const int in = open(path, O_RDONLY);
  if (in < 0) return;
  void *shared = mmap(NULL, sizeof *test, PROT_READ, MAP_SHARED, in, 0);
  close(in);
  if (shared == MAP_FAILED) return;
  test = shared;
  snprintf(path, sizeof path, "%s/calls", folder);
  out = open(path, O_WRONLY | O_CREAT | O_APPEND, 0666);
}

PLAIN void __cyg_profile_func_enter(void *function, void *site) {
  (void)site;
  if (out < 0) return;
  const uintptr_t at = (uintptr_t)function - (uintptr_t)__ehdr_start;
  size_t k = (at >> 2) % PLACES;
  while (seen[k].function && seen[k].function != at) k = (k + 1) % PLACES;
  if (seen[k].function && seen[k].test == *test) return;
  seen[k].function = at;
  seen[k].test = *test;
  const int64_t row[2] = {*test, (int64_t)at};
  if (write(out, row, sizeof row) != sizeof row) out = -1;
}

PLAIN void __cyg_profile_func_exit(void *function, void *site) {
  (void)function;
  (void)site;
}
