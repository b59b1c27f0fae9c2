/* Elementary functions in float64 without libm, with the same bits from every conforming compiler.
 *
 * They use only + - * / and integer operations on bit patterns, in round-to-nearest, without FMA contraction (compile
 * with -ffp-contract=off), so results do not depend on the platform.  Freestanding, pure, no globals but const tables.
 * Every invalid operation and every NaN argument gives the quiet NaN 0x7ff8000000000000; no errno.
 * Error bounds in the comments are the largest errors found against mpmath, in units in the last place (ulp). */
#ifndef HYST_ELEMENTARY_H
#define HYST_ELEMENTARY_H

#include <stdint.h>

#if defined(__FAST_MATH__)
#error "elementary.h needs IEEE arithmetic: compile without -ffast-math"
#endif
#if defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ != 0
#error "elementary.h needs double arithmetic without excess precision: on 32-bit x86 use -msse2 -mfpmath=sse"
#endif

typedef union {
  double value;
  uint64_t bits;
} hyst_double_bits;

#define HYST_SIGN_BIT 0x8000000000000000u
#define HYST_INF_BITS 0x7ff0000000000000u
#define HYST_NAN_BITS 0x7ff8000000000000u
#define HYST_HIGH_26_BITS 0xfffffffff8000000u /* keeps 26 significant bits: products of two are exact */
#define HYST_ROUNDER 6755399441055744.0       /* 1.5 * 2^52: adding it rounds to an integer, in the low bits */

static inline uint64_t hyst_to_bits(double x) {
  hyst_double_bits u;
  u.value = x;
  return u.bits;
}

static inline double hyst_from_bits(uint64_t bits) {
  hyst_double_bits u;
  u.bits = bits;
  return u.value;
}

static inline double hyst_high_part(double x) { return hyst_from_bits(hyst_to_bits(x) & HYST_HIGH_26_BITS); }

/* a + b = returned sum + *error exactly (Knuth). */
static inline double hyst_two_sum(double a, double b, double *error) {
  double sum = a + b;
  double b_part = sum - a;
  *error = (a - (sum - b_part)) + (b - b_part);
  return sum;
}

#if defined(__GNUC__) /* always inline bit operations, without moves to integer registers */
static inline double hyst_fabs(double x) { return __builtin_fabs(x); }
static inline double hyst_copysign(double x, double sign) { return __builtin_copysign(x, sign); }
#else
static inline double hyst_fabs(double x) { return hyst_from_bits(hyst_to_bits(x) & ~HYST_SIGN_BIT); }
static inline double hyst_copysign(double x, double sign) {
  return hyst_from_bits(hyst_to_bits(hyst_fabs(x)) | (hyst_to_bits(sign) & HYST_SIGN_BIT));
}
#endif

static inline int hyst_isfinite(double x) { return (hyst_to_bits(x) & HYST_INF_BITS) != HYST_INF_BITS; }

/* Largest integer <= x, exact; keeps the sign of zero. */
static inline double hyst_floor(double x) {
  double whole;
  if (x != x) return hyst_from_bits(HYST_NAN_BITS);
  if (hyst_fabs(x) >= 4503599627370496.0) return x; /* 2^52: all larger numbers are integers */
  whole = (double)(int64_t)x;
  return hyst_copysign(whole > x ? whole - 1.0 : whole, x);
}

