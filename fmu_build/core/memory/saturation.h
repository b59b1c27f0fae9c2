/* saturation.h - the solution of dx/dt = 1 - s x^n, s = 1 or -1, from x = 0 at t = 0, and its path t(x), by
 * polynomials.
 *
 * Up to the middle, x^n = 1/2 or 1, x / t is a smooth function of t^n with the value 1 at 0.  Beyond it x is one of E,
 * which falls from 1 to 0: log E = n (half - t) for s = 1, log(1 + e n (half - t) / bend) / e, e = 1 - 1/n, for s = -1,
 * where x grows to infinity.  The paths are smooth functions of x^n and of 1 - r, r = x^n or x^n / (1 + x^n). */
#ifndef HYST_SATURATION_H
#define HYST_SATURATION_H
#include "core/elementary/chebyshev.h"
#include "core/memory/saturation_path.h"

/* a DERIVED row of a table */
typedef struct {
  double s, n, e;          /* e of the comment above; 0 for s = 1 */
  double half, bend;       /* t at the middle; see above */
  double early_scale, top; /* 2 / half^n; x^n at the middle */
  double early[HYST_CHEBYSHEV], late[HYST_CHEBYSHEV], early_path[HYST_CHEBYSHEV], late_path[HYST_CHEBYSHEV];
} hyst_saturation;
enum { HYST_SATURATION = 7 + 4 * HYST_CHEBYSHEV };

HYST_COLD static inline void hyst_saturation_build(hyst_saturation *f, double s, double n) {
  const hyst_saturation_law l = hyst_saturation_law_of(s, n);
  const double power = hyst_pow(l.half, n);
  f->s = s;
  f->n = n;
  f->e = l.e;
  f->half = l.half;
  f->bend = 1 - l.e * l.left_half;
  f->early_scale = 2 / power;
  f->top = s > 0 ? 0.5 : 1;
  hyst_chebyshev_fit(f->early, 0.5 * power, hyst_saturation_early, &l);
  hyst_chebyshev_fit(f->late, 0.5, hyst_saturation_late, &l);
  hyst_chebyshev_fit(f->early_path, 0.5 * f->top, hyst_saturation_early_path, &l);
  hyst_chebyshev_fit(f->late_path, 0.25, hyst_saturation_late_path, &l);
}

/* x(t), t >= 0 */
static inline double hyst_saturation_at(const hyst_saturation *f, double t) {
  if (t <= f->half) {
    const double power = hyst_pow(t, f->n);
    return t + t * (power * hyst_chebyshev(f->early, power * f->early_scale - 1));
  }
  const double left = f->n * (f->half - t) / f->bend;
  if (f->e * left <= -1) return HYST_INF;
  const double log_E = f->e > 0 ? hyst_shrunk(f->e, left) : left, E = hyst_exp(log_E);
  const double late = hyst_chebyshev(f->late, 2 * E - 1);
  return f->s > 0 ? 1 - E * late : hyst_exp(-log_E / f->n) * late;
}

/* t(x), x >= 0 */
static inline double hyst_saturation_path(const hyst_saturation *f, double x) {
  const double q = hyst_pow(x, f->n);
  if (q <= f->top) return x + x * (q * hyst_chebyshev(f->early_path, 2 / f->top * q - 1));
  if (f->s > 0 && q >= 1) return HYST_INF;
  const double s = f->s > 0 ? 1 - q : 1 / (1 + q);
  const double log_E = hyst_log(2 * s) + hyst_chebyshev(f->late_path, 4 * s - 1);
  return f->half - f->bend * hyst_grown(f->e, log_E) / f->n;
}
#endif
