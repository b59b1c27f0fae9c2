/* library.c - library.h: dlopen and LoadLibrary. */
#include "container/library.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>

void *library_open(const char *path, char *why, size_t size) {
  const int n = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, NULL, 0);
  wchar_t *wide = n > 0 ? malloc((size_t)n * sizeof *wide) : NULL;
  HMODULE made = NULL;
  if (wide && MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, n)) {
    for (wchar_t *c = wide; *c; c++)
      if (*c == L'/') *c = L'\\'; /* its own folder is searched for libraries that it needs */
    made = LoadLibraryExW(wide, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
  }
  free(wide);
  if (!made) snprintf(why, size, "error %lu", (unsigned long)GetLastError());
  return made;
}

void (*library_function(void *library, const char *name))(void) {
  FARPROC found = GetProcAddress((HMODULE)library, name);
  void (*made)(void);
  memcpy(&made, &found, sizeof made);
  return made;
}

void library_close(void *library) { FreeLibrary((HMODULE)library); }
#else
#include <dlfcn.h>

void *library_open(const char *path, char *why, size_t size) {
  void *made = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  const char *reason = made ? NULL : dlerror();
  if (!made) snprintf(why, size, "%s", reason ? reason : "no reason given");
  return made;
}

void (*library_function(void *library, const char *name))(void) {
  void *found = dlsym(library, name);
  void (*made)(void);
  memcpy(&made, &found, sizeof made);
  return made;
}

void library_close(void *library) { dlclose(library); }
#endif
