/* windows.c - replaces the start-up code of the compiler in the Windows binaries: two functions that the C library of
 * Windows has under other names only, an empty entry point, and the 64-bit division of 32-bit processors. */
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

#ifdef __i386__
/* the compiler calls it for int64_t / int64_t; its own library is not linked. The quotient is rounded towards 0. */
long long __divdi3(long long a, long long b);
long long __divdi3(long long a, long long b) {
  const unsigned long long divisor = b < 0 ? 0 - (unsigned long long)b : (unsigned long long)b;
  unsigned long long rest = 0, quotient = a < 0 ? 0 - (unsigned long long)a : (unsigned long long)a;
  for (int bit = 0; bit < 64; bit++) { /* the dividend moves out at the top as the quotient comes in below */
    const unsigned long long carry = rest >> 63;
    rest = rest << 1 | quotient >> 63;
    quotient <<= 1;
    if (carry || rest >= divisor) rest -= divisor, quotient |= 1;
  }
  return (a < 0) != (b < 0) ? (long long)(0 - quotient) : (long long)quotient;
}
#endif
