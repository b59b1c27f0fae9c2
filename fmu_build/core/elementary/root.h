/* root.h - finds the u in [lo, hi] at which an output has its wanted value: bracketed, bounded, deterministic.
 *
 * Secants. While the output is monotone on the trial points, a secant iteration with inverse quadratic interpolation
 * starts at the last two roots. It needs 2 to 4 evaluations for a small step of a smooth output.
 *
 * Bracketing is used if the secants do not converge. It searches rings around the last u for a sign change of output -
 * wanted. Their radii double from 1/1024 of the range. Each ring is first searched on the side where an increasing
 * output approaches the wanted value. The first sign change brackets the root. If there are several roots, the result
 * is the nearest one, except that two roots within one ring may be missed. Without a sign change, the result is the
 * bound with the closer output (for equal distances, the upper bound if the output is too low) or a closer searched
 * point. Such a point is an extremum of the output; the search is repeated around it until no ring comes closer.
 *
 * Iteration: Chandrupatla, Advances in Engineering Software 28 (1997) 145-149: inverse quadratic interpolation where it
 * is safe, otherwise bisection. */
#ifndef HYST_ROOT_H
#define HYST_ROOT_H
#include "core/elementary/elementary.h"
#include "core/elementary/limit.h"

typedef double (*hyst_residual)(void *ctx, double u); /* output - wanted */

static inline int hyst_opposite(double f, double g) { return (f < 0 && g > 0) || (f > 0 && g < 0); }

/* a and b enclose a root; fine: absolute tolerance; *off: output - wanted at the result */
static inline double hyst_root_between(hyst_residual f, void *ctx, double a, double fa, double b, double fb,
                                       double fine, double *off) {
  enum { MOST = 120 }; /* twice the bisections from any range to its last place */
  double t = fa / (fa - fb), x = a;
  for (int i = 0; i < MOST; i++) {
    if (!(t > 0 && t < 1)) t = 0.5; /* infinite or NaN outputs */
    const double at = a + t * (b - a), f_at = f(ctx, at);
    double c = b, fc = fb; /* last point that left the bracket */
    if (hyst_opposite(f_at, fa)) b = a, fb = fa;
    else c = a, fc = fa;
    a = at, fa = f_at;
    const int nearer_a = hyst_fabs(fa) < hyst_fabs(fb);
    x = nearer_a ? a : b;
    *off = nearer_a ? fa : fb;
    const double least = (4.5e-16 * hyst_fabs(x) + fine) / hyst_fabs(b - a); /* minimum step / bracket */
    if (*off == 0 || !(least < 0.5)) break;
    const double xi = (a - b) / (c - b), phi = (fa - fb) / (fc - fb);
    t = 0.5;
    if (phi * phi < xi && (1 - phi) * (1 - phi) < 1 - xi)
      t = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb);
    t = hyst_clamp(t, least, 1 - least);
  }
  return x;
}

/* one search around centre; *off: at first that at centre, then at the result; *more: the result is an inner point that
 * is no root */
static inline double hyst_root_around(hyst_residual f, void *ctx, double lo, double hi, double centre, double *off,
                                      int *more) {
  const double range = hi - lo, rise = *off < 0 ? 1 : -1; /* the side of an increasing output */
  double at[2] = {centre, centre}, f_at[2] = {*off, *off}, best = centre;
  double radius = range / 1024; /* the rings are counted, because the radius stays 0 in a tiny range */
  *more = 0;
  for (int ring = 0; ring <= 10 && *off != 0; ring++, radius *= 2)
    for (int other = 0; other < 2; other++) {
      const double next = hyst_clamp(centre + (other ? -rise : rise) * radius, lo, hi);
      if (next == at[other]) continue;
      const double f_next = f(ctx, next);
      if (f_next == 0) return *off = 0, next;
      if (hyst_opposite(f_next, f_at[other]))
        return hyst_root_between(f, ctx, at[other], f_at[other], next, f_next, 1e-16 * range, off);
      if (hyst_fabs(f_next) < hyst_fabs(*off)) best = next, *off = f_next;
      at[other] = next;
      f_at[other] = f_next;
    }
  if (*off == 0) return centre;
  const int end = hyst_fabs(f_at[1]) < hyst_fabs(f_at[0]); /* both bounds are reached */
  if (hyst_fabs(*off) < hyst_fabs(f_at[end])) return *more = best != centre, best;
  return *off = f_at[end], at[end];
}

/* a point tried: u and output - wanted there */
typedef struct {
  double u, off;
} hyst_tried;

/* secants from `last` and the root before it, whose point may belong to another branch of the memory; 1: *last is now
 * the root, and *last did not move otherwise */
static inline int hyst_root_by_secants(hyst_residual f, void *ctx, double lo, double hi, hyst_tried before,
                                       hyst_tried *last) {
  enum { MOST = 8 };
  const double range = hi - lo;
  double slope = (last->u - before.u) / (last->off - before.off); /* du / d off */
  const int onward = slope * last->off * (last->u - before.u) < 0;
  hyst_tried a = *last, b;
  b.u = hyst_clamp(a.u - a.off * slope, lo, hi);
  if (!(b.u < a.u || b.u > a.u)) return 0;
  b.off = f(ctx, b.u);
  for (int i = 0; i < MOST; i++) {
    const double between = (b.u - a.u) / (b.off - a.off), fine = 4.5e-16 * hyst_fabs(b.u) + 1e-16 * range;
    if (b.off == 0) return *last = b, 1;
    if (!(between * slope > 0)) return 0; /* the output is not monotone, or u is at a limit */
    double step = -b.off * between;
    const double bend = b.off * a.off * (between - slope) / (b.off - before.off);
    if ((onward || i > 0) && hyst_fabs(bend) < 0.5 * hyst_fabs(step)) step += bend;
    if (!(hyst_fabs(step) > fine)) return *last = b, 1;
    const double u = hyst_clamp(b.u + step, lo, hi);
    const hyst_tried next = {u, f(ctx, u)};
    const int nearer = hyst_fabs(next.off) < hyst_fabs(b.off);
    if (!(hyst_fabs(next.off) < 0.5 * hyst_fabs(b.off)) && hyst_fabs(step) < 1e-12 * range) /* rounding of the output */
      return *last = nearer ? next : b, 1;
    before = a;
    slope = between;
    a = b;
    b = next;
  }
  if (!hyst_opposite(a.off, b.off)) return 0;
  last->u = hyst_root_between(f, ctx, a.u, a.off, b.u, b.off, 1e-16 * range, &last->off);
  return 1;
}

/* last: in [lo, hi], its `off` may be a guess; before: the root before it; *off: output - wanted at the result */
static inline double hyst_root(hyst_residual f, void *ctx, double lo, double hi, hyst_tried before, hyst_tried last,
                               double *off) {
  enum { MOST = 8 }; /* each search reduces the distance to a third, so the smallest ring is reached */
  if (hyst_root_by_secants(f, ctx, lo, hi, before, &last)) return *off = last.off, last.u;
  int more = 1;
  double u = last.u;
  *off = f(ctx, u);
  if (*off != last.off) { /* the guess was wrong, because the model did not change by u alone */
    last.off = *off;
    if (hyst_root_by_secants(f, ctx, lo, hi, before, &last)) return *off = last.off, last.u;
  }
  for (int i = 0; i < MOST && more; i++) u = hyst_root_around(f, ctx, lo, hi, u, off, &more);
  return u;
}
#endif
