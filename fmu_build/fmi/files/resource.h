/* resource.h - files in the resources of an FMU. */
#ifndef FMI_RESOURCE_H
#define FMI_RESOURCE_H

#include <stddef.h>

/* reads <location>/block.bin, beside this binary if the location is NULL or empty; NULL on failure, with the reason in
 * `why` */
unsigned char *fmi_read_block_file(const char *location, size_t *length, char *why, size_t size);
/* The path of a file there, which the caller frees, and its content; NULL on failure, with the reason in `why`. */
char *fmi_resource(const char *location, const char *name, char *why, size_t size);
unsigned char *fmi_read_file(const char *path, size_t *length, char *why, size_t size);
#endif