/* Square root by binary digits, correctly rounded, for positive normal or subnormal x. */
static inline double hyst_sqrt_digits(double x) {
  int subnormal = x < 2.2250738585072014e-308, digit;
  uint64_t bits = hyst_to_bits(subnormal ? x * 18014398509481984.0 : x), remainder = 0, root = 0; /* 2^54 */
  uint64_t radicand = (bits & 0x000fffffffffffffu) | 0x0010000000000000u;
  uint64_t exponent = (bits >> 52) + 1; /* biased by 1024 */
  radicand <<= exponent & 1;
  for (digit = 0; digit < 54; digit++) { /* 53 digits and one for rounding; a tie cannot occur */
    uint64_t pair = digit < 27 ? (radicand >> (52 - 2 * digit)) & 3 : 0;
    uint64_t trial = (root << 2) | 1, take;
    remainder = (remainder << 2) | pair;
    root <<= 1;
    take = (uint64_t)0 - (remainder >= trial); /* a mask, because branches on these digits are unpredictable */
    remainder -= trial & take;
    root |= take & 1;
  }
  root = (root >> 1) + (root & 1);
  return hyst_from_bits(((exponent / 2 + (subnormal ? 483 : 510)) << 52) + root);
}

/* Square root, correctly rounded (0.5 ulp): the instruction if the compiler surely inlines it, else by digits. */
static inline double hyst_sqrt(double x) {
  /* -0, negative, NaN; an integer test, because compilers assume any NaN for sqrt(x) after !(x >= 0) */
  if (hyst_to_bits(x) > HYST_INF_BITS) return x == 0.0 ? x : hyst_from_bits(HYST_NAN_BITS);
#if defined(__NO_MATH_ERRNO__) && (defined(__SSE2_MATH__) || defined(__aarch64__))
  return __builtin_sqrt(x);
#else
  return x == 0.0 || !hyst_isfinite(x) ? x : hyst_sqrt_digits(x);
#endif
}

#define HYST_64_OVER_LN2 92.332482616893657
#define HYST_LN2_OVER_64_HIGH 0.010830424696223417 /* 36 bits: times an integer below 2^17 is exact */
#define HYST_LN2_OVER_64_LOW 2.5728046223276691e-14

/* Rows i = 0 .. 63 of 2^(i/64) = H (1 + T), H its nearest double: { bits of T, bits of H minus (i << 46) }.
 * Adding j << 46 to the second of row (j mod 64) gives the bits of 2^(j/64) for any integer j. */
