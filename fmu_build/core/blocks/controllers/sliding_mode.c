/* Sliding mode controller around a feed-forward, with integral action, limits and anti-windup.
 * With k_i = 0 this is the law of Yu & Alici 2005. That law has a steady error if the plant differs from its model; the
 * integral removes this error. Within the layer the law is linear: with k_i = 0 a PD, else a PID of Kd = eta + rho /
 * epsilon, Kp = Kd lam, Ki = Kd k_i. With one step of delay and Ms of at most 6 dB, a loop cannot use more switching;
 * python/docs/tracking.md has the figures. `saturation` is linear within the layer and full outside, `smooth` reaches
 * half of rho at its edge. If epsilon is 0, the width of the layer is computed from the gains, so that a loop does not
 * depend on the unit of measure of y: the slope of the law in the layer is then ten times eta. */
#include "core/blocks/controllers/control.h"
#include "core/elementary/elementary.h"
#include "core/elementary/limit.h"

#define DIMS(D)
#define VARS(V)                                                                                                  \
  V(lam, PARAM, 1, "real", "1/s", 100.0, 0.0, HYST_INF, "slope of the sliding line")                             \
  V(eta, PARAM, 1, "real", "s", 0.0, 0.0, HYST_INF, "linear gain of s")                                          \
  V(rho, PARAM, 1, "real", "1", 0.0, 0.0, HYST_INF, "switching gain")                                            \
  V(epsilon, PARAM, 1, "real", "1/s", 0.0, 0.0, HYST_INF, "width of the boundary layer; 0: rho / (10 eta)")      \
  V(switching, FIXED, 1, "smooth|saturation", "1", 0.0, 0.0, 1.0, "law s / (|s| + epsilon) or sat(s / epsilon)") \
  V(k_i, PARAM, 1, "real", "1/s2", 0.0, 0.0, HYST_INF, "integral gain; 0: law of Yu & Alici 2005")               \
  V(tau, PARAM, 1, "real", "s", 0.0, 0.0, HYST_INF, "time constant of the filter of de/dt; 0: none")             \
  HYST_LIMIT_ROWS(V)                                                                                             \
  HYST_LOOP_ROWS(V, "feed-forward, such as the output of an inverse model")                                      \
  V(s, OUTPUT, 1, "real", "1/s", 0.0, -HYST_INF, HYST_INF, "distance from the sliding line")                     \
  V(layer, DERIVED, 1, "real", "1/s", 1.0, 0.0, HYST_INF, "width of the boundary layer")                         \
  V(integral, STATE, 1, "real", "s", 0.0, -HYST_INF, HYST_INF, "integral of the error")                          \
  HYST_DIFFERENCE_ROWS(V)

enum { SMOOTH, SATURATION };

static double law(double u_ff, double s, double eta, double rho, double epsilon, double switching) {
  if ((int)switching == SATURATION) return u_ff - eta * s - rho * hyst_clamp(s / epsilon, -1, 1);
  return u_ff - eta * s - rho * s / (hyst_fabs(s) + epsilon);
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  *layer = *epsilon > 0 ? *epsilon : *rho > 0 ? *rho / (10 * *eta) : 1; /* if rho = 0, there is no switching */
  if (!(*layer > 0 && hyst_isfinite(*layer))) return "epsilon must be greater than 0 if eta is 0";
  return hyst_wrong_limits(*u_min, *u_max);
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *s = *de + *lam * (*y - *y_d) + *k_i * *integral;
  *u = hyst_clamp(law(*u_ff, *s, *eta, *rho, *layer, *switching), *u_min, *u_max);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const double e = *y - *y_d, step = e * dt;
  *de = hyst_difference(*de, e, *e_last, *tau, dt);
  *e_last = e;
  const double s = *de + *lam * e + *k_i * *integral;
  const double before = law(*u_ff, s, *eta, *rho, *layer, *switching);
  const double after = law(*u_ff, s + *k_i * step, *eta, *rho, *layer, *switching);
  if (!hyst_winds_up(before, after, *u_min, *u_max)) *integral += step;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double line = *de + *lam * (*y - *y_d) + *k_i * *integral, width = hyst_fabs(line) + *layer;
  *t_s = *lam * (*s_y - *s_y_d);
  const double d_switching = (int)*switching == SATURATION ? hyst_clamp_tangent(line / *layer, -1, 1, *t_s / *layer)
                                                           : *layer / (width * width) * *t_s;
  const double d_law = *s_u_ff - *eta * *t_s - *rho * d_switching;
  *t_u = hyst_clamp_tangent(law(*u_ff, line, *eta, *rho, *layer, *switching), *u_min, *u_max, d_law);
}
HYST_BLOCK(
    sliding_mode,
    (.text = "Sliding mode controller with feed-forward, integral action and anti-windup",
     .equation = "s = de/dt + lam e + k_i int e dt, e = y - y_d, u = u_ff - eta s - rho s / (|s| + epsilon) "
                 "or u_ff - eta s - rho sat(s / epsilon)",
     .source = "Yu & Alici 2005 (k_i = 0); integral sliding line and saturation: Slotine & Li, Applied Nonlinear "
               "Control, 7.1 and 7.2",
     .family = "controllers", .tolerance = "rounding"),
    .rate = HYST_SAMPLED, .prepare = prepare, .output = output, .tangent = tangent, .update = update)
