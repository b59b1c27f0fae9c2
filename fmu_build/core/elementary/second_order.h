/* second_order.h - y'' = omega_n^2 (u - y) - 2 zeta omega_n y' over a step with the input held. */
#ifndef HYST_SECOND_ORDER_H
#define HYST_SECOND_ORDER_H
#include "core/elementary/matrix_exponential.h"

#define HYST_SECOND_ORDER_WORK HYST_EXPM_WORK(3)

/* F (3 by 3): position, velocity / omega_n and the held input over a step of p = omega_n dt.  Returns 0 if the step is
 * too long for p and zeta. */
static inline int hyst_second_order(double p, double zeta, double *work, double *F) {
  const double rates[9] = {0, p, 0, -p, -2 * zeta * p, p, 0, 0, 0};
  hyst_dd *const A = (hyst_dd *)work;
  for (int i = 0; i < 9; i++) A[i] = hyst_dd_of(rates[i]);
  const hyst_dd *const E = p < 1e6 ? hyst_expm(3, work) : NULL;
  for (int i = 0; E && i < 9; i++) F[i] = E[i].hi;
  return E != NULL;
}
#endif
