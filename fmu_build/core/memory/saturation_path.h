/* saturation_path.h - the solution of dx/dt = 1 - s x^n, s = 1 or -1, x = 0 at t = 0, as smooth functions, by series
 * and Newton's method: slow and accurate, for the polynomials of saturation.h.
 *
 * With q = x^n and r = q for s = 1, q / (1 + q) for s = -1,
 *   n dt = r^(1/n - 1) (1 - r)^(e - 1) dr,   e = 0 for s = 1, 1 - 1/n for s = -1:
 * an incomplete beta function, which has a series in r for r <= 1/2 and another in 1 - r beyond. */
#ifndef HYST_SATURATION_PATH_H
#define HYST_SATURATION_PATH_H
#include "core/elementary/elementary.h"
#include "core/hyst.h"

typedef struct {
  double s, n, e;
  double half;      /* t at r = 1/2 */
  double left_half; /* n times the path from there to r = 1, less its infinite part 1 / e */
} hyst_saturation_law;

/* (e^(c x) - 1) / c and its inverse */
static inline double hyst_grown(double c, double x) { return c == 0 ? x : hyst_expm1(c * x) / c; }
static inline double hyst_shrunk(double c, double x) { /* log(1 + c x) / c */
  const double one = 1 + c * x;
  return one == 1 ? x : x * (hyst_log(one) / (one - 1));
}

/* sum_{k >= 1} (m)_k / k! x^k / (k d + o), x <= 1/2: both series of the beta function without their first terms */
HYST_COLD static inline double hyst_saturation_series(double m, double x, double d, double o) {
  double sum = 0, term = m * x;
  for (int k = 1; k < 64 && term > 1e-18; k++) {
    sum += term / (k * d + o);
    term *= (m + k) / (k + 1) * x;
  }
  return sum;
}
HYST_COLD static inline double hyst_saturation_low(const hyst_saturation_law *l, double r) {
  return hyst_saturation_series(1 - l->e, r, l->n, 1);
}
HYST_COLD static inline double hyst_saturation_high(const hyst_saturation_law *l, double rest) {
  return hyst_saturation_series(1 - 1 / l->n, rest, 1, l->e);
}

HYST_COLD static inline hyst_saturation_law hyst_saturation_law_of(double s, double n) {
  hyst_saturation_law l = {s, n, s < 0 ? 1 - 1 / n : 0, 0, 0};
  l.half = hyst_pow(0.5, 1 / n) * (1 + hyst_saturation_low(&l, 0.5));
  l.left_half = -hyst_grown(l.e, hyst_log(0.5)) - hyst_pow(0.5, l.e) * hyst_saturation_high(&l, 0.5);
  return l;
}

/* (t / x - 1) / q, r <= 1/2 */
HYST_COLD static inline double hyst_saturation_early_path(const void *law, double q) {
  const hyst_saturation_law *l = (const hyst_saturation_law *)law;
  if (l->s > 0) return hyst_saturation_low(l, q) / q;
  const double r = q / (1 + q), shorter = hyst_expm1(hyst_shrunk(-1, r) / -l->n); /* r^(1/n) / x - 1 */
  return (shorter + (1 + shorter) * hyst_saturation_low(l, r)) / q;
}

/* (x / t - 1) / t^n for t^n, r <= 1/2 */
HYST_COLD static inline double hyst_saturation_early(const void *law, double power) {
  const hyst_saturation_law *l = (const hyst_saturation_law *)law;
  const double t = hyst_pow(power, 1 / l->n);
  double g = hyst_pow(0.5, 1 / l->n), r = 0.5, step = g;       /* g = r^(1/n); t(g) is convex */
  for (int i = 0; i < 20 && hyst_fabs(step) > 1e-9 * g; i++) { /* the error is then of the order of its square */
    step = (t - g * (1 + hyst_saturation_low(l, r))) * hyst_pow(1 - r, 1 - l->e);
    g += step;
    r = hyst_pow(g, l->n);
  }
  const double q = l->s > 0 ? r : r / (1 - r), more = q * hyst_saturation_early_path(l, q);
  return -more / (1 + more) / power;
}

/* From r = 1/2 on the solution is a smooth function of E, which falls from 1 to 0 with bend = 1 - e left_half in
 *   t = half - bend (E^e - 1) / (e n).
 * log(E / 2 rest) for rest = 1 - r <= 1/2 */
HYST_COLD static inline double hyst_saturation_late_path(const void *law, double rest) {
  const hyst_saturation_law *l = (const hyst_saturation_law *)law;
  return hyst_shrunk(l->e, hyst_saturation_high(l, rest)) - hyst_shrunk(l->e, -l->left_half) - hyst_log(2);
}

/* (1 - x) / E for s = 1, x E^(1/n) for s = -1 */
HYST_COLD static inline double hyst_saturation_late(const void *law, double E) {
  const hyst_saturation_law *l = (const hyst_saturation_law *)law;
  double rest = 0.5 * E, step = 1;
  for (int i = 0; i < 40 && hyst_fabs(step) > 1e-9; i++) {
    step = (hyst_log(rest / (0.5 * E)) + hyst_saturation_late_path(l, rest)) *
           (1 + l->e * hyst_saturation_high(l, rest)) * hyst_pow(1 - rest, 1 - 1 / l->n);
    rest *= hyst_exp(-step);
    if (rest > 0.5) rest = 0.5;
  }
  if (l->s < 0) return hyst_pow((1 / rest - 1) * E, 1 / l->n);
  return -hyst_expm1(hyst_shrunk(-1, rest) / -l->n) / E;
}
#endif
