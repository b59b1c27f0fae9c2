/* matrix_exponential.h - e^M by scaling and squaring, in double-double.
 *
 * M is halved s times until its norm is at most 1/8, where its Taylor series of degree 18 has a remainder below 1e-34.
 * The result is squared s times.  Each squaring doubles the relative error: in double, stiff systems lose s bits (Moler
 * & Van Loan, SIAM Review 45 (2003) 3-49, section 3); in double-double, the result is accurate to the last place of a
 * double, without a linear solve. */
#ifndef HYST_MATRIX_EXPONENTIAL_H
#define HYST_MATRIX_EXPONENTIAL_H
#include "core/elementary/double_double.h"
#include "core/hyst.h"

/* doubles of workspace for an n by n matrix: M, the result, a product */
#define HYST_EXPM_WORK(n) (6 * (n) * (n))

/* computes C = A B / divisor; skips zeros of A, of which companion matrices have many */
static inline void hyst_dd_matmul(int n, const hyst_dd *A, const hyst_dd *B, double divisor, hyst_dd *C) {
  for (int i = 0; i < n; i++) {
    for (int j = 0; j < n; j++) C[i * n + j] = hyst_dd_of(0);
    for (int k = 0; k < n; k++)
      if (A[i * n + k].hi != 0)
        for (int j = 0; j < n; j++) C[i * n + j] = hyst_dd_add(C[i * n + j], hyst_dd_mul(A[i * n + k], B[k * n + j]));
    if (divisor != 1)
      for (int j = 0; j < n; j++) C[i * n + j] = hyst_dd_div(C[i * n + j], divisor);
  }
}

/* Input: M in the first n n pairs of work.  Returns the n by n result (pairs in work), or NULL if it is not finite. */
static inline const hyst_dd *hyst_expm(int n, double *work) {
  hyst_dd *M = (hyst_dd *)work, *E = M + n * n, *product = E + n * n;
  double norm = 0;
  for (int i = 0; i < n; i++) {
    double row = 0;
    for (int j = 0; j < n; j++) row += hyst_fabs(M[i * n + j].hi);
    if (!(row <= norm)) norm = row;
  }
  if (!hyst_isfinite(norm)) return NULL;
  int squarings = 0;
  double scale = 1;
  while (norm * scale > 0.125) scale *= 0.5, squarings++;
  for (int i = 0; i < n * n; i++) {
    M[i].hi *= scale, M[i].lo *= scale;
    E[i] = hyst_dd_of(i % (n + 1) == 0);
  }
  for (int k = 18; k >= 1; k--) { /* Horner: E = I + M E / k */
    hyst_dd_matmul(n, M, E, k, product);
    for (int i = 0; i < n; i++) product[i * n + i] = hyst_dd_add(product[i * n + i], hyst_dd_of(1));
    hyst_dd *const other = E;
    E = product, product = other;
  }
  for (int s = 0; s < squarings; s++) {
    hyst_dd_matmul(n, E, E, 1, product);
    hyst_dd *const other = E;
    E = product, product = other;
  }
  for (int i = 0; i < n * n; i++)
    if (!hyst_isfinite(E[i].hi)) return NULL;
  return E;
}
#endif
