/* elementary_pair.h - two doubles at once: in the registers of every x86-64, aarch64 or wasm machine two numbers take
 * the time of one.  Each goes through the operations, and so gets the bits, that it has alone in elementary.h.
 * The vectors are those of gcc and clang; without them a pair does not exist and HYST_PAIR is not defined. */
#ifndef HYST_ELEMENTARY_PAIR_H
#define HYST_ELEMENTARY_PAIR_H
#include "elementary.h"

#if defined(__GNUC__)
#define HYST_PAIR
typedef double hyst_pair __attribute__((vector_size(16)));
typedef uint64_t hyst_pair_bits __attribute__((vector_size(16)));

static inline hyst_pair_bits hyst_pair_to_bits(hyst_pair x) { return (hyst_pair_bits)x; }
static inline hyst_pair hyst_pair_from_bits(hyst_pair_bits x) { return (hyst_pair)x; }
static inline hyst_pair hyst_pair_of(double a, double b) {
  const hyst_pair x = {a, b};
  return x;
}
static inline hyst_pair hyst_pair_all(double a) { return hyst_pair_of(a, a); }
static inline hyst_pair hyst_pair_choose(hyst_pair_bits where, hyst_pair a, hyst_pair b) {
  return (hyst_pair)((where & (hyst_pair_bits)a) | (~where & (hyst_pair_bits)b));
}
static inline hyst_pair hyst_pair_fabs(hyst_pair x) { return (hyst_pair)((hyst_pair_bits)x & ~HYST_SIGN_BIT); }
static inline hyst_pair hyst_pair_copysign(hyst_pair x, hyst_pair sign) {
  return (hyst_pair)(((hyst_pair_bits)x & ~HYST_SIGN_BIT) | ((hyst_pair_bits)sign & HYST_SIGN_BIT));
}
static inline hyst_pair_bits hyst_pair_exp2_row(hyst_pair_bits j, int k) {
  const hyst_pair_bits at = (j & 63) << 1;
  const hyst_pair_bits row = {hyst_exp2_table[at[0] + (unsigned)k], hyst_exp2_table[at[1] + (unsigned)k]};
  return row;
}

#define HYST_OF(name) hyst_pair_##name
#define HYST_T hyst_pair
#define HYST_BITS hyst_pair_bits
#include "exp_formulas.h"

#endif
#endif
