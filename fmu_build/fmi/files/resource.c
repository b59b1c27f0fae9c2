/* resource.c - finds files at the resource location of the importer (file URI or path); without one, in the resources
 * of the FMU in which this binary lies. */
#include "fmi/files/resource.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi/files/open_file.h"
#include "fmi/files/own_folder.h"

static int hex(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/* %41 -> A in place; 0 if an escape is malformed or stands for the end of the string */
static int decode(char *s) {
  char *to = s;
  for (; *s; s++) {
    if (*s != '%') {
      *to++ = *s;
      continue;
    }
    const int hi = hex(s[1]), lo = hi < 0 ? -1 : hex(s[2]);
    if (lo < 0 || hi + lo == 0) return 0;
    *to++ = (char)(hi * 16 + lo);
    s += 2;
  }
  *to = 0;
  return 1;
}

/* what follows a word, which is in any case in the location; NULL if it does not begin so */
static const char *after(const char *location, const char *word) {
  for (; *word; location++, word++)
    if ((*location >= 'A' && *location <= 'Z' ? *location + 'a' - 'A' : *location) != *word) return NULL;
  return location;
}

/* the path of a file URI: of ///a/b, /a/b, //localhost/a/b, or nothing; NULL if it names another machine */
static const char *local_part(const char *uri) {
  if (uri[0] != '/' || uri[1] != '/') return uri;
  uri += 2;
  const char *path = after(uri, "localhost");
  if (path && (*path == '/' || !*path)) uri = path;
  return *uri == '/' || !*uri ? uri : NULL;
}

/* the path of a file for a file URI or a path; an empty one if the location is; `path` has room for its name */
static const char *to_path(const char *location, const char *name, char *path) {
  const char *uri = after(location, "file:"), *from = uri ? local_part(uri) : location;
  if (!from) return "the resource location names another machine";
#ifdef _WIN32
  if (uri && from[0] == '/' && from[1] && from[2] == ':') from++; /* /C:/a */
#endif
  strcpy(path, from);
  if (uri && !decode(path)) return "the resource location has a malformed % escape";
  const size_t n = strlen(path);
  if (n > 0) strcat(strcat(path, path[n - 1] == '/' ? "" : "/"), name);
  return NULL;
}

char *fmi_resource(const char *location, const char *name, char *why, size_t size) {
  static const char BESIDE[] = "../../resources/"; /* of <FMU>/binaries/<platform>/<this file> */
  if (!location) location = "";
  char *path = malloc(strlen(location) + strlen(name) + sizeof BESIDE);
  if (!path) return snprintf(why, size, "out of memory"), NULL;
  const char *wrong = to_path(location, name, path);
  if (wrong) return snprintf(why, size, "%s: '%s'", wrong, location), free(path), NULL;
  if (*path) return path;
  char *found = fmi_beside(strcat(strcpy(path, BESIDE), name));
  free(path);
  return found ? found : (snprintf(why, size, "no resource location was given"), NULL);
}

unsigned char *fmi_read_file(const char *path, size_t *length, char *why, size_t size) {
  unsigned char *bytes = NULL;
  FILE *f = fmi_open_file(path);
  const long end = !f || fseek(f, 0, SEEK_END) ? -1 : ftell(f);
  if (end <= 0 || end > 1L << 30 || fseek(f, 0, SEEK_SET) || !(bytes = malloc((size_t)end)) ||
      fread(bytes, 1, (size_t)end, f) != (size_t)end) {
    snprintf(why, size, "cannot read '%s'", path);
    free(bytes);
    bytes = NULL;
  } else {
    *length = (size_t)end;
  }
  if (f) fclose(f);
  return bytes;
}

unsigned char *fmi_read_block_file(const char *location, size_t *length, char *why, size_t size) {
  char *path = fmi_resource(location, "block.bin", why, size);
  unsigned char *bytes = path ? fmi_read_file(path, length, why, size) : NULL;
  free(path);
  return bytes;
}
