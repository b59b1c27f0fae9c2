/* Runs the whole core under the sanitizers: block files run; damaged copies are refused or run.
 *   drive_core COPIES FILE...     every file has to open, and so many damaged copies; 0: extreme values may be refused
 * Prints every file before it is touched, so that a crash has a name.  Exit 0: success. */
#include <stdio.h>

#include "run_core.h"

static void damaged(const unsigned char *file, size_t length, int times) {
  unsigned char *copy = malloc(length + 8);
  if (!copy) exit(3);
  for (int i = 0; i < times; i++) { /* truncated, as it is and with a right checksum */
    const size_t cut = (size_t)(draw() % length);
    memcpy(copy, file, length);
    if (run(copy, cut, 1, 0.01, 0) == HYST_E_OK) exit(6);
    seal(copy, cut);
    (void)run(copy, cut, 1, 0.01, 0);
  }
  for (int i = 0; i < times; i++) { /* bits flipped: always refused; and with a right checksum: refused or run */
    memcpy(copy, file, length);
    const size_t at = (size_t)(draw() % length);
    copy[at] ^= (unsigned char)(1u << draw() % 8);
    if (run(copy, length, 1, 0.01, 0) == HYST_E_OK) exit(7);
    for (uint64_t more = draw() % 3; more > 0; more--) {
      const size_t place = (size_t)(draw() % length);
      if (draw() % 2) copy[place] ^= (unsigned char)(1u << draw() % 8);
      else if (place + 4 <= length) put_u32(copy + place, (uint32_t)(draw() % 4 ? draw() % 40 : draw()));
    }
    seal(copy, length);
    (void)run(copy, length, 10, 0.01, 1);
  }
  memcpy(copy, file, length); /* extra bytes at the end */
  memset(copy + length, 0, 8);
  seal(copy, length + 8);
  if (run(copy, length + 8, 1, 0.01, 0) == HYST_E_OK) exit(8);
  free(copy);
}

int main(int argc, char **argv) {
  if (argc < 3) return 2;
  const int copies = atoi(argv[1]);
  for (int i = 2; i < argc; i++) {
    fprintf(stderr, "%s\n", argv[i]);
    FILE *f = fopen(argv[i], "rb");
    if (!f || fseek(f, 0, SEEK_END)) return 2;
    const long length = ftell(f);
    unsigned char *file = malloc((size_t)length);
    rewind(f);
    if (!file || fread(file, 1, (size_t)length, f) != (size_t)length) return 2;
    fclose(f);
    if (copies > 0) {
      if (run(file, (size_t)length, 2000, 0.01, 0) != HYST_E_OK) return 9;
      (void)run(file, (size_t)length, 500, 0.01, 1);
      damaged(file, (size_t)length, copies);
    } else {
      (void)run(file, (size_t)length, 60, 0.01, 1);
    }
    free(file);
  }
  return 0;
}
