/* libFuzzer target: opens and runs a random block file.  Length and checksum are corrected, because random bytes would
 * never pass them. */
#include "../c/run_core.h"

enum { LARGE = 1 << 20 }; /* largest memory of a file (bytes); larger ones only take time */

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t length);
int LLVMFuzzerTestOneInput(const unsigned char *data, size_t length) {
  size_t bytes = 0;
  hyst_error error;
  char text[512];
  drawn = 0;
  if (hyst_graph_measure(data, length, &bytes, &error)) (void)hyst_message(&error, text, sizeof text);
  unsigned char *file = malloc(length + 1);
  if (!file) return 0;
  memcpy(file, data, length);
  seal(file, length);
  const int small = !hyst_graph_measure(file, length, &bytes, &error) && bytes < LARGE;
  if (small) (void)run(file, length, 8, 0.01, 1);
  free(file);
  return 0;
}
