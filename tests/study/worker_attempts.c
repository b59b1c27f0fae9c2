/* What a foreign FMU tries in a worker of the process MAKER: each attempt that succeeds adds its number. The secret is
 * written backwards, not to find it here. */
#define _GNU_SOURCE
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
static const char backwards[] = "neddih sdrow";
static int holds(const char *at, size_t n) {
  size_t m = sizeof backwards - 1;
  for (size_t i = 0; i + m <= n; i++) {
    size_t k = 0;
    while (k < m && at[i + k] == backwards[m - 1 - k]) k++;
    if (k == m) return 1;
  }
  return 0;
}
static int in_memory(void) {
  FILE *maps = fopen("/proc/self/maps", "r");
  char line[4096], rights[8];
  unsigned long from, to;
  int found = 0;
  while (maps && fgets(line, sizeof line, maps))
    if (sscanf(line, "%lx-%lx %7s", &from, &to, rights) == 3 && rights[0] == 'r' && rights[1] == 'w')
      found |= holds((const char *)from, to - from);
  return found;
}
static int in_file(const char *path) {
  static char text[1 << 16];
  FILE *f = fopen(path, "rb");
  if (!f) return 0;
  size_t n = fread(text, 1, sizeof text, f);
  int found = holds(text, n);
  memset(text, 0, sizeof text);
  fclose(f);
  return found;
}
static int pipes(void) { /* the helper of multiprocessing removes what it is told to */
  struct stat s;
  for (int k = 0; k < 256; k++)
    if (!fstat(k, &s) && S_ISFIFO(s.st_mode)) return 1;
  return 0;
}
static double attempts(void) {
  char path[64];
  double did = 0;
  struct rlimit none = {0, 0};
  did += 1 * (getenv("TOKEN") != 0);
  did += 2 * in_file("/proc/self/environ");
  snprintf(path, sizeof path, "/proc/%d/environ", (int)getppid());
  did += 4 * in_file(path);
  snprintf(path, sizeof path, "/proc/%d/environ", MAKER);
  did += 8 * in_file(path);
  did += 16 * in_memory();
  did += 32 * pipes();
  did += 64 * isatty(0) + 64 * isatty(1);
  did += 128 * (prlimit(MAKER, RLIMIT_NOFILE, 0, &none) == 0);
  did += 256 * (setpriority(PRIO_PROCESS, MAKER, 19) == 0); /* no limit of the user refuses 19 */
  return did;
}
