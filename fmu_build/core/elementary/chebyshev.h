/* chebyshev.h - a smooth function as a polynomial through its values at the Chebyshev nodes of [-1, 1].
 * The basis of powers is accurate here: a function that is analytic on a region around [-1, 1] has Chebyshev
 * coefficients that fall faster than the powers in the Chebyshev polynomials grow. */
#ifndef HYST_CHEBYSHEV_H
#define HYST_CHEBYSHEV_H
#include "core/elementary/elementary_sine.h"
#include "core/hyst.h"

enum { HYST_CHEBYSHEV = 24 }; /* coefficients, a multiple of four */

typedef double (*hyst_of_number)(const void *ctx, double x);

/* c: coefficients of powers of x for f(half (1 + x)), -1 <= x <= 1 */
HYST_COLD static inline void hyst_chebyshev_fit(double *c, double half, hyst_of_number f, const void *ctx) {
  double value[HYST_CHEBYSHEV], cosine[4 * HYST_CHEBYSHEV], last[HYST_CHEBYSHEV] = {1}, now[HYST_CHEBYSHEV] = {0, 1};
  for (int m = 0; m < 4 * HYST_CHEBYSHEV; m++) cosine[m] = hyst_cos(m * (HYST_2PI / (4 * HYST_CHEBYSHEV)));
  for (int j = 0; j < HYST_CHEBYSHEV; j++) value[j] = f(ctx, half * (1 + cosine[2 * j + 1]));
  for (int k = 0; k < HYST_CHEBYSHEV; k++) c[k] = 0;
  for (int k = 0; k < HYST_CHEBYSHEV; k++) { /* last: coefficients of the k-th Chebyshev polynomial */
    double sum = 0;
    for (int j = 0; j < HYST_CHEBYSHEV; j++) sum += value[j] * cosine[k * (2 * j + 1) % (4 * HYST_CHEBYSHEV)];
    for (int i = 0; i <= k; i++) c[i] += last[i] * sum * ((k > 0 ? 2.0 : 1.0) / (double)HYST_CHEBYSHEV);
    for (int i = HYST_CHEBYSHEV - 1; i >= 0; i--) {
      const double next = 2 * (i > 0 ? now[i - 1] : 0) - last[i];
      last[i] = now[i];
      now[i] = next;
    }
  }
}

/* four sums in parallel, because a single sum waits for each product */
static inline double hyst_chebyshev(const double *c, double x) {
  const double x2 = x * x, x4 = x2 * x2;
  double a[4] = {0, 0, 0, 0};
  for (int k = HYST_CHEBYSHEV - 4; k >= 0; k -= 4)
    for (int i = 0; i < 4; i++) a[i] = a[i] * x4 + c[k + i];
  return (a[0] + a[1] * x) + x2 * (a[2] + a[3] * x);
}
#endif
