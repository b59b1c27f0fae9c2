/* library.h - shared libraries of this system; paths are UTF-8. */
#ifndef HYST_CONTAINER_LIBRARY_H
#define HYST_CONTAINER_LIBRARY_H
#include <stddef.h>

void *library_open(const char *path, char *why, size_t size); /* NULL with the reason */
void (*library_function(void *library, const char *name))(void);
void library_close(void *library);
#endif
