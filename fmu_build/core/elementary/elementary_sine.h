/* elementary_sine.h - sine and cosine without libm, by the rules of elementary.h. */
#ifndef HYST_ELEMENTARY_SINE_H
#define HYST_ELEMENTARY_SINE_H
#include "core/elementary/elementary.h"

#define HYST_2PI 6.283185307179586

/* x = q pi/2 + *r + *r_low; returns q mod 4. Cody and Waite: pi/2 in parts of 33 bits, so that products with q of
 * 20 bits are exact. A larger |x| loses 19 bits of its quotient per pass. */
static inline unsigned hyst_reduce_pi_2(double x, double *r, double *r_low) {
  double high = x, low = 0.0, q, error1, error2;
  unsigned quadrant = 0;
  do {
    q = high * 0.63661977236758138;
    if (hyst_fabs(q) < 1048576.0) {
      q = (q + HYST_ROUNDER) - HYST_ROUNDER;
    } else {
      q = hyst_from_bits(hyst_to_bits(q) & 0xfffffffe00000000u);
    }
    if (hyst_fabs(q) < 4503599627370496.0) quadrant += (unsigned)((int64_t)q & 3); /* otherwise q is a multiple of 4 */
    high -= q * 1.5707963267341256;
    high = hyst_two_sum(high, -(q * 6.077100506303966e-11), &error1);
    high = hyst_two_sum(high, -(q * 2.0222662487111665e-21), &error2);
    low += (error1 + error2) - q * 8.4784276603688996e-32;
    high = hyst_two_sum(high, low, &low);
  } while (hyst_fabs(q) >= 1048576.0);
  *r = high;
  *r_low = low;
  return quadrant & 3;
}

/* sin(x + x_low) for |x| <= pi/4. */
static inline double hyst_sin_kernel(double x, double x_low) {
  double z = x * x;
  double tail = 0.008333333333330948 +
                z * (-0.00019841269836758557 +
                     z * (2.7557316102543528e-06 + z * (-2.505113184314626e-08 + z * 1.591812916105078e-10)));
  return x + (x_low + z * (x * (-0.16666666666666666 + z * tail) - 0.5 * x_low));
}

/* cos(x + x_low) for |x| <= pi/4. */
static inline double hyst_cos_kernel(double x, double x_low) {
  double z = x * x;
  double tail = 0.041666666666666664 +
                z * (-0.0013888888888887398 +
                     z * (2.4801587298765676e-05 +
                          z * (-2.7557317271724219e-07 + z * (2.0876146267241254e-09 + z * -1.1382632341807706e-11))));
  double top = 1.0 - 0.5 * z;
  return top + (((1.0 - top) - 0.5 * z) + (z * z * tail - x * x_low));
}

/* sin(x + turns pi/2) for turns 0 or 1. */
static inline double hyst_sin_turned(double x, unsigned turns) {
  double r = x, r_low = 0.0, value;
  if (!hyst_isfinite(x)) return hyst_from_bits(HYST_NAN_BITS);
  if (hyst_fabs(x) > 0.78539816339744828) turns += hyst_reduce_pi_2(x, &r, &r_low);
  value = turns & 1 ? hyst_cos_kernel(r, r_low) : hyst_sin_kernel(r, r_low);
  return turns & 2 ? -value : value;
}

/* Sine and cosine: 0.85 ulp up to |x| = 1.6e6, absolute error below 2^-52 up to 2^60; beyond, where neighbouring
 * doubles are many turns apart, a number in [-1, 1] that is the same on every platform. */
static inline double hyst_sin(double x) { return x == 0.0 ? x : hyst_sin_turned(x, 0); }
static inline double hyst_cos(double x) { return hyst_sin_turned(x, 1); }
#endif
