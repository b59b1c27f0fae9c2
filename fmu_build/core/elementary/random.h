/* random.h - counter-based random numbers: the k-th number of a seed is a function of (seed, k).  No state is stored,
 * any number can be drawn at any time, and all platforms give the same bits.
 *
 * The generator is SplitMix64 (Steele, Lea & Flood, OOPSLA 2014, figure 16), whose k-th output is a hash of
 * seed + (k + 1) gamma. */
#ifndef HYST_RANDOM_H
#define HYST_RANDOM_H
#include "core/elementary/elementary_sine.h"
#include "core/hyst.h"

static inline uint64_t hyst_random_bits(uint64_t seed, uint64_t k) {
  uint64_t z = seed + (k + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return z ^ z >> 31;
}

/* uniform in [0, 1): 53 bits */
static inline double hyst_random_uniform(uint64_t seed, uint64_t k) {
  return (double)(hyst_random_bits(seed, k) >> 11) * 1.1102230246251565e-16; /* 2^-53 */
}

/* standard normal: Box & Muller 1958, the cosine of the pair; 1 - uniform is never 0 */
static inline double hyst_random_normal(uint64_t seed, uint64_t k) {
  const double radius = hyst_sqrt(-2 * hyst_log(1 - hyst_random_uniform(seed, 2 * k)));
  return radius * hyst_cos(HYST_2PI * hyst_random_uniform(seed, 2 * k + 1));
}
#endif
