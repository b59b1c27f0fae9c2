/* embedded.h - block files inside a program (made by embedded.py): no file is opened, whatever the platform. */
#ifndef EMBEDDED_H
#define EMBEDDED_H
#include <stddef.h>

typedef struct {
  const char *name;
  const unsigned char *bytes;
  size_t length;
} embedded_file;

extern const embedded_file embedded_files[]; /* ends with a name that is NULL */
#endif
