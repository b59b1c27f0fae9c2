/* pe_loader.h - loads a 32-bit Windows library into a 32-bit Linux process, which runs its code where no 32-bit wine
 * is: sections, relocations, imports by name, exports by name (Microsoft, PE Format).  It serves one library, and the
 * functions of Windows that an FMU binary imports; another import ends the process with its name. */
#ifndef PE_LOADER_H
#define PE_LOADER_H
#include <fcntl.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

/* code for Windows keeps the stack aligned to 4 bytes, libraries of Linux expect 16 */
#define CDECL __attribute__((force_align_arg_pointer)) static
#define STDCALL __attribute__((stdcall, force_align_arg_pointer)) static

static char *pe_image;
static char pe_path[4096];

STDCALL int pe_module(unsigned flags, const void *address, void **module) {
  (void)flags, (void)address;
  *module = pe_image;
  return 1;
}
STDCALL unsigned pe_name(void *module, uint16_t *to, unsigned size) {
  (void)module;
  unsigned n = 0;
  for (; n + 1 < size && pe_path[n]; n++) to[n] = (unsigned char)pe_path[n];
  to[n] = 0;
  return n;
}
STDCALL int pe_widen(unsigned page, unsigned flags, const char *from, int length, uint16_t *to, int size) {
  (void)page, (void)flags, (void)length; /* -1: up to the zero */
  const int n = (int)strlen(from) + 1;
  for (int k = 0; k < n && k < size; k++) to[k] = (unsigned char)from[k];
  return size && size < n ? 0 : n;
}
STDCALL int pe_narrow(unsigned page, unsigned flags, const uint16_t *from, int length, char *to, int size, void *a,
                      void *b) {
  (void)page, (void)flags, (void)length, (void)a, (void)b;
  int n = 0;
  while (n < size && (to[n] = (char)from[n])) n++;
  return n < size ? n + 1 : 0;
}
CDECL int pe_print(unsigned long long options, char *to, size_t size, const char *form, void *locale, va_list list) {
  (void)options, (void)locale;
  return vsnprintf(to, size, form, list);
}
CDECL FILE *pe_open(const uint16_t *path, const uint16_t *mode) {
  (void)mode;
  char name[4096];
  pe_narrow(0, 0, path, -1, name, sizeof name, NULL, NULL);
  return fopen(name, "rb");
}
CDECL void *pe_malloc(size_t n) { return malloc(n); }
CDECL void *pe_calloc(size_t n, size_t size) { return calloc(n, size); }
CDECL void pe_free(void *p) { free(p); }
CDECL size_t pe_fread(void *to, size_t size, size_t n, FILE *f) { return fread(to, size, n, f); }
CDECL int pe_fclose(FILE *f) { return fclose(f); }
CDECL int pe_fseek(FILE *f, long at, int from) { return fseek(f, at, from); }
CDECL long pe_ftell(FILE *f) { return ftell(f); }
CDECL void *pe_memchr(const void *p, int c, size_t n) { return memchr(p, c, n); }
CDECL int pe_memcmp(const void *a, const void *b, size_t n) { return memcmp(a, b, n); }
CDECL void *pe_memcpy(void *to, const void *from, size_t n) { return memcpy(to, from, n); }
CDECL void *pe_memmove(void *to, const void *from, size_t n) { return memmove(to, from, n); }
CDECL void *pe_memset(void *to, int c, size_t n) { return memset(to, c, n); }
CDECL char *pe_strchr(const char *s, int c) { return strchr(s, c); }
CDECL char *pe_strcat(char *to, const char *s) { return strcat(to, s); }
CDECL int pe_strcmp(const char *a, const char *b) { return strcmp(a, b); }
CDECL int pe_strncmp(const char *a, const char *b, size_t n) { return strncmp(a, b, n); }
CDECL char *pe_strcpy(char *to, const char *s) { return strcpy(to, s); }
CDECL size_t pe_strlen(const char *s) { return strlen(s); }
CDECL size_t pe_strspn(const char *s, const char *set) { return strspn(s, set); }

