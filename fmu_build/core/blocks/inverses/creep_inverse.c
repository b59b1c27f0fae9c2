/* Exact inverse of creep with the same parameters: the input of the lags is the output y, because y is the input of the
 * creep. With s_i = 1 - e^(-dt/T_i), a step of the creep gives u = (w0 + sum w_i s_i) y + sum w_i (1 - s_i) q_i, which
 * is linear in y. It is sampled because it inverts these steps, not the differential equation: the inverse of the
 * differential equation would need an input that changes within a step. Krejci & Kuhnen 2001. */
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define DIMS(D) D(n, 1, 1, 100000, "number of lags")
#define VARS(V)                                                                                                      \
  V(w, PARAM, n, "real", "1", 1.0, -HYST_INF, HYST_INF, "weights of the lags")                                       \
  V(T, PARAM, n, "real", "s", 1.0, HYST_POSITIVE, HYST_INF, "time constants")                                        \
  V(w0, PARAM, 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "weight of the direct input, not 0")                        \
  V(start, FIXED, 1, "rest|steady", "1", 0, 0, 1, "initial lags: 0, or the first output")                            \
  V(share, DERIVED, n, "real", "1", 0.0, 0.0, 1.0, "relative change of a lag in one step: 1 - e^(-dt/T)")            \
  V(gain, DERIVED, 2, "real", "1", 1.0, -HYST_INF, HYST_INF, "gains of the creep over one step and in steady state") \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "wanted output of the creep")                                \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "creep input for the output u")                             \
  V(q, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "lagged outputs")

enum { REST, STEADY };

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  gain[0] = gain[1] = *w0;
  for (int i = 0; i < n; i++) {
    share[i] = -hyst_expm1(-dt / T[i]);
    gain[0] += w[i] * share[i];
    gain[1] += w[i];
  }
  if (*w0 == 0) return "w0 must not be 0";
  if (gain[0] == 0 || gain[1] == 0) return "the gain of the creep over a step must not be 0";
  return NULL;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  double rest = *u;
  for (int i = 0; i < n; i++) rest -= w[i] * q[i];
  *y = rest / *w0;
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  if (dt > 0) {
    double rest = *u;
    for (int i = 0; i < n; i++) rest -= w[i] * (1 - share[i]) * q[i];
    const double held = rest / gain[0];
    for (int i = 0; i < n; i++) q[i] += share[i] * (held - q[i]);
  } else if (*start == (double)STEADY) {
    for (int i = 0; i < n; i++) q[i] = *u / gain[1];
  }
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  *t_y = *s_u / *w0;
}
HYST_BLOCK(creep_inverse,
           (.text = "Exact inverse of creep",
            .equation = "y = (u - sum_i w_i q_i)/w0; q_i: first-order lags of y, held over a step",
            .source = "Krejci & Kuhnen 2001", .family = "inverses", .inverts = "creep",
            .invert_condition = "w0 is not 0", .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .flags = HYST_STEP, .prepare = prepare, .output = output, .tangent = tangent,
           .update = update)
