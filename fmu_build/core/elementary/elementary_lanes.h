/* elementary_lanes.h - two doubles at once: x86-64, aarch64 and wasm process two numbers in the time of one.  Each
 * number passes the same operations as in elementary.h and has the same bits.  Uses the vectors of gcc and clang; with
 * other compilers there is one lane, with the same bits. */
#ifndef HYST_ELEMENTARY_LANES_H
#define HYST_ELEMENTARY_LANES_H
#include "core/elementary/elementary.h"

#ifndef HYST_LANES
#ifdef __GNUC__
#define HYST_LANES 2
#else
#define HYST_LANES 1
#endif
#endif

#if HYST_LANES == 2
typedef double hyst_lanes __attribute__((vector_size(16)));
typedef uint64_t hyst_lanes_bits __attribute__((vector_size(16)));
#define HYST_LANE(x, i) (x)[i]
static inline hyst_lanes hyst_lanes_of(double a, double b) {
  const hyst_lanes x = {a, b};
  return x;
}
static inline hyst_lanes_bits hyst_lanes_to_bits(hyst_lanes x) { return (hyst_lanes_bits)x; }
static inline hyst_lanes hyst_lanes_from_bits(hyst_lanes_bits x) { return (hyst_lanes)x; }
static inline hyst_lanes_bits hyst_lanes_exp2_row(hyst_lanes_bits j, int k) {
  const hyst_lanes_bits at = (j & 63) << 1;
  const uint64_t *const t = hyst_exp2_table + k;
  const hyst_lanes_bits row = {t[at[0]], t[at[1]]};
  return row;
}
static inline hyst_lanes hyst_lanes_choose(hyst_lanes_bits where, hyst_lanes a, hyst_lanes b) {
  return (hyst_lanes)((where & (hyst_lanes_bits)a) | (~where & (hyst_lanes_bits)b));
}
#else
typedef double hyst_lanes;
typedef uint64_t hyst_lanes_bits;
#define HYST_LANE(x, i) (x)
static inline hyst_lanes hyst_lanes_of(double a, double b) { return (void)b, a; }
static inline hyst_lanes_bits hyst_lanes_to_bits(hyst_lanes x) { return hyst_to_bits(x); }
static inline hyst_lanes hyst_lanes_from_bits(hyst_lanes_bits x) { return hyst_from_bits(x); }
static inline hyst_lanes_bits hyst_lanes_exp2_row(hyst_lanes_bits j, int k) { return hyst_exp2_row(j, k); }
static inline hyst_lanes hyst_lanes_choose(hyst_lanes_bits where, hyst_lanes a, hyst_lanes b) { return where ? a : b; }
#endif

static inline hyst_lanes hyst_lanes_all(double a) { return hyst_lanes_of(a, a); }
static inline hyst_lanes hyst_lanes_fabs(hyst_lanes x) {
  return hyst_lanes_from_bits(hyst_lanes_to_bits(x) & ~HYST_SIGN_BIT);
}
static inline hyst_lanes hyst_lanes_copysign(hyst_lanes x, hyst_lanes sign) {
  return hyst_lanes_from_bits((hyst_lanes_to_bits(x) & ~HYST_SIGN_BIT) | (hyst_lanes_to_bits(sign) & HYST_SIGN_BIT));
}

#define HYST_OF(name) hyst_lanes_##name
#define HYST_T hyst_lanes
#define HYST_BITS hyst_lanes_bits
#include "core/elementary/exp_formulas.h"

/* a[i] = f(a[i]) for n elements, at most HYST_LANES_MOST: each stage for all elements before the next, because a single
 * element would mostly wait for its own latency; one by one if the formula does not hold for all. */
enum { HYST_LANES_MOST = 64 / HYST_LANES }; /* with a bound of 8, gcc unrolls every loop, which is slower */
#define HYST_LANES_FUNCTION(f, REDUCED)                                                                \
  static inline void hyst_lanes_##f(hyst_lanes *a, int n) {                                            \
    hyst_lanes_exp_parts e[HYST_LANES_MOST];                                                           \
    hyst_lanes_bits ordinary = hyst_lanes_##f##_is_ordinary(a[0]);                                     \
    for (int i = 1; i < n; i++) ordinary &= hyst_lanes_##f##_is_ordinary(a[i]);                        \
    if (HYST_LANE(ordinary, 0) & HYST_LANE(ordinary, HYST_LANES - 1)) {                                \
      for (int i = 0; i < n; i++) e[i] = hyst_lanes_exp_reduce(REDUCED);                               \
      for (int i = 0; i < n; i++) a[i] = hyst_lanes_##f##_ordinary(e[i], a[i]);                        \
    } else {                                                                                           \
      for (int i = 0; i < n; i++)                                                                      \
        a[i] = hyst_lanes_of(hyst_##f(HYST_LANE(a[i], 0)), hyst_##f(HYST_LANE(a[i], HYST_LANES - 1))); \
    }                                                                                                  \
  }
HYST_LANES_FUNCTION(sigmoid, -a[i])
HYST_LANES_FUNCTION(tanh, 2.0 * hyst_lanes_fabs(a[i]))
#undef HYST_LANES_FUNCTION
#endif
