/* double_double.h - about 32 digits from pairs of doubles, for computations in which rounding errors would accumulate.
 * Dekker, Numer. Math. 18 (1971) 224-242; Hida, Li & Bailey, ARITH-15 (2001). */
#ifndef HYST_DOUBLE_DOUBLE_H
#define HYST_DOUBLE_DOUBLE_H
#include "core/elementary/elementary.h"

typedef struct {
  double hi, lo; /* the value is hi + lo, |lo| <= ulp(hi) / 2 */
} hyst_dd;

static inline hyst_dd hyst_dd_of(double v) {
  const hyst_dd r = {v, 0};
  return r;
}

static inline hyst_dd hyst_dd_add(hyst_dd a, hyst_dd b) {
  double e;
  const double s = hyst_two_sum(a.hi, b.hi, &e);
  hyst_dd r;
  r.hi = hyst_two_sum(s, e + (a.lo + b.lo), &r.lo);
  return r;
}

/* a b = returned + *error, by halves of 26 bits */
static inline double hyst_two_product(double a, double b, double *error) {
  const double product = a * b, a1 = hyst_high_part(a), b1 = hyst_high_part(b), a2 = a - a1, b2 = b - b1;
  *error = ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
  return product;
}

static inline hyst_dd hyst_dd_mul(hyst_dd a, hyst_dd b) {
  double e;
  const double p = hyst_two_product(a.hi, b.hi, &e);
  hyst_dd r;
  r.hi = hyst_two_sum(p, e + (a.hi * b.lo + a.lo * b.hi), &r.lo);
  return r;
}

static inline hyst_dd hyst_dd_div(hyst_dd a, double b) {
  double e;
  const double q = a.hi / b, p = hyst_two_product(q, b, &e);
  hyst_dd r;
  r.hi = hyst_two_sum(q, ((a.hi - p) - e + a.lo) / b, &r.lo);
  return r;
}
#endif
