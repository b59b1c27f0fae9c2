/* Bouc-Wen operator:  z' = A u' - beta |u'| |z|^(n-1) z - gamma u' |z|^n.
 * It is rate-independent, so it is integrated in u: with s = sgn(u'), v = s z and xi = |u - u_last|,
 *   dv/dxi = A - c(v) |v|^n,   c = gamma + beta for v > 0,   gamma - beta for v < 0,
 * an autonomous equation whose solution passes through v = 0 once.  n = 1 is solved in closed form.  Otherwise, with
 * V = (A / |c|)^(1/n), q = (|v| / V)^n and the fraction r of the path to saturation, r = q for c > 0 and
 * q / (1 + q) for c < 0,
 *   n A/V dxi = r^(1/n - 1) (1 - r)^(e - 1) dr,   e = 0 for c > 0, 1 - 1/n for c < 0:
 * an incomplete beta function, which has a series in r for r <= 1/2, another in s = 1 - r beyond, and is inverted by
 * Newton's method.  So the result does not depend on the division of the path of u, except for rounding.
 * A > 0, beta >= 0, beta + gamma > 0 keep z within z_max = (A / (beta + gamma))^(1/n).
 * Wen, J. Eng. Mech. Div. 102 (1976) 249-263; bounds: Ikhouane & Rodellar, Systems with Hysteresis, 2007, ch. 2. */
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                \
  V(A, PARAM, 1, "real", "1", 1.0, 1e-100, 1e100, "slope of z at z = 0")                       \
  V(beta, PARAM, 1, "real", "1", 0.5, 0.0, 1e100, "width of the loop")                         \
  V(gamma, PARAM, 1, "real", "1", 0.5, -1e100, 1e100, "shape of the loop; beta + gamma > 0")   \
  V(n, PARAM, 1, "real", "1", 1.0, 1.0, 20.0, "sharpness of the knee")                         \
  V(alpha, PARAM, 1, "real", "1", 0.5, 0.0, 1.0, "weight of the linear term")                  \
  V(k, PARAM, 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "output gain")                         \
  V(z0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "z at the first input; within z_max") \
  V(z_max, DERIVED, 1, "real", "1", 0.0, 0.0, HYST_INF, "bound of z")                          \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                               \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                             \
  V(z, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "hysteretic part")                    \
  V(u_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input that z_last belongs to")   \
  V(z_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "z at u_last")

typedef struct {
  double A, c, n; /* dv/dxi = A - c v^n, v >= 0 */
  double V, e;    /* as above; c = 0 and n = 1 need none */
} law;

static law law_of(double A, double c, double n) {
  const law l = {A, c, n, c == 0 || n == 1 ? 0 : hyst_pow(A / hyst_fabs(c), 1 / n), c < 0 ? 1 - 1 / n : 0};
  return l;
}

static double grown(double c, double xi) { return c == 0 ? xi : hyst_expm1(c * xi) / c; } /* (e^(c xi) - 1) / c */

static double log1p_over(double q, double xi) { /* xi log(1 + q) / q */
  const double one = 1 + q;
  return one == 1 ? xi : xi * (hyst_log(one) / (one - 1));
}

/* sum_{k >= 1} (m)_k / k! x^k / (k d + o), x <= 1/2: both series of the beta function without their first terms */
static double series(double m, double x, double d, double o) {
  double sum = 0, term = m * x;
  for (int k = 1; k < 64 && term > 1e-18; k++) {
    sum += term / (k * d + o);
    term *= (m + k) / (k + 1) * x;
  }
  return sum;
}

/* r <= 1/2: the path from 0, in units of V/A, for g = r^(1/n); dpath/dg = (1 - r)^(e - 1) grows from 1 to 2 at most */
static double way_low(law l, double g) { return g * (1 + series(1 - l.e, hyst_pow(g, l.n), l.n, 1)); }

/* s = 1 - r <= 1/2: minus the path to s = 1, times n, for U = (s^e - 1) / e, log(s) for e = 0;
 * its derivative with respect to U is -(1 - s)^(1/n - 1), from -1 to -2 at most */
static double s_of(law l, double U) { return hyst_exp(log1p_over(l.e * U, U)); }
static double U_of(law l, double s) { return grown(l.e, hyst_log(s)); }
static double left_high(law l, double U) {
  const double s = s_of(l, U);
  return -U - hyst_pow(s, l.e) * series(1 - 1 / l.n, s, 1, l.e);
}

static double half_way(law l) { return way_low(l, hyst_pow(0.5, 1 / l.n)); }

/* place on the branch: g where r <= 1/2, else U; v = 0 is g = 0 */
typedef struct {
  int high;
  double at;
} place;

static place place_of(law l, double v) {
  const double q = hyst_pow(v / l.V, l.n), r = l.c > 0 ? q : q / (1 + q);
  const double s = l.c < 0 ? 1 / (1 + q) : q < 1 ? 1 - q : 1e-17; /* z_max is rounded */
  const place low = {0, l.c > 0 ? v / l.V : hyst_pow(r, 1 / l.n)}, high = {1, r > 0.5 ? U_of(l, s) : 0};
  return r > 0.5 ? high : low;
}
static double value_of(law l, place p) {
  const double s = p.high ? s_of(l, p.at) : 1 - hyst_pow(p.at, l.n);
  const double g = p.high ? hyst_pow(1 - s, 1 / l.n) : p.at;
  return l.V * (l.c > 0 ? g : g * hyst_pow(s, -1 / l.n));
}

static double way(law l, place p) {
  return p.high ? half_way(l) + (left_high(l, p.at) - left_high(l, U_of(l, 0.5))) / l.n : way_low(l, p.at);
}

/* the position after a path: Newton's method on a convex function, from the start of the step or the series limit */
static place after(law l, double xi, place from) {
  const double half = half_way(l);
  const int high = xi > half;
  const double border = high ? U_of(l, 0.5) : hyst_pow(0.5, 1 / l.n);
  const double target = high ? left_high(l, border) + l.n * (xi - half) : xi;
  place p = {high, from.high == high ? from.at : border};
  for (int i = 0; i < 20; i++) {
    const double r = high ? 1 - s_of(l, p.at) : hyst_pow(p.at, l.n);
    const double step = high ? (left_high(l, p.at) - target) * hyst_pow(r, 1 - 1 / l.n)
                             : (target - way_low(l, p.at)) * hyst_pow(1 - r, 1 - l.e);
    p.at += step;
    if (p.at > border) p.at = border;
    if (!(hyst_fabs(step) > 1e-9 * hyst_fabs(p.at))) break; /* the error is now of the order of its square */
  }
  return p;
}

/* v = -p < 0 moves towards 0: returns the rest of xi if it arrives, else 0 and the new *p */
static double fall(law l, double *p, double xi) {
  const double bend = l.c * hyst_pow(*p, l.n), unit = l.V / l.A;
  if (hyst_fabs(bend) < 1e-17 * l.A) { /* straight */
    if (xi > *p / l.A) return xi - *p / l.A;
    *p -= l.A * xi;
    return 0;
  }
  const place from = place_of(l, *p);
  const double to_zero = unit * way(l, from);
  if (xi > to_zero) return xi - to_zero;
  if (l.A - bend > 0) *p = value_of(l, after(l, (to_zero - xi) / unit, from)); /* else beta = 0 and z = z_max */
  return 0;
}

/* v >= 0 moves towards z_max */
static double rise(law l, double v, double xi) {
  const place from = place_of(l, v);
  const double to = way(l, from) + xi * (l.A / l.V);
  return l.n * to < 100 ? value_of(l, after(l, to, from)) : l.V; /* e^-100 of the distance to z_max is left */
}

/* n = 1: exponentials */
static double rate_linear(law l, double v) { return l.A - l.c * v; }

static double fall_linear(law l, double *p, double xi) {
  const double pull = rate_linear(l, *p), to_zero = log1p_over(-l.c * *p / l.A, *p / l.A);
  if (xi > to_zero) return xi - to_zero;
  if (pull > 0) *p -= pull * grown(l.c, xi); /* otherwise beta = 0 and z = z_max, which is constant */
  return 0;
}

static double rise_linear(law l, double v, double xi) { return v + rate_linear(l, v) * grown(-l.c, xi); }

static double clamp(double v, double most) { return v > most ? most : v < -most ? -most : v; }

static double advance(double A, double beta, double gamma, double n, double z_max, double z, double du) {
  if (du == 0) return z;
  const double sign = du > 0 ? 1 : -1;
  double v = clamp(sign * z, z_max), xi = sign * du;
  if (v < 0) {
    const law down = law_of(A, gamma - beta, n);
    double p = -v;
    xi = n == 1 ? fall_linear(down, &p, xi) : fall(down, &p, xi);
    v = xi > 0 ? 0 : -p;
  }
  if (xi > 0) {
    const law up = law_of(A, gamma + beta, n);
    v = n == 1 ? rise_linear(up, v, xi) : rise(up, v, xi);
  }
  return sign * clamp(v, z_max);
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  const double bound = *A / (*beta + *gamma);
  if (!(bound > 0) || !hyst_isfinite(bound)) return "beta + gamma must be greater than 0: z would grow without bound";
  *z_max = hyst_pow(bound, 1 / *n);
  if (hyst_fabs(*z0) > *z_max) return "z0 must be within (A / (beta + gamma))^(1/n), the bound of z";
  return NULL;
}
HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  *u_last = 0;
  *z_last = *z0;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *z = advance(*A, *beta, *gamma, *n, *z_max, *z_last, *u - *u_last);
  *y = *k * (*alpha * *u + (1 - *alpha) * *z);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  if (dt > 0) *z_last = advance(*A, *beta, *gamma, *n, *z_max, *z_last, *u - *u_last);
  *u_last = *u;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double du = *u - *u_last, sign = du > 0 || (du == 0 && *s_u > 0) ? 1 : -1;
  const double v =
      sign * advance(*A, *beta, *gamma, *n, *z_max, *z_last, du); /* dv = (A - c |v|^n) dxi for either sign */
  *t_z = (*A - (v > 0 ? *gamma + *beta : *gamma - *beta) * hyst_pow(hyst_fabs(v), *n)) * *s_u;
  *t_y = *k * (*alpha * *s_u + (1 - *alpha) * *t_z);
}
HYST_BLOCK(bouc_wen,
           (.text = "Bouc-Wen operator",
            .equation = "z' = A u' - beta |u'| |z|^(n-1) z - gamma u' |z|^n, y = k (alpha u + (1 - alpha) z)",
            .source = "Wen 1976; Ikhouane & Rodellar 2007, ch. 2", .family = "operators", .tolerance = "integration",
            .rule_error = 1e-5),
           .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
