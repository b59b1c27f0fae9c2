/* Bouc-Wen operator:  z' = A u' - beta |u'| |z|^(n-1) z - gamma u' |z|^n.
 * It is rate-independent, so it is integrated in u: with s = sgn(u'), v = s z and xi = s u,
 *   dv/dxi = A - c(v) |v|^n,   c = gamma + beta for v > 0,   gamma - beta for v < 0,
 * an autonomous equation: one curve v(xi) through v = 0, scaled from dx/dt = 1 - x^n or 1 + x^n (saturation.h), on
 * which every path between two reversals is a part. Each reversal corresponds to a point of the curve. Until the next
 * reversal, a step evaluates the curve at this point plus the path of u, so the result does not depend on the lengths
 * of the steps. A > 0, beta >= 0, beta + gamma > 0 keep z within z_max = (A / (beta + gamma))^(1/n). Wen, J. Eng. Mech.
 * Div. 102 (1976) 249-263; bounds: Ikhouane & Rodellar, Systems with Hysteresis, 2007, ch. 2. */
#include "core/elementary/limit.h"
#include "core/hyst.h"
#include "core/memory/saturation.h"

#define DIMS(D)
#define VARS(V)                                                                                                        \
  V(A, PARAM, 1, "real", "1", 1.0, 1e-100, 1e100, "slope of z at z = 0")                                               \
  V(beta, PARAM, 1, "real", "1", 0.5, 0.0, 1e100, "width of the loop")                                                 \
  V(gamma, PARAM, 1, "real", "1", 0.5, -1e100, 1e100, "shape of the loop; beta + gamma > 0")                           \
  V(n, PARAM, 1, "real", "1", 1.0, 1.0, 20.0, "sharpness of the knee")                                                 \
  V(alpha, PARAM, 1, "real", "1", 0.5, 0.0, 1.0, "weight of the linear term")                                          \
  V(k, PARAM, 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "output gain")                                                 \
  V(z0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "z at u0; at most z_max in absolute value")                   \
  V(u0, FIXED, 1, "real", "=u", 0.0, -HYST_INF, HYST_INF, "input that belongs to z0, before the first input")          \
  V(z_max, DERIVED, 1, "real", "1", 0.0, 0.0, HYST_INF, "bound of z")                                                  \
  V(away, DERIVED, HYST_ARM, "real", "1", 0.0, -HYST_INF, HYST_INF, "curve for v > 0")                                 \
  V(back, DERIVED, HYST_ARM, "real", "1", 0.0, -HYST_INF, HYST_INF, "curve for v < 0")                                 \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                                       \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                                     \
  V(z, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "hysteretic part")                                            \
  V(u_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "last input")                                             \
  V(z_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "z at the last input")                                    \
  V(turn, STATE, 3, "real", "1", 0.0, -HYST_INF, HYST_INF, "last reversal: new direction s, input u, path from v = 0") \
  V(law, STATE, 4, "real", "1", 0.0, -HYST_INF, HYST_INF, "A, beta, gamma, n at the last reversal")

/* one side of the curve; units of x and t are those of z and u */
typedef struct {
  double z, u;
  hyst_saturation unit;
} arm;
enum { HYST_ARM = 2 + HYST_SATURATION };

static void build(arm *a, double A, double c, double least, double n, const arm *other) {
  const double bend = hyst_fabs(c) > least ? hyst_fabs(c) : least; /* a smaller value has no effect */
  a->z = hyst_pow(A / bend, 1 / n);
  a->u = a->z / A;
  if (c >= 0 && other) a->unit = other->unit;
  else hyst_saturation_build(&a->unit, c < 0 ? -1 : 1, n);
}

typedef struct {
  const arm *away, *back;
  double z_max;
} curve;

