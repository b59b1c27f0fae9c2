/* columns.h - one linear recursion over many columns: what a fit filters thousands of times.  Python alone calls it. */
#ifndef HYST_COLUMNS_H
#define HYST_COLUMNS_H
#include <stdint.h>

/* v_0 = start u_0, v_k = A v_(k-1) + B0 u_(k-1) + B1 u_k, y_k = c v_k + d u_k, as transfer_function.c steps. */
typedef struct {
  int64_t n; /* states */
  const double *A, *B0, *B1, *c, *start;
  double d;
} hyst_recursion;

/* Run over the rows of u (n_rows, n_columns) and write the n_picked rows `picked` of y: rising, each >= 0 and < n_rows;
 * a row may occur several times.  work: 2 n n_columns doubles. */
void hyst_columns_run(const hyst_recursion *r, int64_t n_columns, const double *u, int64_t n_picked,
                      const int64_t *picked, double *y, double *work);
#endif
