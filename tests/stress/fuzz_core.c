/* libFuzzer target: bytes as a block file, read, and run if it opens.  Length and checksum are made right, or chance
 * would never get past them. */
#include "../c/run_core.h"

enum { LARGE = 1 << 20 }; /* bytes of memory that a file may ask for: what is larger takes time and shows nothing new */

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
