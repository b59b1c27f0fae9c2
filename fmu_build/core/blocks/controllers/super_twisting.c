/* Generalised super-twisting controller around a feed-forward: second-order sliding mode, whose switching term is
 * integrated, so that the command is continuous.  mu = 0 is the super-twisting law of Levant; the linear terms of mu
 * reduce the error while s is large. The boundary layer epsilon replaces sgn(s) as in the law of Yu & Alici: with a
 * finite step, sgn(s) chatters. If epsilon is 0, the width of the layer is computed from the gains, so that a loop does
 * not depend on the unit of measure of y: the corner frequency of the integrator within the layer, k_2 / (2 k_1
 * epsilon^(1/2)), is then lam / 20. The integrator uses the backward rule. */
#include "core/blocks/controllers/control.h"
#include "core/elementary/elementary.h"
#include "core/elementary/limit.h"

#define DIMS(D)
#define VARS(V)                                                                                                     \
  V(lam, PARAM, 1, "real", "1/s", 100.0, 0.0, HYST_INF, "slope of the sliding line")                                \
  V(k_1, PARAM, 1, "real", "1", 0.0, 0.0, HYST_INF, "gain of |s|^(1/2), in seconds^(1/2)")                          \
  V(k_2, PARAM, 1, "real", "1/s", 0.0, 0.0, HYST_INF, "gain of the integrated switching term")                      \
  V(mu, PARAM, 1, "real", "1", 0.0, 0.0, HYST_INF, "weight of the linear terms, in seconds^(1/2); 0: none")         \
  V(epsilon, PARAM, 1, "real", "1/s", 0.0, 0.0, HYST_INF, "width of the boundary layer; 0: (10 k_2 / (lam k_1))^2") \
  V(tau, PARAM, 1, "real", "s", 0.0, 0.0, HYST_INF, "time constant of the filter of de/dt; 0: none")                \
  HYST_LIMIT_ROWS(V)                                                                                                \
  HYST_LOOP_ROWS(V, "feed-forward, such as the output of an inverse model")                                         \
  V(s, OUTPUT, 1, "real", "1/s", 0.0, -HYST_INF, HYST_INF, "distance from the sliding line")                        \
  V(layer, DERIVED, 1, "real", "1/s", 1.0, 0.0, HYST_INF, "width of the boundary layer")                            \
  V(v, STATE, 1, "real", "s", 0.0, -HYST_INF, HYST_INF, "integral of the switching term")                           \
  HYST_DIFFERENCE_ROWS(V)

static double phi_1(double s, double mu, double epsilon) { return s / hyst_sqrt(hyst_fabs(s) + epsilon) + mu * s; }

/* phi_1 phi_1', with |s| + epsilon in place of |s| */
static double phi_2(double s, double mu, double epsilon) {
  const double a = hyst_fabs(s) + epsilon;
  return 0.5 * s / a + 1.5 * mu * s / hyst_sqrt(a) + mu * mu * s;
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  const double root = 10 * *k_2 / (*lam * *k_1);
  *layer = *epsilon > 0 ? *epsilon : *k_1 == 0 && *k_2 == 0 ? 1 : root * root; /* no gains: no switching */
  if (!(*layer > 0 && hyst_isfinite(*layer))) return "epsilon must be greater than 0 if lam, k_1 or k_2 is 0";
  return hyst_wrong_limits(*u_min, *u_max);
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *s = *de + *lam * (*y - *y_d);
  *u = hyst_clamp(*u_ff - *k_1 * phi_1(*s, *mu, *layer) - *k_2 * *v, *u_min, *u_max);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const double e = *y - *y_d;
  *de = hyst_difference(*de, e, *e_last, *tau, dt);
  *e_last = e;
  const double s = *de + *lam * e, step = phi_2(s, *mu, *layer) * dt;
  const double before = *u_ff - *k_1 * phi_1(s, *mu, *layer) - *k_2 * *v;
  if (!hyst_winds_up(before, before - *k_2 * step, *u_min, *u_max)) *v += step;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double line = *de + *lam * (*y - *y_d), a = hyst_fabs(line) + *layer;
  const double free = *u_ff - *k_1 * phi_1(line, *mu, *layer) - *k_2 * *v;
  *t_s = *lam * (*s_y - *s_y_d);
  const double d_phi_1 = ((1 - 0.5 * hyst_fabs(line) / a) / hyst_sqrt(a) + *mu) * *t_s;
  *t_u = hyst_clamp_tangent(free, *u_min, *u_max, *s_u_ff - *k_1 * d_phi_1);
}
HYST_BLOCK(super_twisting,
           (.text = "Super-twisting sliding mode controller with feed-forward and anti-windup",
            .equation = "s = de/dt + lam e, e = y - y_d; u = u_ff - k_1 (|s|^(1/2) sgn s + mu s) - k_2 v, "
                        "v' = sgn(s)/2 + 3/2 mu |s|^(1/2) sgn s + mu^2 s; sgn s = s / (|s| + epsilon)",
            .source = "Levant, Int. J. Control 58 (1993) 1247; Moreno 2009, generalised super-twisting (linear terms)",
            .family = "controllers", .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .prepare = prepare, .output = output, .tangent = tangent, .update = update)
