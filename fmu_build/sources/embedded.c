/* embedded.c - replaces fmi/files/resource.c in a source FMU: block.bin is a constant of the program, no file is read.
 * The exporter writes `hyst_block_file` before this text. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi/files/resource.h"

/* a copy, because the caller frees it */
unsigned char *fmi_read_block_file(const char *location, size_t *length, char *why, size_t size) {
  unsigned char *bytes = (unsigned char *)malloc(sizeof hyst_block_file);
  (void)location;
  if (!bytes) return snprintf(why, size, "out of memory"), (unsigned char *)NULL;
  memcpy(bytes, hyst_block_file, sizeof hyst_block_file);
  *length = sizeof hyst_block_file;
  return bytes;
}
