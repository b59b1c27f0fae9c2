/* windows.c - replaces the start-up code of the compiler in the Windows binary: two functions that the C library of
 * Windows has under other names only, and an empty entry point. */
#include <stdarg.h>
#include <stddef.h>

enum { STANDARD_SNPRINTF = 2 }; /* _CRT_INTERNAL_PRINTF_STANDARD_SNPRINTF_BEHAVIOR of corecrt_stdio_config.h */
int __stdio_common_vsprintf(unsigned long long options, char *to, size_t size, const char *format, void *locale,
                            va_list list);

int vsnprintf(char *to, size_t size, const char *format, va_list list) {
  return __stdio_common_vsprintf(STANDARD_SNPRINTF, to, size, format, NULL, list);
}

int snprintf(char *to, size_t size, const char *format, ...) {
  va_list list;
  va_start(list, format);
  const int n = vsnprintf(to, size, format, list);
  va_end(list);
  return n;
}

int __stdcall DllMainCRTStartup(void *module, unsigned long reason, void *reserved) {
  (void)module, (void)reason, (void)reserved;
  return 1;
}
