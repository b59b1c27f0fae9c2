/* piecewise.h - the initial loading curve of a sum of plays, phi(q) = w0 q + sum_{r_i < q} w_i (q - r_i), and its
 * inverse, by prefix sums: phi(q) = W_j q - R_j with j the number of thresholds below q.
 *
 * j follows from a table of n buckets over the thresholds and a binary search over the thresholds of the fullest
 * bucket: 1 or 2 for equidistant thresholds, at most n.  All searches have the same number of steps and no branch to
 * mispredict. Source: Krejci & Kuhnen 2001, eq. 10-14 (loading curve and inverse). */
#ifndef HYST_PIECEWISE_H
#define HYST_PIECEWISE_H
#include "core/hyst.h"

/* One DERIVED row: knots[n], segments W_0 R_0 W_1 R_1 ... [2n+2], buckets[n], scale, most. */
#define HYST_PIECEWISE(n) (4 * (n) + 4)

typedef struct {
  const double *row;
  int n;
} hyst_piecewise;

/* (W_j, R_j) of the segment that contains q > 0; j is the number of knots below q */
static inline const double *hyst_piecewise_at(const hyst_piecewise *f, double q) {
  const int n = f->n;
  const double *segment = f->row + n, *bucket = f->row + 3 * n + 2, *last = f->row + 4 * n + 2;
  const double place = q * last[0]; /* the scale: buckets per unit of q */
  /* q < 0 is possible only with an invalid saved memory */
  const double *knot = f->row + (int)bucket[place >= n ? n - 1 : place >= 0 ? (int)place : 0];
  int left = (int)last[1]; /* knots in the fullest bucket */
  while (left > 1) {
    const int half = left / 2;
    knot += half & -(knot[half - 1] < q);
    left -= half;
  }
  return segment + 2 * (knot - f->row + (*knot < q));
}

static inline double hyst_piecewise_forward(const hyst_piecewise *f, double q) {
  const double *s = hyst_piecewise_at(f, q);
  return q * s[0] - s[1];
}

static inline double hyst_piecewise_inverse(const hyst_piecewise *f, double v) {
  const double *s = hyst_piecewise_at(f, v);
  return (v + s[1]) / s[0];
}

/* W_j of the segment at q >= 0 for increasing, or decreasing, q */
static inline double hyst_piecewise_slope_at(const hyst_piecewise *f, double q, int grows) {
  const double *s = hyst_piecewise_at(f, q);
  for (int j = (int)(s - f->row - f->n) / 2; grows && j < f->n && f->row[j] <= q; j++) s += 2;
  return *s;
}

/* slope of the whole curve; the steady output is this times the input */
static inline double hyst_piecewise_slope(const hyst_piecewise *f) { return f->row[3 * f->n]; }

/* The branches of the operator and its inverse: the curve scaled by two (Masing). */
static inline double hyst_piecewise_branch(const void *f, double d) {
  return 2 * hyst_piecewise_forward((const hyst_piecewise *)f, 0.5 * d);
}
static inline double hyst_piecewise_inverse_branch(const void *f, double d) {
  return 2 * hyst_piecewise_inverse((const hyst_piecewise *)f, 0.5 * d);
}

static inline double hyst_piecewise_branch_slope(const void *f, double d, int grows) {
  return hyst_piecewise_slope_at((const hyst_piecewise *)f, 0.5 * d, grows);
}
static inline double hyst_piecewise_inverse_branch_slope(const void *f, double d, int grows) {
  return 1 / hyst_piecewise_slope_at((const hyst_piecewise *)f, 0.5 * d, grows);
}

/* running sum with compensated rounding error (Neumaier), because signed weights cancel */
typedef struct {
  double sum, lost;
} hyst_exact_sum;

static inline void hyst_exact_add(hyst_exact_sum *s, double v) {
  const double t = s->sum + v;
  const double big = s->sum < 0 ? -s->sum : s->sum, small = v < 0 ? -v : v;
  s->lost += big >= small ? (s->sum - t) + v : (v - t) + s->sum;
  s->sum = t;
}

/* Fills the row from thresholds r (>= 0, not decreasing) and weights; invert: the knots become the outputs at the
 * thresholds.  Returns NULL or an error. */
static inline const char *hyst_piecewise_build(double *row, int n, double w0, const double *r, const double *w,
                                               int invert) {
  double *knots = row, *segment = row + n, *bucket = row + 3 * n + 2;
  hyst_exact_sum slope = {w0, 0}, offset = {0, 0}, height = {0, 0};
  segment[0] = w0;
  segment[1] = 0;
  if (invert && !(w0 > 0))
    return "w0 must be greater than 0: without a linear term the slope is zero after every reversal and no continuous "
           "inverse exists";
  for (int i = 0; i < n; i++) {
    const double W = segment[2 * i];
    if (i > 0 && r[i] < r[i - 1]) return "the thresholds r must not decrease";
    hyst_exact_add(&height, W * (i > 0 ? r[i] - r[i - 1] : r[i])); /* equal thresholds give equal knots */
    knots[i] = invert ? height.sum + height.lost : r[i];
    hyst_exact_add(&slope, w[i]);
    hyst_exact_add(&offset, w[i] * r[i]);
    segment[2 * i + 2] = slope.sum + slope.lost;
    segment[2 * i + 3] = offset.sum + offset.lost;
    /* a segment between equal thresholds is never used */
    if (invert && !(segment[2 * i + 2] > 0) && (i == n - 1 || r[i + 1] > r[i]))
      return "w0 + w_1 + ... + w_i must be greater than 0 for every i, so that the loading curve increases";
  }
  /* bucket[b]: the first knot in bucket b or later; the last ones are lowered so that searches stay in the table */
  const double top = knots[n - 1];
  const double scale = top > 0 ? n / top : 0;
  int most = 1;
  for (int b = 0, i = 0; b < n; b++) {
    const int first = i;
    bucket[b] = first;
    while (i < n && (b == n - 1 || knots[i] * scale < b + 1)) i++;
    if (i - first > most) most = i - first;
  }
  for (int b = 0; b < n; b++)
    if (bucket[b] > n - most) bucket[b] = n - most;
  row[4 * n + 2] = scale;
  row[4 * n + 3] = most;
  return NULL;
}
#endif
