/* exp_formulas.h - parts of e^x, the logistic function and tanh for any number of lanes: elementary.h includes it for
 * one double, elementary_lanes.h for two with the same instructions.  It has no include guard.
 *   HYST_OF(name)       the name of a function with the prefix of its lanes
 *   HYST_T, HYST_BITS   the double or doubles, and the uint64_t of as many lanes */

/* exp(x) = scale (1 + tail) exp(r_high - r_low), |r| <= ln2/128; scale as bits, because it may be out of range. */
typedef struct {
  HYST_BITS scale_bits;
  HYST_T tail, r_high, r_low;
} HYST_OF(exp_parts);

static inline HYST_OF(exp_parts) HYST_OF(exp_reduce)(HYST_T x) { /* |x| < 2^15 */
  HYST_OF(exp_parts) parts;
  HYST_T rounded = x * HYST_64_OVER_LN2 + HYST_ROUNDER;
  HYST_BITS j = HYST_OF(to_bits)(rounded);
  rounded -= HYST_ROUNDER;
  parts.tail = HYST_OF(from_bits)(HYST_OF(exp2_row)(j, 0));
  parts.scale_bits = HYST_OF(exp2_row)(j, 1) + (j << 46);
  parts.r_high = x - rounded * HYST_LN2_OVER_64_HIGH; /* exact */
  parts.r_low = rounded * HYST_LN2_OVER_64_LOW;
  return parts;
}

/* (1 + tail) exp(r) - 1 with absolute error 2^-59 (degree 5). */
static inline HYST_T HYST_OF(exp_series)(HYST_T tail, HYST_T r) {
  HYST_T r2 = r * r;
  return (tail + r) + r2 * (0.49999999999985073 + r * 0.16666666666664534) +
         (r2 * r2) * (0.041666707395269648 + r * 0.0083333391517045954);
}

/* (1 + tail) exp(r) - 1 to full relative accuracy (degree 6), which e^x - 1 needs near 0. */
static inline HYST_T HYST_OF(exp_remainder)(HYST_OF(exp_parts) e) {
  HYST_T r = e.r_high - e.r_low;
  HYST_T r2 = r * r;
  HYST_T curve = r2 * (0.5 + r * 0.16666666666661334) +
                 (r2 * r2) * (0.041666666666660003 + r * 0.0083333406062977809 + r2 * 0.0013888897980093707);
  return e.r_high + (curve + (e.tail - e.r_low));
}

/* Logistic function 1 / (1 + E), E = e^-x, for ordinary x; e: parts of -x. */
static inline HYST_BITS HYST_OF(sigmoid_is_ordinary)(HYST_T x) { return (HYST_BITS)(HYST_OF(fabs)(x) < 36.0); }
static inline HYST_T HYST_OF(sigmoid_ordinary)(HYST_OF(exp_parts) e, HYST_T x) {
  (void)x;
  HYST_T scale = HYST_OF(from_bits)(e.scale_bits);
  HYST_T one_plus = 1.0 + scale; /* exact with the error below, because scale < 2^52 */
  HYST_T small = (scale - (one_plus - 1.0)) + scale * HYST_OF(exp_series)(e.tail, e.r_high - e.r_low);
  return 1.0 / (one_plus + small);
}

/* With E = e^(2|x|) - 1: tanh|x| = E/2 - (E^2/2) / (E + 2) up to |x| = ln(2)/2, where the quotient is a correction,
 * E / (E + 2) up to ln(4)/2, and 1 - 2 / (E + 2) above.  Selected without branches, for speed.  For ordinary x; e:
 * parts of 2|x|. */
static inline HYST_BITS HYST_OF(tanh_is_ordinary)(HYST_T x) {
  HYST_T a = HYST_OF(fabs)(x);
  return (HYST_BITS)(a > 3.7252902984619141e-9) & (HYST_BITS)(a < 20.0); /* 2^-28 */
}
static inline HYST_T HYST_OF(tanh_ordinary)(HYST_OF(exp_parts) e, HYST_T x) {
  HYST_T scale = HYST_OF(from_bits)(e.scale_bits);
  HYST_T growth = scale * HYST_OF(exp_remainder)(e);
  HYST_T big_e = (scale - 1.0) + growth;
  HYST_T big_e_low = ((scale - 1.0) - big_e) + growth;
  HYST_BITS below_2 = (HYST_BITS)(scale < 2.0), below_4 = (HYST_BITS)(scale < 4.0);
  HYST_T zero = HYST_OF(all)(0.0);
  HYST_T head = HYST_OF(choose)(below_4, zero, HYST_OF(all)(1.0));
  HYST_T numerator = HYST_OF(choose)(below_4, -big_e, HYST_OF(all)(2.0));
  HYST_T low = HYST_OF(choose)(below_2, 0.5 * big_e_low, zero);
  head = HYST_OF(choose)(below_2, 0.5 * big_e, head);
  numerator = HYST_OF(choose)(below_2, 0.5 * big_e * big_e, numerator);
  return HYST_OF(copysign)(head + (low - numerator / (big_e + 2.0)), x);
}
#undef HYST_OF
#undef HYST_T
#undef HYST_BITS
