/* odd_branch.h - the branch of the constraint-factor operator, g(d) = (1 - e^-d) (a0 + sum_{j=1..m} a_j
 * d^(2j-1)), its slope, the check that it increases, its sizes and rows: shared by the operator and its exact inverse.
 *
 * prepare() checks g' at 4097 equidistant points of [0, d_max]; between them the branch can decrease by less than
 * (d_max / 4096)^3 max|g'''| / 12.  Beyond d_max the branch is a straight line, because a polynomial of degree 2m - 1
 * is meaningless outside its data. */
#ifndef HYST_ODD_BRANCH_H
#define HYST_ODD_BRANCH_H
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define HYST_ODD_CELLS 4096

#define HYST_ODD_DIMS(D)                 \
  D(m, 1, 1, 20, "number of odd powers") \
  D(depth, 256, 4, 100000, "maximum number of stored extrema")
#define HYST_ODD_ROWS(V)                                                                                          \
  V(a0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "constant of the polynomial: slope at the branch start") \
  V(a, FIXED, m, "real", "1", 1.0, -HYST_INF, HYST_INF, "coefficients of d, d^3, .., d^(2m-1)")                   \
  V(d_max, FIXED, 1, "real", "1", 10.0, HYST_POSITIVE, HYST_INF,                                                  \
    "longest branch of the polynomial, then a straight line; a virgin branch counts double")

typedef struct {
  double a0;
  const double *a;
  int m;
  double d_max;
  const double *edge; /* g and g' at d_max */
} hyst_odd;

static inline hyst_odd hyst_odd_of(double a0, const double *a, int m, double d_max, const double *edge) {
  const hyst_odd l = {a0, a, m, d_max, edge};
  return l;
}

static inline double hyst_odd_branch(const void *ctx, double d) {
  const hyst_odd *l = (const hyst_odd *)ctx;
  double odd = 0;
  if (d > l->d_max) return l->edge[0] + l->edge[1] * (d - l->d_max);
  for (int j = l->m - 1; j >= 0; j--) odd = odd * (d * d) + l->a[j];
  return -hyst_expm1(-d) * (l->a0 + odd * d);
}

static inline double hyst_odd_slope(const hyst_odd *l, double d) {
  const double m = hyst_expm1(-d);
  double odd = 0, d_odd = 0; /* odd(d^2) d is the odd part, d_odd(d^2) its derivative */
  for (int j = l->m - 1; j >= 0; j--) {
    odd = odd * (d * d) + l->a[j];
    d_odd = d_odd * (d * d) + (2 * j + 1) * l->a[j];
  }
  return (1 + m) * (l->a0 + odd * d) - m * d_odd;
}

/* a hyst_branch_slope; beyond d_max the branch is a straight line */
static inline double hyst_odd_branch_slope(const void *ctx, double d, int grows) {
  const hyst_odd *l = (const hyst_odd *)ctx;
  (void)grows;
  return d > l->d_max ? l->edge[1] : hyst_odd_slope(l, d);
}

/* Fills the edge row. */
static inline void hyst_odd_prepare(const hyst_odd *l, double *edge) {
  edge[0] = hyst_odd_branch(l, l->d_max);
  edge[1] = hyst_odd_slope(l, l->d_max);
}

/* Returns the least slope at the equidistant points from number `first` on. */
static inline double hyst_odd_least_slope(const hyst_odd *l, int first) {
  double least = HYST_INF;
  for (int i = first; i <= HYST_ODD_CELLS; i++) {
    const double s = hyst_odd_slope(l, l->d_max * i / HYST_ODD_CELLS);
    if (!(s >= least)) least = s; /* also true for NaN */
  }
  return least;
}

/* g^-1(v), v >= 0, of an increasing branch: Newton's method inside a bracket, with bisection if a step would leave the
 * bracket or gain too little.  Trap: with a0 = 0 the slope at 0 is 0 and g is about d^2 there; with m = 9 it grows like
 * d^18 at the far end.  Newton's method alone is slow in both places.  The last step is below 1e-9 d, and its error of
 * the order of its square. */
static inline double hyst_odd_inverse(const void *ctx, double v) {
  const hyst_odd *l = (const hyst_odd *)ctx;
  if (!(v > 0)) return 0;
  if (v >= l->edge[0]) return l->d_max + (v - l->edge[0]) / l->edge[1];
  double lo = 0, hi = l->d_max, d = 0.5 * hi, before = hi;
  for (int i = 0; i < 200; i++) {
    const double e = hyst_odd_branch(l, d) - v;
    const double newton = e / hyst_odd_slope(l, d);
    if (e < 0) lo = d;
    else hi = d;
    double step = newton;
    /* the comparisons are false for a slope of 0 or NaN */
    if (!(d - newton >= lo && d - newton <= hi && hyst_fabs(newton) <= 0.5 * before)) step = d - (lo + 0.5 * (hi - lo));
    before = hyst_fabs(step);
    d -= step;
    if (before <= 1e-9 * d && step == newton) break;
    if (before <= 1e-16 * d)
      break; /* the bracket has closed; its ends never meet, because g < v only at the lower end */
  }
  return d;
}

static inline double hyst_odd_inverse_slope(const void *ctx, double v, int grows) {
  return 1 / hyst_odd_branch_slope(ctx, hyst_odd_inverse(ctx, v), grows);
}
#endif
