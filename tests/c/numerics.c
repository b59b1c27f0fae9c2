/* Functions of headers of the core, for test_numerics.py. */
#include <stdlib.h>

#include "core/elementary/chebyshev.h"
#include "core/elementary/crc.h"
#include "core/elementary/limit.h"
#include "core/elementary/matrix_exponential.h"
#include "core/elementary/random.h"
#include "core/elementary/root.h"
#include "core/elementary/second_order.h"

double between(hyst_residual f, double a, double fa, double b, double fb, double fine, double *off) {
  return hyst_root_between(f, 0, a, fa, b, fb, fine, off);
}
double root(hyst_residual f, double lo, double hi, double u0, double f0, double u1, double f1, double *off) {
  const hyst_tried before = {u0, f0}, last = {u1, f1};
  return hyst_root(f, 0, lo, hi, before, last, off);
}
int exponential(int n, const double *M, double *E) {
  double *work = malloc((size_t)HYST_EXPM_WORK(n) * sizeof(double));
  for (int i = 0; i < n * n; i++) work[2 * i] = M[i], work[2 * i + 1] = 0;
  const hyst_dd *found = hyst_expm(n, work);
  for (int i = 0; found && i < n * n; i++) E[2 * i] = found[i].hi, E[2 * i + 1] = found[i].lo;
  free(work);
  return found != 0;
}
void fit(double half, hyst_of_number f, double *c) { hyst_chebyshev_fit(c, half, f, 0); }
double polynomial(const double *c, double x) { return hyst_chebyshev(c, x); }
double clamp(double u, double lo, double hi) { return hyst_clamp(u, lo, hi); }
double clamp_tangent(double u, double lo, double hi, double s) { return hyst_clamp_tangent(u, lo, hi, s); }
uint32_t crc(const unsigned char *b, long n) { return hyst_crc32(b, (size_t)n); }
uint64_t bits(uint64_t seed, uint64_t k) { return hyst_random_bits(seed, k); }
double uniform(uint64_t seed, uint64_t k) { return hyst_random_uniform(seed, k); }
double normal(uint64_t seed, uint64_t k) { return hyst_random_normal(seed, k); }
void dd(int what, const double *a, const double *b, double *r) {
  const hyst_dd x = {a[0], a[1]}, y = {b[0], b[1]};
  const hyst_dd z = what == 0 ? hyst_dd_add(x, y) : what == 1 ? hyst_dd_mul(x, y) : hyst_dd_div(x, b[0]);
  r[0] = z.hi, r[1] = z.lo;
}
