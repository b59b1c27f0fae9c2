/* value.c - value.h. */
#include "container/value.h"

#include <errno.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

static const value_type FMI2[] = {{'d', sizeof(fmi2Real), "Real"},
                                  {'i', sizeof(fmi2Integer), "Integer"},
                                  {'?', sizeof(fmi2Boolean), "Boolean"},
                                  {'s', sizeof(fmi2String), "String"}};
static const value_type FMI3[] = {
    {'d', sizeof(fmi3Float64), "Float64"}, {'f', sizeof(fmi3Float32), "Float32"}, {'b', sizeof(fmi3Int8), "Int8"},
    {'B', sizeof(fmi3UInt8), "UInt8"},     {'h', sizeof(fmi3Int16), "Int16"},     {'H', sizeof(fmi3UInt16), "UInt16"},
    {'i', sizeof(fmi3Int32), "Int32"},     {'I', sizeof(fmi3UInt32), "UInt32"},   {'q', sizeof(fmi3Int64), "Int64"},
    {'Q', sizeof(fmi3UInt64), "UInt64"},   {'?', sizeof(fmi3Boolean), "Boolean"}, {'s', sizeof(fmi3String), "String"},
    {'e', sizeof(fmi3Int64), "Int64"}};

const value_type *value_type_of(char letter, int fmi) {
  const value_type *list = fmi == 2 ? FMI2 : FMI3;
  const size_t n = fmi == 2 ? sizeof FMI2 / sizeof *FMI2 : sizeof FMI3 / sizeof *FMI3;
  for (size_t k = 0; k < n; k++)
    if (list[k].letter == letter) return list + k;
  return NULL;
}

static bool is_signed(const value_type *t) { return t->letter >= 'a'; }
/* whole numbers lie below it; an enumeration has 32 bits, as in `carried.py` */
static double above(const value_type *t) {
  double limit = 1;
  for (size_t k = is_signed(t); k < (t->letter == 'e' ? 32 : 8 * t->size); k++) limit *= 2;
  return limit;
}
static bool fits(const value_type *t, double x) { return x >= (is_signed(t) ? -above(t) : 0) && x < above(t); }

/* to the nearest whole number, halves to the even one, without libm */
static double rounded(double x) {
  if (!(x > -0x1p52 && x < 0x1p52)) return x; /* whole, or not a number */
  int64_t n = (int64_t)x;
  const double rest = x - (double)n;
  if (rest > 0.5 || (rest == 0.5 && n % 2 != 0)) n++;
  if (rest < -0.5 || (rest == -0.5 && n % 2 != 0)) n--;
  return (double)n;
}

/* the low bytes of a two's complement, which come first on every platform of an FMU */
static void store(const value_type *t, uint64_t bits, void *to) { memcpy(to, &bits, t->size); }

bool value_from_double(const value_type *t, double x, void *to) {
  switch (t->letter) {
    case 'd': *(double *)to = x; return 0;
    case 'f': *(float *)to = (float)x; return 0;
    case '?':
      if (!(x - x == 0)) return 1;
      if (t->size == sizeof(fmi3Boolean)) *(fmi3Boolean *)to = x >= 0.5;
      else *(fmi2Boolean *)to = x >= 0.5;
      return 0;
    default:
      x = rounded(x);
      if (!fits(t, x)) return 1;
      store(t, x < 0 ? (uint64_t)(int64_t)x : (uint64_t)x, to);
      return 0;
  }
}

double value_to_double(const value_type *t, const void *from) {
  switch (t->letter) {
    case 'd': return *(const double *)from;
    case 'f': return (double)*(const float *)from;
    case 'b': return *(const int8_t *)from;
    case 'B': return *(const uint8_t *)from;
    case 'h': return *(const int16_t *)from;
    case 'H': return *(const uint16_t *)from;
    case 'i': return *(const int32_t *)from;
    case 'I': return *(const uint32_t *)from;
    case 'e':
    case 'q': return (double)*(const int64_t *)from;
    case 'Q': return (double)*(const uint64_t *)from;
    default: /* any byte but 0 is true, whatever a foreign unit writes */
      for (size_t k = 0; k < t->size; k++)
        if (((const unsigned char *)from)[k]) return 1;
      return 0;
  }
}

bool value_from_text(const value_type *t, const char *word, void *to) {
  char *end;
  errno = 0;
  if (t->letter == 'd' || t->letter == 'f') {
    const uint64_t bits = strtoull(word, &end, 16);
    double x;
    memcpy(&x, &bits, sizeof x);
    return *end || strlen(word) != 16 || value_from_double(t, x, to);
  }
  if (t->letter == '?') return (strcmp(word, "0") && strcmp(word, "1")) || value_from_double(t, word[0] - '0', to);
  if (t->letter == 's' || !*word) return 1;
  if (t->letter == 'Q') {
    const unsigned long long v = strtoull(word, &end, 10);
    store(t, v, to);
    return *end || errno || *word == '-';
  }
  const long long v = strtoll(word, &end, 10);
  store(t, (uint64_t)v, to);
  return *end || errno || !(t->letter == 'q' || fits(t, (double)v));
}
