/* columns.c - a linear recursion over many columns.  A row of all columns advances at once, in vectors of the compiler;
 * each column passes the operations of transfer_function.c in the same order.  Zeros of A cost nothing: parallel lags
 * have a diagonal A. */
#include "fitting/columns.h"

static void scaled(int64_t n, double a, const double *restrict x, double *restrict y) {
  for (int64_t k = 0; k < n; k++) y[k] = a * x[k];
}

static void add(int64_t n, double a, const double *restrict x, double *restrict y) {
  for (int64_t k = 0; k < n; k++) y[k] += a * x[k];
}

static void add2(int64_t n, double a, const double *restrict x, double b, const double *restrict z,
                 double *restrict y) {
  for (int64_t k = 0; k < n; k++) y[k] = a * x[k] + b * z[k];
}

void hyst_columns_run(const hyst_recursion *r, int64_t p, const double *u, int64_t n_picked, const int64_t *picked,
                      double *y, double *work) {
  const int64_t n = r->n;
  double *v = work, *next = work + n * p;
  for (int64_t i = 0; i < n; i++) scaled(p, r->start[i], u, v + i * p);
  int64_t row = 0;
  for (int64_t at = 0; at < n_picked; at++) {
    for (; row < picked[at]; row++, u += p) {
      for (int64_t i = 0; i < n; i++) {
        double *const sum = next + i * p;
        add2(p, r->B0[i], u, r->B1[i], u + p, sum);
        for (int64_t j = 0; j < n; j++)
          if (r->A[i * n + j] != 0) add(p, r->A[i * n + j], v + j * p, sum);
      }
      double *const old = v;
      v = next, next = old;
    }
    scaled(p, r->d, u, y + at * p);
    for (int64_t i = 0; i < n; i++)
      if (r->c[i] != 0) add(p, r->c[i], v + i * p, y + at * p);
  }
}
