/* Jiles-Atherton operator: magnetisation y of a ferromagnet in the field u, with the effective field h = u + alpha y,
 *   y = (1 - c) m + c f(h),   f(h) = Ms L(h / a),   L(x) = coth x - 1/x,
 *   dm/dh = (f(h) - m) / (k s) where the walls move, s (f(h) - m) > 0, otherwise 0,   s = sgn(u').
 * Without the condition s (f(h) - m) > 0, the susceptibility is negative after a reversal. Jiles & Atherton, J. Magn.
 * Magn. Mater. 61 (1986) 48-60; all of y in the effective field: Sadowski et al., IEEE Trans. Magn. 38 (2002) 797-800.
 *
 * It is rate-independent.  While the walls are pinned, m is constant, and h is the root of h - alpha y(h) = u.  While
 * they move, the distance d = f - m obeys a linear equation in the path x of h, d' = s f' - d / k; over a step of x its
 * solution is an exponential and an integral of f' (three points of Gauss, order 6), and x is the root of
 * h - alpha y = u again.  So u = h - alpha y holds to rounding, the reversible part and the place where the walls begin
 * to move are exact, and only the integral has an error. Steps in h are at most a / steps and k / steps. Where f is
 * flat, they are at most an eighth of |h| and of the remaining path, because the errors decay there; this makes jumps
 * fast.
 *
 * If alpha Ms < 3 a, f is a function of u. If |f - m| <= k Ms / (3 a) at the start, it holds on every path; then dy/dh
 * is between 0 and Ms / (3 a), so y increases with u. */
#include "core/elementary/elementary.h"
#include "core/elementary/root.h"
#include "core/hyst.h"

#define DIMS(D) D(steps, 4, 1, 1000, "integration steps per field of length min(a, k)")
#define VARS(V)                                                                                                      \
  V(Ms, PARAM, 1, "real", "1", 1.0, 1e-100, 1e100, "saturation of y")                                                \
  V(a, PARAM, 1, "real", "=u", 0.3, 1e-100, 1e100, "shape of the anhysteretic curve: its slope at 0 is Ms / (3 a)")  \
  V(k, PARAM, 1, "real", "=u", 0.25, 1e-100, 1e100, "pinning of the domain walls, approximately the coercive field") \
  V(c, PARAM, 1, "real", "1", 0.1, 0.0, 1.0, "reversible share")                                                     \
  V(alpha, PARAM, 1, "real", "1", 0.05, -1e100, 1e100, "mean field at y = 1; alpha Ms < 3 a")                        \
  V(m0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "irreversible part of y at u0")                             \
  V(u0, FIXED, 1, "real", "=u", 0.0, -HYST_INF, HYST_INF, "field that belongs to m0, before the first input")        \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "field")                                                     \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "magnetisation")                                            \
  V(u_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "last field")                                           \
  V(m_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "irreversible part of y at the last field")

/* L(x) / x for |x| <= 1, from x^2: a continued fraction */
static double ratio(double square) {
  double v = 17;
  for (int j = 15; j >= 3; j -= 2) v = j + square / v;
  return 1 / v;
}
static double langevin(double x) {
  const double size = hyst_fabs(x), e = hyst_exp(-2 * size);
  return size < 1 ? x * ratio(x * x) : hyst_copysign((1 + e) / (1 - e) - 1 / size, x);
}
static double langevin_slope(double x) {
  const double size = hyst_fabs(x), p = size < 1 ? ratio(x * x) : 0, e = hyst_exp(-2 * size);
  return size < 1 ? 1 - 2 * p - x * x * p * p : 1 / (x * x) - 4 * e / ((1 - e) * (1 - e));
}

typedef struct {
  double Ms, a, k, c, alpha;
} law;

static double curve(const law *l, double h) { return l->Ms * langevin(h / l->a); }
static double curve_slope(const law *l, double h) { return l->Ms / l->a * langevin_slope(h / l->a); }
static double output_at(const law *l, double h, double m) { return (1 - l->c) * m + l->c * curve(l, h); }

/* tolerance of a root near h */
static double fineness(const law *l, double h) { return 4e-16 * (hyst_fabs(h) + l->a); }

/* ---- pinned walls ------------------------------------------------------------------------------------------------ */
typedef struct {
  const law *l;
  double u, m;
} pinned;

static double field_off(void *ctx, double h) {
  const pinned *p = (const pinned *)ctx;
  return h - p->l->alpha * output_at(p->l, h, p->m) - p->u;
}
static double wall_off(void *ctx, double h) {
  const pinned *p = (const pinned *)ctx;
  return curve(p->l, h) - p->m;
}
/* returns the effective field h with h - alpha y(h) = u */
static double field_at(const law *l, double u, double m) {
  const double middle = u + l->alpha * (1 - l->c) * m, most = hyst_fabs(l->alpha) * l->c * l->Ms;
  const double lo = middle - most, hi = middle + most;
  pinned p = {l, u, m};
  double off;
  return lo < hi ? hyst_root_between(field_off, &p, lo, field_off(&p, lo), hi, field_off(&p, hi), fineness(l, u), &off)
                 : middle;
}