static double at(const curve *c, double xi) {
  const arm *a = xi < 0 ? c->back : c->away;
  const double v = a->z * hyst_saturation_at(&a->unit, hyst_fabs(xi) / a->u);
  return hyst_copysign(v > c->z_max ? c->z_max : v, xi);
}
static double path(const curve *c, double v) {
  const arm *a = v < 0 ? c->back : c->away;
  return hyst_copysign(a->u * hyst_saturation_path(&a->unit, hyst_fabs(v) / a->z), v);
}

typedef struct {
  double s, u, xi; /* xi: path from v = 0 to the reversal; negative: remaining path to v = 0 */
} reversal;

/* returns the reversal at the start of the path to u; p: A, beta, gamma, n */
static reversal start(const curve *c, const double *p, const double *turn, const double *law, double u_last,
                      double z_last, double u) {
  const double s = u > u_last ? 1 : -1;
  const int same = p[0] == law[0] && p[1] == law[1] && p[2] == law[2] && p[3] == law[3];
  const reversal stored = {s, turn[1], turn[2]};
  if (s == turn[0] && same) return stored;
  const reversal now = {s, u_last, path(c, s * hyst_clamp(z_last, -c->z_max, c->z_max))};
  return now;
}

static double value(const curve *c, reversal r, double u) { return r.s * at(c, r.xi + r.s * (u - r.u)); }

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  const double bound = *A / (*beta + *gamma), least = 1e-20 * (*beta + *gamma);
  if (!(bound > 0) || !hyst_isfinite(bound)) return "beta + gamma must be greater than 0, else z is unbounded";
  *z_max = hyst_pow(bound, 1 / *n);
  if (hyst_fabs(*z0) > *z_max) return "|z0| must be at most (A / (beta + gamma))^(1/n)";
  build((arm *)away, *A, *gamma + *beta, least, *n, NULL);
  build((arm *)back, *A, *gamma - *beta, least, *n, (const arm *)away);
  return NULL;
}
HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  *turn = 0;
  *u_last = *u0;
  *z_last = *z0;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const curve c = {(const arm *)away, (const arm *)back, *z_max};
  *z = *u == *u_last ? hyst_clamp(*z_last, -*z_max, *z_max)
                     : value(&c, start(&c, A, turn, law, *u_last, *z_last, *u), *u);
  *y = *k * (*alpha * *u + (1 - *alpha) * *z);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  if (*u != *u_last) {
    const curve c = {(const arm *)away, (const arm *)back, *z_max};
    const reversal r = start(&c, A, turn, law, *u_last, *z_last, *u);
    *z_last = value(&c, r, *u);
    turn[0] = r.s;
    turn[1] = r.u;
    turn[2] = r.xi;
    for (int i = 0; i < 4; i++) law[i] = A[i];
  }
  *u_last = *u;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const curve c = {(const arm *)away, (const arm *)back, *z_max};
  const double du = *u - *u_last, sign = du > 0 || (du == 0 && *s_u > 0) ? 1 : -1;
  const double now = du == 0 ? *z_last : value(&c, start(&c, A, turn, law, *u_last, *z_last, *u), *u), v = sign * now;
  *t_z = (*A - (v > 0 ? *gamma + *beta : *gamma - *beta) * hyst_pow(hyst_fabs(v), *n)) * *s_u;
  *t_y = *k * (*alpha * *s_u + (1 - *alpha) * *t_z);
}
/* dv/dxi, and the derivatives of v by A and by c at the same xi; the derivative by n is left to differences */
typedef struct {
  double rate, A, c;
} by_law;
static by_law at_by_law(const curve *c, double A, double bend, double n, double xi) {
  const arm *a = xi < 0 ? c->back : c->away;
  const double t = hyst_fabs(xi) / a->u, x = hyst_isfinite(t) ? hyst_saturation_at(&a->unit, t) : 1;
  const double q = hyst_pow(x, n), left = 1 - a->unit.s * q, slope = left > 0 ? left : 0,
               path = slope > 0 ? slope * t : 0;
  /* for a small q the difference of x and the path is lost in rounding, and the first term of its series is exact */
  const double by_c =
      q < 1e-8 ? -hyst_pow(A * hyst_fabs(xi), n) * hyst_fabs(xi) / (n + 1) : -a->z / (n * bend) * (x - path);
  const by_law found = {A * slope, hyst_copysign(a->z / A * (x / n + path * (1 - 1 / n)), xi), xi < 0 ? -by_c : by_c};
  return found;
}
/* v = V(xi; A, beta, gamma), the curve, with xi = turn[2] + s (u - turn[1]); at a reversal xi follows from v = s z */
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  const curve c = {(const arm *)away, (const arm *)back, *z_max};
  double *by_turn = s_turn + n_columns, *by_xi = s_turn + 2 * n_columns;
  if (*u != *u_last) {
    const reversal r = start(&c, A, turn, law, *u_last, *z_last, *u);
    const double xi = r.xi + r.s * (*u - r.u), side = xi < 0 ? -1 : 1;
    const by_law now = at_by_law(&c, *A, *gamma + side * *beta, *n, xi);
    if (r.s != turn[0]) {
      const double was = r.xi < 0 ? -1 : 1;
      const by_law then = at_by_law(&c, *A, *gamma + was * *beta, *n, r.xi);
      for (int64_t j = 0; j < n_columns; j++) by_xi[j] = r.s * s_z_last[j], by_turn[j] = s_u_last[j];
      for (const hyst_change *e = s_A; e < end_A; e++) by_xi[e->column] -= e->size * then.A;
      for (const hyst_change *e = s_beta; e < end_beta; e++) by_xi[e->column] -= e->size * was * then.c;
      for (const hyst_change *e = s_gamma; e < end_gamma; e++) by_xi[e->column] -= e->size * then.c;
      for (int64_t j = 0; j < n_columns; j++) by_xi[j] = then.rate > 0 ? by_xi[j] / then.rate : 0;
    }
    for (int64_t k = 0; k < n_columns; k++) s_z_last[k] = now.rate * (r.s * by_xi[k] + s_u[k] - by_turn[k]);
    for (const hyst_change *e = s_A; e < end_A; e++) s_z_last[e->column] += e->size * r.s * now.A;
    for (const hyst_change *e = s_beta; e < end_beta; e++) s_z_last[e->column] += e->size * r.s * side * now.c;
    for (const hyst_change *e = s_gamma; e < end_gamma; e++) s_z_last[e->column] += e->size * r.s * now.c;
  } else {
    for (int64_t j = 0; j < n_columns; j++) {
      const double d = s_u[j] - s_u_last[j], v = d > 0 ? *z_last : -*z_last;
      if (d != 0) s_z_last[j] += (*A - (v > 0 ? *gamma + *beta : *gamma - *beta) * hyst_pow(hyst_fabs(v), *n)) * d;
    }
  }
  HYST_ADVANCE(update);
  for (int64_t k = 0; k < n_columns; k++) s_u_last[k] = s_u[k], t_z[k] = s_z_last[k];
  const double clamped = hyst_clamp(*z_last, -*z_max, *z_max);
  for (int64_t j = 0; j < n_columns; j++) t_y[j] = *k * (*alpha * s_u[j] + (1 - *alpha) * t_z[j]);
  for (const hyst_change *e = s_k; e < end_k; e++) t_y[e->column] += e->size * (*alpha * *u + (1 - *alpha) * clamped);
  for (const hyst_change *e = s_alpha; e < end_alpha; e++) t_y[e->column] += e->size * *k * (*u - clamped);
}
HYST_BLOCK(bouc_wen,
           (.text = "Bouc-Wen operator",
            .equation = "z' = A u' - beta |u'| |z|^(n-1) z - gamma u' |z|^n, y = k (alpha u + (1 - alpha) z)",
            .source = "Wen 1976; Ikhouane & Rodellar 2007, ch. 2", .family = "operators", .tolerance = "rounding",
            .sensitivity = sensitivity, .differences = "n"),
           .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
