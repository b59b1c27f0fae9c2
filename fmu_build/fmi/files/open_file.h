/* open_file.h - fopen(path, "rb") for a path in UTF-8 on every system. */
#ifndef FMI_OPEN_FILE_H
#define FMI_OPEN_FILE_H
#include <stdio.h>

FILE *fmi_open_file(const char *path);
#endif
