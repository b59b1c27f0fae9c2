/* Bouc-Wen operator:  z' = A u' - beta |u'| |z|^(n-1) z - gamma u' |z|^n.
 * It does not depend on the rate, so it is integrated in u: with s = sgn(u'), v = s z and xi = |u - u_last|,
 *   dv/dxi = A - c(v) |v|^n,   c = gamma + beta for v > 0,   gamma - beta for v < 0,
 * an autonomous equation whose solution passes through v = 0 once.  n = 1 is solved in closed form.  Otherwise, near 0
 * the time from 0 to v is the series xi(v) = v/A sum_k q^k / (k n + 1), q = c |v|^n / A, inverted by Newton's method
 * (|v|^n is not smooth there); where |q| > 1/2, fourth-order Runge-Kutta steps that follow the local rate.
 * A > 0, beta >= 0, beta + gamma > 0 keep z within z_max = (A / (beta + gamma))^(1/n).
 * Wen, J. Eng. Mech. Div. 102 (1976) 249-263; bounds: Ikhouane & Rodellar, Systems with Hysteresis, 2007, ch. 2. */
#include "../elementary.h"
#include "../hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                \
  V(A, PARAM, 1, "real", "1", 1.0, 1e-100, 1e100, "slope of z at z = 0")                       \
  V(beta, PARAM, 1, "real", "1", 0.5, 0.0, 1e100, "width of the loop")                         \
  V(gamma, PARAM, 1, "real", "1", 0.5, -1e100, 1e100, "shape of the loop; beta + gamma > 0")   \
  V(n, PARAM, 1, "real", "1", 1.0, 1.0, 20.0, "sharpness of the knee")                         \
  V(alpha, PARAM, 1, "real", "1", 0.5, 0.0, 1.0, "share of the linear term")                   \
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
} law;

static double rate(law l, double v) { return l.A - l.c * hyst_pow(v, l.n); }

/* q = 1/2: here the series ends and Runge-Kutta begins */
static double half_way(law l) { return l.c == 0 ? HYST_INF : hyst_pow(0.5 * l.A / hyst_fabs(l.c), 1 / l.n); }

/* xi from 0 to v <= half_way */
static double way(law l, double v) {
  const double q = l.c * hyst_pow(v, l.n) / l.A;
  double sum = 1, power = q;
  for (int k = 1; k < 64 && hyst_fabs(power) > 1e-18; k++, power *= q) sum += power / (k * l.n + 1);
  return v / l.A * sum;
}

/* v at xi <= way(half): Newton's method on a function that is convex (c > 0) or concave.  It starts from the better of
 * two tangents, at 0 and where the step began; both lie on the side from which Newton's method cannot overshoot. */
static double after(law l, double xi, double tangent, double half) {
  double v = l.A * xi;
  if (l.c > 0 ? tangent < v : tangent > v) v = tangent;
  if (v > half) v = half;
  for (int i = 0; i < 60; i++) {
    const double step = (way(l, v) - xi) * rate(l, v);
    v -= step;
    if (!(hyst_fabs(step) > 1e-15 * v)) break;
  }
  return v;
}

static double runge_kutta(law l, double v, double h) {
  const double k1 = rate(l, v), k2 = rate(l, v + 0.5 * h * k1), k3 = rate(l, v + 0.5 * h * k2),
               k4 = rate(l, v + h * k3);
  return v + h / 6 * (k1 + 2 * (k2 + k3) + k4);
}

#define STEP 0.02       /* of the local time constant: error of the order of 1e-10 of z_max */
#define MOST_STEPS 8000 /* e^-80 of the distance to z_max is left */

/* v = -p < 0 on its way to 0: returns what is left of xi once it is there, else 0, with *p moved */
static double fall(law l, double *p, double xi) {
  const double half = half_way(l);
  while (*p > half && xi > 0) {
    const double h = STEP * *p / (l.n * hyst_fabs(l.c) * hyst_pow(*p, l.n));
    const double next = runge_kutta(l, *p, h < xi ? -h : -xi);
    if (!(next < *p)) return 0; /* beta = 0 and z = z_max: it stays there */
    *p = next;
    xi -= h;
  }
  if (!(xi > 0)) return 0;
  const double to_zero = way(l, *p);
  if (xi > to_zero) return xi - to_zero;
  *p = after(l, to_zero - xi, *p - xi * rate(l, *p), half);
  return 0;
}

/* v >= 0 on its way to z_max */
static double rise(law l, double v, double xi, double z_max) {
  const double half = half_way(l), fastest = l.n * l.A / z_max;
  if (v < half) {
    const double to_half = way(l, half), end = way(l, v) + xi;
    if (end < to_half) return after(l, end, v + xi * rate(l, v), half);
    v = half;
    xi = end - to_half;
  }
  const double steps = xi * fastest / STEP;
  if (!(steps < MOST_STEPS)) return z_max;
  const int m = (int)steps + 1;
  for (int i = 0; i < m; i++) v = runge_kutta(l, v, xi / m);
  return v;
}

/* n = 1: exponentials */
static double grown(double c, double xi) { return c == 0 ? xi : hyst_expm1(c * xi) / c; } /* (e^(c xi) - 1) / c */

static double rate_linear(law l, double v) { return l.A - l.c * v; }

static double log1p_over(double q, double xi) { /* xi log(1 + q) / q */
  const double one = 1 + q;
  return one == 1 ? xi : xi * (hyst_log(one) / (one - 1));
}

static double fall_linear(law l, double *p, double xi) {
  const double pull = rate_linear(l, *p), to_zero = log1p_over(-l.c * *p / l.A, *p / l.A);
  if (xi > to_zero) return xi - to_zero;
  if (pull > 0) *p -= pull * grown(l.c, xi); /* else beta = 0 and z = z_max: it stays there */
  return 0;
}

static double rise_linear(law l, double v, double xi) { return v + rate_linear(l, v) * grown(-l.c, xi); }

static double clamp(double v, double most) { return v > most ? most : v < -most ? -most : v; }

static double advance(double A, double beta, double gamma, double n, double z_max, double z, double du) {
  if (du == 0) return z;
  const law up = {A, gamma + beta, n}, down = {A, gamma - beta, n};
  const double sign = du > 0 ? 1 : -1;
  double v = clamp(sign * z, z_max), xi = sign * du;
  if (v < 0) {
    double p = -v;
    xi = n == 1 ? fall_linear(down, &p, xi) : fall(down, &p, xi);
    v = xi > 0 ? 0 : -p;
  }
  if (xi > 0) v = n == 1 ? rise_linear(up, v, xi) : rise(up, v, xi, z_max);
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
      sign * advance(*A, *beta, *gamma, *n, *z_max, *z_last, du); /* dv = (A - c |v|^n) dxi on either side */
  *t_z = (*A - (v > 0 ? *gamma + *beta : *gamma - *beta) * hyst_pow(hyst_fabs(v), *n)) * *s_u;
  *t_y = *k * (*alpha * *s_u + (1 - *alpha) * *t_z);
}
HYST_BLOCK(bouc_wen, .text = "Bouc-Wen operator", .source = "Wen 1976; Ikhouane & Rodellar 2007, ch. 2",
           .equation = "z' = A u' - beta |u'| |z|^(n-1) z - gamma u' |z|^n, y = k (alpha u + (1 - alpha) z)",
           .flags = HYST_RATE_INDEPENDENT, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
