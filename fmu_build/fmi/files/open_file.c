/* open_file.c - importers pass paths in UTF-8, which fopen() of Windows would read in the local code page.
 * A separate file, because windows.h and instance.h define BOOLEAN and ERROR differently. */
#include "fmi/files/open_file.h"
#ifdef _WIN32
#include <stdlib.h>
#include <windows.h>

FILE *fmi_open_file(const char *path) {
  const int n = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, NULL, 0);
  wchar_t *wide = n > 0 ? malloc((size_t)n * sizeof *wide) : NULL;
  FILE *f = wide && MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, n) ? _wfopen(wide, L"rb") : NULL;
  free(wide);
  return f;
}
#else
FILE *fmi_open_file(const char *path) { return fopen(path, "rb"); }
#endif