/* clang-format off */
static const uint64_t hyst_exp2_table[128] = {
0x0000000000000000, 0x3ff0000000000000, 0xbc7160139cd8dc5d, 0x3fefec9a3e778061, 0x3c8cd2523567f613, 0x3fefd9b0d3158574,
0x3c60f74e61e6c861, 0x3fefc74518759bc8, 0x3c979aa65d837b6d, 0x3fefb5586cf9890f, 0x3c3ebe3d702f9cd1, 0x3fefa3ec32d3d1a2,
0xbc9556522a2fbd0e, 0x3fef9301d0125b51, 0xbc91c923b9d5f416, 0x3fef829aaea92de0, 0xbc801b15eaa59348, 0x3fef72b83c7d517b,
0x3c8b898c3f1353bf, 0x3fef635beb6fcb75, 0x3c9aecf73e3a2f60, 0x3fef54873168b9aa, 0x3c8a6f4144a6c38d, 0x3fef463b88628cd6,
0x3c968efde3a8a894, 0x3fef387a6e756238, 0x3c80472b981fe7f2, 0x3fef2b4565e27cdd, 0x3c82f7e16d09ab31, 0x3fef1e9df51fdee1,
0x3c8b3782720c0ab4, 0x3fef1285a6e4030b, 0x3c834d754db0abb6, 0x3fef06fe0a31b715, 0x3c8fdd395dd3f84a, 0x3feefc08b26416ff,
0xbc924aedcc4b5068, 0x3feef1a7373aa9cb, 0xbc71d1e83e9436d2, 0x3feee7db34e59ff7, 0x3c859f48a72a4c6d, 0x3feedea64c123422,
0xbc58a78f4817895b, 0x3feed60a21f72e2a, 0x3c4363ed60c2ac11, 0x3feece086061892d, 0x3c6ecce1daa10379, 0x3feec6a2b5c13cd0,
0x3c7690cebb7aafb0, 0x3feebfdad5362a27, 0xbc8f94340071a38e, 0x3feeb9b2769d2ca7, 0xbc78dec6bd0f385f, 0x3feeb42b569d4f82,
0x3c93350518fdd78e, 0x3feeaf4736b527da, 0x3c9063e1e21c5409, 0x3feeab07dd485429, 0x3c9432e62b64c035, 0x3feea76f15ad2148,
0xbc8c33c53bef4da8, 0x3feea47eb03a5585, 0xbc93cedd78565858, 0x3feea23882552225, 0xbc93b3efbf5e2228, 0x3feea09e667f3bcd,
0xbc6367efb86da9ee, 0x3fee9fb23c651a2f, 0xbc781f647e5a3ecf, 0x3fee9f75e8ec5f74, 0xbc8619321e55e68a, 0x3fee9feb564267c9,
0xbc7b32dcb94da51d, 0x3feea11473eb0187, 0x3c65ebe1abd66c55, 0x3feea2f336cf4e62, 0xbc9369b6f13b3734, 0x3feea589994cce13,
0xbc94d450d872576e, 0x3feea8d99b4492ed, 0x3c8db72fc1f0eab4, 0x3feeace5422aa0db, 0x3c7bf68359f35f44, 0x3feeb1ae99157736,
0xbc5da9b88b6c1e29, 0x3feeb737b0cdc5e5, 0xbc92434322f4f9aa, 0x3feebd829fde4e50, 0x3c71affc2b91ce27, 0x3feec49182a3f090,
0xbc87c50422622263, 0x3feecc667b5de565, 0xbc91bbd1d3bcbb15, 0x3feed503b23e255d, 0x3c8469846e735ab3, 0x3feede6b5579fdbf,
0x3c8c1a7792cb3387, 0x3feee89f995ad3ad, 0xbc55c3d956dcaeba, 0x3feef3a2b84f15fb, 0xbc68d6f438ad9334, 0x3feeff76f2fb5e47,
0x3c74ffd70a5fddcd, 0x3fef0c1e904bc1d2, 0x3c736eae30af0cb3, 0x3fef199bdd85529c, 0x3c84e08fd10959ac, 0x3fef27f12e57d14b,
0x3c676b2c6c921968, 0x3fef3720dcef9069, 0xbc8fad5d3ffffa6f, 0x3fef472d4a07897c, 0x3c74a385a63d07a7, 0x3fef5818dcfba487,
0x3c8e5a50d5c192ac, 0x3fef69e603db3285, 0xbc82d52107b43e1f, 0x3fef7c97337b9b5f, 0x3c74b604603a88d3, 0x3fef902ee78b3ff6,
0xbc8ff7128fd391f0, 0x3fefa4afa2a490da, 0x3c8ec3bc41aa2008, 0x3fefba1bee615a27, 0x3c8a64a931d185ee, 0x3fefd0765b6e4540,
0x3c77893b4d91cd9d, 0x3fefe7c1819e90d8,
};
/* clang-format on */

static inline uint64_t hyst_exp2_row(uint64_t j, int k) { return hyst_exp2_table[2 * (j & 63) + (uint64_t)k]; }
static inline double hyst_all(double x) { return x; }
static inline double hyst_choose(uint64_t where, double a, double b) { return where ? a : b; }

#define HYST_OF(name) hyst_##name
#define HYST_T double
#define HYST_BITS uint64_t
#include "core/elementary/exp_formulas.h"

/* exp(x + x_low) / 2^shift for a scale in range after the shift. */
static inline double hyst_exp_shifted(double x, double x_low, int shift) {
  hyst_exp_parts e = hyst_exp_reduce(x);
  double scale = hyst_from_bits(e.scale_bits - ((uint64_t)shift << 52));
  return scale + scale * hyst_exp_series(e.tail, e.r_high - (e.r_low - x_low));
}

