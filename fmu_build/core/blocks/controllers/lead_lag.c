/* Lead-lag controller around a feed-forward: sections (T_z s + 1) / (T_p s + 1) in series, each by the bilinear rule
 * (Tustin), which keeps gain and phase of the continuous controller below about a tenth of the sampling frequency,
 * where the exact response to a held input (transfer_function) loses half a step of phase.  A section is its direct
 * term T_z/T_p plus a lag.  It starts in equilibrium with the first error, without a kick. */
#include "core/blocks/controllers/control.h"
#include "core/elementary/limit.h"

#define DIMS(D) D(n, 1, 1, 1000, "number of sections")
#define VARS(V)                                                                                                 \
  V(K, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "static gain")                                          \
  V(T_z, PARAM, n, "real", "s", 1.0, 0.0, HYST_INF, "time constants of the zeros; greater than T_p for a lead") \
  V(T_p, PARAM, n, "real", "s", 0.1, HYST_POSITIVE, HYST_INF, "time constants of the poles")                    \
  HYST_LIMIT_ROWS(V)                                                                                            \
  HYST_LOOP_ROWS(V, "feed-forward")                                                                             \
  V(lag, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "outputs of the lags in the sections")                \
  V(in_last, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "inputs of the sections at the last step")

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  for (int i = 0; i < n; i++)
    if (!(T_z[i] / T_p[i] <= 1e300)) return "T_p is too small relative to T_z";
  return hyst_wrong_limits(*u_min, *u_max);
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  double in = *y_d - *y;
  for (int i = 0; i < n; i++) in = lag[i] + T_z[i] / T_p[i] * in;
  *u = hyst_clamp(*u_ff + *K * in, *u_min, *u_max);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  double in = *y_d - *y;
  for (int i = 0; i < n; i++) {
    const double direct = T_z[i] / T_p[i], rest = 1 - direct;
    if (dt > 0) lag[i] = ((2 * T_p[i] - dt) * lag[i] + dt * rest * (in + in_last[i])) / (2 * T_p[i] + dt);
    else lag[i] = rest * in;
    in_last[i] = in;
    in = lag[i] + direct * in;
  }
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  double in = *y_d - *y, s_in = *s_y_d - *s_y;
  for (int i = 0; i < n; i++) in = lag[i] + T_z[i] / T_p[i] * in, s_in *= T_z[i] / T_p[i];
  *t_u = hyst_clamp_tangent(*u_ff + *K * in, *u_min, *u_max, *s_u_ff + *K * s_in);
}
HYST_BLOCK(lead_lag,
           (.text = "Lead-lag controller with feed-forward and limits",
            .equation = "u = u_ff + K prod_i (T_z,i s + 1) / (T_p,i s + 1) e, e = y_d - y, s = 2/h (z - 1)/(z + 1)",
            .source = "Franklin, Powell & Workman, Digital Control of Dynamic Systems, 3rd ed., sections 5.3 and 6.1",
            .family = "controllers", .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .prepare = prepare, .output = output, .tangent = tangent, .update = update)
