/* embedded.h - block files inside a program (made by embedded.py), so that no platform has to open files. */
#ifndef EMBEDDED_H
#define EMBEDDED_H
#include <stddef.h>

typedef struct {
  const char *name;
  const unsigned char *bytes;
  size_t length;
} embedded_file;

extern const embedded_file embedded_files[]; /* the last entry has a null name */
#endif