#define PE(name, function) {#name, (void *)(uintptr_t)(function)}
static const struct {
  const char *name;
  void *function;
} pe_known[] = {
    PE(GetModuleHandleExW, pe_module),
    PE(GetModuleFileNameW, pe_name),
    PE(MultiByteToWideChar, pe_widen),
    PE(WideCharToMultiByte, pe_narrow),
    PE(__stdio_common_vsprintf, pe_print),
    PE(_wfopen, pe_open),
    PE(malloc, pe_malloc),
    PE(calloc, pe_calloc),
    PE(free, pe_free),
    PE(fread, pe_fread),
    PE(fclose, pe_fclose),
    PE(fseek, pe_fseek),
    PE(ftell, pe_ftell),
    PE(memchr, pe_memchr),
    PE(memcmp, pe_memcmp),
    PE(memcpy, pe_memcpy),
    PE(memmove, pe_memmove),
    PE(memset, pe_memset),
    PE(strchr, pe_strchr),
    PE(strcat, pe_strcat),
    PE(strcmp, pe_strcmp),
    PE(strncmp, pe_strncmp),
    PE(strcpy, pe_strcpy),
    PE(strlen, pe_strlen),
    PE(strspn, pe_strspn),
};

static uint32_t pe_u32(const char *p) { return *(const uint32_t *)p; }
static uint16_t pe_u16(const char *p) { return *(const uint16_t *)p; }
static const char *pe_directory(int k) { /* optional header of PE32: data directories from byte 96 */
  return pe_image + pe_u32(pe_image + 0x3c) + 24 + 96 + 8 * k;
}

static void pe_import(void) {
  for (const char *d = pe_image + pe_u32(pe_directory(1)); pe_u32(d + 12); d += 20)
    for (uint32_t *slot = (uint32_t *)(pe_image + pe_u32(d + 16)); *slot; slot++) {
      const char *name = pe_image + *slot + 2;
      const size_t n = sizeof pe_known / sizeof *pe_known;
      size_t k = 0;
      while (k < n && strcmp(pe_known[k].name, name)) k++;
      if (k == n) fprintf(stderr, "unknown import %s of %s\n", name, pe_image + pe_u32(d + 12)), exit(7);
      *slot = (uint32_t)(uintptr_t)pe_known[k].function;
    }
}

static void *pe_load(const char *path) {
  struct stat about;
  const int file = open(path, O_RDONLY);
  if (file < 0 || fstat(file, &about) || !realpath(path, pe_path)) return NULL;
  const char *raw = mmap(NULL, (size_t)about.st_size, PROT_READ, MAP_PRIVATE, file, 0);
  close(file);
  const char *head = raw + pe_u32(raw + 0x3c);
  if (pe_u16(head + 4) != 0x14c || pe_u16(head + 24) != 0x10b) return NULL; /* i386, PE32 */
  const size_t size = pe_u32(head + 24 + 56);
  pe_image = mmap(NULL, size, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pe_image == MAP_FAILED) return NULL;
  memcpy(pe_image, raw, pe_u32(head + 24 + 60));
  const char *section = head + 24 + pe_u16(head + 20);
  for (int k = 0; k < pe_u16(head + 6); k++, section += 40) {
    const uint32_t room = pe_u32(section + 8), stored = pe_u32(section + 16);
    memcpy(pe_image + pe_u32(section + 12), raw + pe_u32(section + 20), stored < room ? stored : room);
  }
  const uint32_t moved = (uint32_t)(uintptr_t)pe_image - pe_u32(head + 24 + 28);
  const char *block = pe_image + pe_u32(pe_directory(5)), *end = block + pe_u32(pe_directory(5) + 4);
  for (; block < end; block += pe_u32(block + 4))
    for (const char *entry = block + 8; entry < block + pe_u32(block + 4); entry += 2)
      if (pe_u16(entry) >> 12 == 3) *(uint32_t *)(pe_image + pe_u32(block) + (pe_u16(entry) & 0xfff)) += moved;
  pe_import();
  return pe_image;
}

static void *pe_find(const char *name) {
  const char *d = pe_image + pe_u32(pe_directory(0));
  for (uint32_t k = 0; k < pe_u32(d + 24); k++)
    if (!strcmp(pe_image + pe_u32(pe_image + pe_u32(d + 32) + 4 * k), name)) {
      const uint16_t at = pe_u16(pe_image + pe_u32(d + 36) + 2 * k);
      return pe_image + pe_u32(pe_image + pe_u32(d + 28) + 4 * at);
    }
  return NULL;
}
#endif
