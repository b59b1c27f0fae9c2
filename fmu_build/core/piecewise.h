/* piecewise.h - the initial loading curve of a sum of plays, phi(q) = w0 q + sum_{r_i < q} w_i (q - r_i), and its
 * inverse, by prefix sums: phi(q) = W_j q - R_j with j the number of thresholds below q.
 *
 * j comes from a table of n buckets over the thresholds and a binary search inside one bucket: one or two comparisons
 * for even thresholds, never more than log2(n).  Source: Krejci & Kuhnen 2001, eq. 10-14 (loading curve and inverse).
 */
#ifndef HYST_PIECEWISE_H
#define HYST_PIECEWISE_H
#include "hyst.h"

/* One DERIVED row: knots[n], W[n+1], R[n+1], buckets[n+1], scale. */
#define HYST_PIECEWISE(n) (4 * (n) + 4)

typedef struct {
  int n;
  const double *knots, *W, *R, *bucket;
  double scale; /* buckets per unit of the argument */
} hyst_piecewise;

static inline hyst_piecewise hyst_piecewise_of(const double *row, int n) {
  hyst_piecewise f = {n, row, row + n, row + 2 * n + 1, row + 3 * n + 2, row[4 * n + 3]};
  return f;
}

/* number of knots below q (q > 0) */
static inline int hyst_piecewise_index(const hyst_piecewise *f, double q) {
  const double place = q * f->scale;
  const int b = place < f->n ? (int)place : f->n - 1;
  int lo = (int)f->bucket[b], hi = (int)f->bucket[b + 1];
  while (lo < hi) {
    const int mid = lo + (hi - lo) / 2;
    if (f->knots[mid] < q) lo = mid + 1;
    else hi = mid;
  }
  return lo;
}

static inline double hyst_piecewise_forward(const hyst_piecewise *f, double q) {
  const int j = hyst_piecewise_index(f, q);
  return q * f->W[j] - f->R[j];
}

static inline double hyst_piecewise_inverse(const hyst_piecewise *f, double v) {
  const int j = hyst_piecewise_index(f, v);
  return (v + f->R[j]) / f->W[j];
}

/* The branches of the operator and of its inverse: the curve at twice the scale (Masing). */
static inline double hyst_piecewise_branch(const void* f, double d) { return 2 * hyst_piecewise_forward(f, 0.5 * d); }
static inline double hyst_piecewise_inverse_branch(const void* f, double d) {
  return 2 * hyst_piecewise_inverse(f, 0.5 * d);
}

/* running sum that keeps its rounding error (Neumaier), because signed weights cancel */
typedef struct {
  double sum, lost;
} hyst_sum;

static inline void hyst_sum_add(hyst_sum *s, double v) {
  const double t = s->sum + v;
  const double big = s->sum < 0 ? -s->sum : s->sum, small = v < 0 ? -v : v;
  s->lost += big >= small ? (s->sum - t) + v : (v - t) + s->sum;
  s->sum = t;
}

/* Fill the row from thresholds r (>= 0, not decreasing) and weights; invert: the knots become the outputs at the
 * thresholds. Returns NULL, or what is wrong. */
static inline const char *hyst_piecewise_build(double *row, int n, double w0, const double *r, const double *w,
                                               int invert) {
  double *knots = row, *W = row + n, *R = row + 2 * n + 1, *bucket = row + 3 * n + 2;
  hyst_sum slope = {w0, 0}, offset = {0, 0};
  W[0] = w0;
  R[0] = 0;
  for (int i = 0; i < n; i++) {
    if (i > 0 && r[i] < r[i - 1]) return "the thresholds r must not decrease";
    hyst_sum_add(&slope, w[i]);
    hyst_sum_add(&offset, w[i] * r[i]);
    W[i + 1] = slope.sum + slope.lost;
    R[i + 1] = offset.sum + offset.lost;
    knots[i] = invert ? r[i] * W[i] - R[i] : r[i];
    if (i > 0 && knots[i] < knots[i - 1]) knots[i] = knots[i - 1]; /* by rounding only, if the curve increases */
  }
  if (invert) {
    if (!(w0 > 0))
      return "w0 must be greater than 0: without a linear term the slope is zero after every reversal and no "
             "continuous inverse exists";
    for (int i = 1; i <= n; i++)
      if (!(W[i] > 0) && (i == n || r[i] > r[i - 1])) /* a segment between equal thresholds is never used */
        return "w0 + w_1 + ... + w_i must be greater than 0 for every i: the loading curve must increase";
  }
  /* bucket[b]: the first index that a value with place b can have */
  const double top = knots[n - 1];
  double scale = top > 0 ? n / top : 0;
  if (!(scale < HYST_INF)) scale = 0;
  for (int b = 0, i = 0; b <= n; b++) {
    while (i < n && knots[i] * scale < b) i++;
    bucket[b] = b == n ? n : i;
  }
  row[4 * n + 3] = scale;
  return NULL;
}
#endif
