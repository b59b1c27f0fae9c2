/* newton.c - newton.h: Gauss-Jordan elimination with row pivots, and a rank-one update. */
#include "master/newton.h"

static double size(double v) { return v < 0 ? -v : v; }

static void swap(int64_t n, double *a, double *b) {
  for (int64_t k = 0; k < n; k++) {
    const double kept = a[k];
    a[k] = b[k], b[k] = kept;
  }
}

/* row -= factor * other */
static void take_off(int64_t n, double *row, double factor, const double *other) {
  if (factor == 0) return;
  for (int64_t k = 0; k < n; k++) row[k] -= factor * other[k];
}

int newton_start(int64_t n, double *J, double *H) {
  for (int64_t i = 0; i < n; i++)
    for (int64_t k = 0; k < n; k++) H[i * n + k] = i == k, J[i * n + k] = (i == k) - J[i * n + k];
  for (int64_t c = 0; c < n; c++) {
    int64_t top = c;
    for (int64_t i = c + 1; i < n; i++)
      if (size(J[i * n + c]) > size(J[top * n + c])) top = i;
    const double pivot = J[top * n + c];
    if (!(size(pivot) > 1e-12)) return 1; /* of values with weight one; also NaN */
    swap(n, J + c * n, J + top * n);
    swap(n, H + c * n, H + top * n);
    for (int64_t k = 0; k < n; k++) J[c * n + k] /= pivot, H[c * n + k] /= pivot;
    for (int64_t i = 0; i < n; i++) {
      if (i == c) continue;
      const double factor = J[i * n + c];
      take_off(n, J + i * n, factor, J + c * n);
      take_off(n, H + i * n, factor, H + c * n);
    }
  }
  return 0;
}

void newton_step(int64_t n, const double *H, const double *residual, double *change) {
  for (int64_t i = 0; i < n; i++) {
    change[i] = 0;
    for (int64_t k = 0; k < n; k++) change[i] += H[i * n + k] * residual[k];
  }
}

/* y = before - now is what H should have made `change` of: H += (change - H y) (change' H) / (change' H y) */
void newton_learn(int64_t n, double *H, const double *change, const double *before, const double *now, double *room) {
  double *made = room, *row = room + n, weight = 0;
  for (int64_t i = 0; i < n; i++) made[i] = row[i] = 0;
  for (int64_t i = 0; i < n; i++)
    for (int64_t k = 0; k < n; k++) {
      made[i] += H[i * n + k] * (before[k] - now[k]);
      row[k] += change[i] * H[i * n + k];
    }
  for (int64_t i = 0; i < n; i++) weight += change[i] * made[i];
  if (!(size(weight) > 0 && weight - weight == 0)) return;
  for (int64_t i = 0; i < n; i++) take_off(n, H + i * n, (made[i] - change[i]) / weight, row);
}