/* exp(x + x_low) for |x_low| far below 1: gradual underflow to 0, overflow to infinity. */
static inline double hyst_exp_sum(double x, double x_low) {
  if (hyst_fabs(x) < 707.0) return hyst_exp_shifted(x, x_low, 0);
  if (x > 710.0) return hyst_from_bits(HYST_INF_BITS);
  if (x < -746.0) return 0.0;
  if (x > 0.0) return hyst_exp_shifted(x, x_low, 2) * 4.0;
  return hyst_exp_shifted(x, x_low, -1022) * 2.2250738585072014e-308; /* 2^-1022 */
}

/* e^x by a 64-entry table and a degree 5 remainder: 0.53 ulp, 0.75 ulp below e^-707. */
static inline double hyst_exp(double x) { return x == x ? hyst_exp_sum(x, 0.0) : hyst_from_bits(HYST_NAN_BITS); }

/* e^x - 1 without cancellation: 1.1 ulp. */
static inline double hyst_expm1(double x) {
  double a = hyst_fabs(x), scale;
  hyst_exp_parts e;
  if (!(a > 5.5511151231257827e-17 && a < 40.0)) { /* 2^-54 */
    if (x >= 40.0) return hyst_exp(x);
    if (x <= -40.0) return -1.0;
    return x == x ? x : hyst_from_bits(HYST_NAN_BITS);
  }
  e = hyst_exp_reduce(x);
  scale = hyst_from_bits(e.scale_bits);
  return (scale - 1.0) + scale * hyst_exp_remainder(e);
}

/* Hyperbolic tangent: 1.6 ulp. */
static inline double hyst_tanh(double x) {
  if (hyst_tanh_is_ordinary(x)) return hyst_tanh_ordinary(hyst_exp_reduce(2.0 * hyst_fabs(x)), x);
  if (x != x) return hyst_from_bits(HYST_NAN_BITS);
  return hyst_fabs(x) < 1.0 ? x : hyst_copysign(1.0, x);
}

/* Logistic function; beyond 36 by the series E - E^2 or 1 - E, E = e^-|x|: 1.5 ulp. */
static inline double hyst_sigmoid(double x) {
  double small;
  if (hyst_sigmoid_is_ordinary(x)) return hyst_sigmoid_ordinary(hyst_exp_reduce(-x), x);
  small = hyst_exp(-hyst_fabs(x));
  return x > 0.0 ? 1.0 - small : small - small * small;
}

/* Nearest integer to 64 log2 of the middle of the b-th of 128 equal parts of [1, 2). */
/* clang-format off */
static const uint8_t hyst_log2_table[128] = {
0, 1, 2, 2, 3, 4, 5, 5, 6, 7, 7, 8, 9, 9, 10, 11, 11, 12, 12, 13, 14, 14, 15, 16, 16, 17, 17, 18, 19, 19,
20, 20, 21, 21, 22, 23, 23, 24, 24, 25, 25, 26, 26, 27, 28, 28, 29, 29, 30, 30, 31, 31, 32, 32, 33, 33, 34, 34, 35, 35,
36, 36, 37, 37, 38, 38, 39, 39, 40, 40, 41, 41, 41, 42, 42, 43, 43, 44, 44, 45, 45, 45, 46, 46, 47, 47, 48, 48, 49, 49,
49, 50, 50, 51, 51, 51, 52, 52, 53, 53, 54, 54, 54, 55, 55, 56, 56, 56, 57, 57, 57, 58, 58, 59, 59, 59, 60, 60, 61, 61,
61, 62, 62, 62, 63, 63, 63, 64,
};
/* clang-format on */

/* ln x = returned + *low to about 2^-66 relative, for 0 < x < inf. With x = 2^k m and i = 64 log2 m rounded,
 * ln x = (64 k + i) ln2/64 + ln(m / 2^(i/64)); the table is that of exp, with 1 / 2^(i/64) in row -i. */