/* ---- moving walls ------------------------------------------------------------------------------------------------ */
typedef struct {
  const law *l;
  double s, h, d, u; /* direction; effective field and distance before; input after */
} moving;

/* the distance after the path x of h */
static double distance(const moving *w, double x) {
  const law *l = w->l;
  const double left = hyst_sqrt(0.15) * x, k = l->k; /* nodes x/2 -+ left, weights 5/18, 8/18, 5/18 */
  const double outer = curve_slope(l, w->h + w->s * (0.5 * x - left)) * hyst_exp(-(0.5 * x + left) / k) +
                       curve_slope(l, w->h + w->s * (0.5 * x + left)) * hyst_exp(-(0.5 * x - left) / k);
  const double inner = curve_slope(l, w->h + w->s * 0.5 * x) * hyst_exp(-0.5 * x / k);
  return w->d * hyst_exp(-x / k) + w->s * x * ((5.0 / 18) * outer + (8.0 / 18) * inner);
}
static double input_off(void *ctx, double x) {
  const moving *w = (const moving *)ctx;
  const double h = w->h + w->s * x;
  return w->s * (h - w->l->alpha * (curve(w->l, h) - (1 - w->l->c) * distance(w, x)) - w->u);
}

/* returns the irreversible part after a new input in one direction */
static double advance(const law *l, int steps, double u_last, double m, double u) {
  if (!(u < u_last || u > u_last)) return m;
  const double s = u > u_last ? 1 : -1;
  moving w = {l, s, field_at(l, u_last, m), 0, u};
  double off;
  w.d = curve(l, w.h) - m;
  if (s * w.d < 0) {
    const double h = field_at(l, u, m), d = curve(l, h) - m;
    if (!(s * d > 0)) return m;
    pinned p = {l, u, m};
    w.h = hyst_root_between(wall_off, &p, w.h, w.d, h, d, fineness(l, h), &off);
    w.d = 0;
  }
  const double steepest = l->alpha * l->Ms / (3 * l->a); /* du/dh is between 1 and 1 - steepest */
  const double longest = steepest > 0 ? 1 / (1 - steepest) : 1;
  const double base = (l->a < l->k ? l->a : l->k) / steps;
  for (;;) {
    off = input_off(&w, 0);
    const double size = hyst_fabs(w.h), rest = -off, sure = rest - 2 * hyst_fabs(l->alpha) * l->Ms;
    double x = 0.125 * (size < sure ? size : sure); /* lower bound of h */
    if (!(x > base)) x = base;
    if (!(x < longest * rest)) x = longest * rest;
    if (!(x > 0) || w.h + s * x == w.h) break;
    const double f = input_off(&w, x);
    if (f > 0) x = hyst_root_between(input_off, &w, 0, off, x, f, fineness(l, w.h), &off);
    w.d = distance(&w, x);
    w.h += s * x;
    if (!(f < 0)) break;
  }
  return curve(l, w.h) - w.d;
}

static law law_of(const double *Ms, const double *a, const double *k, const double *c, const double *alpha) {
  const law l = {*Ms, *a, *k, *c, *alpha};
  return l;
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  const law l = law_of(Ms, a, k, c, alpha);
  if (!(*alpha * *Ms < 3 * *a)) return "alpha Ms must be less than 3 a, otherwise the anhysteretic curve jumps";
  const double d = curve(&l, field_at(&l, *u0, *m0)) - *m0;
  if (!(hyst_fabs(*m0) <= *Ms) || !(hyst_fabs(d) <= *k * *Ms / (3 * *a)))
    return "|m0| must be at most Ms, and its distance from the anhysteretic curve at most k Ms / (3 a)";
  return NULL;
}
HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  *u_last = *u0;
  *m_last = *m0;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const law l = law_of(Ms, a, k, c, alpha);
  const double m = advance(&l, steps, *u_last, *m_last, *u);
  *y = output_at(&l, field_at(&l, *u, m), m);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const law l = law_of(Ms, a, k, c, alpha);
  *m_last = advance(&l, steps, *u_last, *m_last, *u);
  *u_last = *u;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const law l = law_of(Ms, a, k, c, alpha);
  const double du = *u - *u_last, s = du > 0 || (du == 0 && *s_u > 0) ? 1 : -1;
  const double m = advance(&l, steps, *u_last, *m_last, *u), h = field_at(&l, *u, m), d = s * (curve(&l, h) - m);
  const double slope = *c * curve_slope(&l, h) + (d > 0 ? (1 - *c) * d / *k : 0); /* dy/dh */
  *t_y = slope / (1 - *alpha * slope) * *s_u;
}
HYST_BLOCK(jiles_atherton,
           (.text = "Jiles-Atherton operator",
            .equation = "y = (1 - c) m + c f(h), dm/dh = max(0, s (f(h) - m)) / k, h = u + alpha y, "
                        "f(h) = Ms (coth(h/a) - a/h), s = sgn(u')",
            .source = "Jiles & Atherton 1986; Sadowski et al. 2002", .family = "operators", .tolerance = "integration",
            .rule_error = 1e-8),
           .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
