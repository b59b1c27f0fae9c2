/* own_folder.c - the folder of this binary, of which the system knows the path.
 * Linux: dl_iterate_phdr, because dladdr is in libdl before glibc 2.34, and an FMU needs libc only.
 * A separate file because of windows.h, see open_file.c, and of _GNU_SOURCE, which precedes all headers. */
#define _GNU_SOURCE
#include "fmi/files/own_folder.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const char here = 0; /* an address in this binary */
#ifdef _WIN32
static const char SEPARATORS[] = "/\\";
#else
static const char SEPARATORS[] = "/";
#endif

/* of a name of this binary; a program that contains the FMU has none on Linux */
static char *join(const char *name, const char *path) {
  size_t n = strlen(name);
  while (n > 0 && !strchr(SEPARATORS, name[n - 1])) n--;
  char *made = n > 0 ? (char *)malloc(n + strlen(path) + 1) : NULL;
  if (!made) return NULL;
  memcpy(made, name, n);
  strcpy(made + n, path);
  return made;
}

#ifdef _WIN32
#include <windows.h>

enum { LONGEST = 32768 }; /* UTF-16 units in a path of Windows; at most three bytes each in UTF-8 */

char *fmi_beside(const char *path) {
  const DWORD how = GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT;
  HMODULE module;
  wchar_t *wide = (wchar_t *)malloc(LONGEST * sizeof *wide);
  char *name = (char *)malloc(3 * LONGEST), *made = NULL;
  if (wide && name && GetModuleHandleExW(how, (const wchar_t *)&here, &module)) {
    const DWORD n = GetModuleFileNameW(module, wide, LONGEST);
    if (n > 0 && n < LONGEST && WideCharToMultiByte(CP_UTF8, 0, wide, -1, name, 3 * LONGEST, NULL, NULL))
      made = join(name, path);
  }
  free(wide);
  free(name);
  return made;
}
#elif defined(__linux__)
#include <link.h>

static int holds_here(struct dl_phdr_info *info, size_t size, void *name) {
  (void)size;
  for (int k = 0; k < info->dlpi_phnum; k++) {
    const ElfW(Phdr) *part = info->dlpi_phdr + k;
    const uintptr_t begin = info->dlpi_addr + part->p_vaddr, at = (uintptr_t)&here;
    if (part->p_type != PT_LOAD || at - begin >= part->p_memsz) continue;
    *(const char **)name = info->dlpi_name;
    return 1;
  }
  return 0;
}

char *fmi_beside(const char *path) {
  const char *name = "";
  dl_iterate_phdr(holds_here, &name);
  return join(name, path);
}
#else
#include <dlfcn.h>

char *fmi_beside(const char *path) {
  Dl_info info;
  return dladdr(&here, &info) && info.dli_fname ? join(info.dli_fname, path) : NULL;
}
#endif