static inline double hyst_log_sum(double x, double *low) {
  uint64_t bits = hyst_to_bits(x), m_bits, i;
  int64_t k = -1023;
  double j, h, h_high, inverse, m_minus_h, r, r_high, r_low, square, r2, cubic, j_ln2, sum1, sum, rest, high;
  if (bits < 0x0010000000000000u) {
    bits = hyst_to_bits(x * 4503599627370496.0); /* 2^52 */
    k -= 52;
  }
  k += (int64_t)(bits >> 52);
  m_bits = (bits & 0x000fffffffffffffu) | 0x3ff0000000000000u;
  i = hyst_log2_table[(bits >> 45) & 127];
  j = (double)(64 * k + (int64_t)i);
  h = hyst_from_bits(hyst_exp2_table[2 * (i & 63) + 1] + (i << 46));
  inverse = hyst_from_bits(hyst_exp2_table[2 * (-i & 63) + 1] + (-i << 46));
  /* r = m/h - 1 = r_high + r_low, |r| < 0.0092, with a short r_high so that its products are exact */
  m_minus_h = hyst_from_bits(m_bits) - h;
  r_high = hyst_high_part(m_minus_h * inverse);
  h_high = hyst_high_part(h);
  r_low = ((m_minus_h - r_high * h_high) - r_high * (h - h_high)) * inverse;
  /* ln(1 + r) - ln(1 + T) */
  r = r_high + r_low;
  square = 0.5 * r_high * r_high;
  r2 = r * r;
  cubic = (0.33333333333333331 - r * 0.25000000000000644) +
          r2 * ((0.20000000000000584 - r * 0.16666666605261532) +
                r2 * ((0.14285714229891339 - r * 0.12501466052875762) + r2 * 0.11112443888241949));
  j_ln2 = j * HYST_LN2_OVER_64_HIGH;
  sum1 = j_ln2 + r_high; /* the first term of each sum is 0 or the larger term, so that the errors are exact */
  sum = sum1 - square;
  rest = ((r2 * r * cubic + (r_low - r_low * (r_high + 0.5 * r_low))) +
          (j * HYST_LN2_OVER_64_LOW - hyst_from_bits(hyst_exp2_table[2 * (i & 63)]))) +
         (((j_ln2 - sum1) + r_high) + ((sum1 - sum) - square));
  high = sum + rest;
  *low = (sum - high) + rest;
  return high;
}

/* Natural logarithm: 0.5 ulp. */
static inline double hyst_log(double x) {
  double low;
  if (!(x > 0.0 && hyst_isfinite(x))) {
    if (x == 0.0) return -hyst_from_bits(HYST_INF_BITS);
    return x > 0.0 ? x : hyst_from_bits(HYST_NAN_BITS);
  }
  return hyst_log_sum(x, &low);
}

/* x^y for x >= 0 (a negative x gives NaN, -0 counts as 0) through a two-part logarithm: 0.6 (0.75 where the result is
 * below 1e-307) ulp. x^0 = 1^y = 1 for every x and y, as in C99 Annex F. */
static inline double hyst_pow(double x, double y) {
  double log_high, log_low, log_short, y_short;
  if (y == 0.0 || x == 1.0) return 1.0;
  if (!(x >= 0.0) || y != y) return hyst_from_bits(HYST_NAN_BITS);
  if (x == 0.0 || !hyst_isfinite(x)) return (x == 0.0) == (y > 0.0) ? 0.0 : hyst_from_bits(HYST_INF_BITS);
  if (y > 1e19) y = 1e19; /* overflow or underflow, because |ln x| >= 2^-53 */
  if (y < -1e19) y = -1e19;
  log_high = hyst_log_sum(x, &log_low);
  log_short = hyst_high_part(log_high);
  y_short = hyst_high_part(y);
  log_low += log_high - log_short;
  return hyst_exp_sum(y_short * log_short, y_short * log_low + (y - y_short) * (log_short + log_low));
}
#endif
