/* Creep: the input and a weighted sum of its first-order lags, discretised exactly for an input held over the step.
 * Krejci & Kuhnen 2001 (log(t) creep as a few lags). */
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define DIMS(D) D(n, 1, 1, 100000, "number of lags")
#define VARS(V)                                                                                           \
  V(w, PARAM, n, "real", "1", 1.0, -HYST_INF, HYST_INF, "weights of the lags")                            \
  V(T, PARAM, n, "real", "s", 1.0, HYST_POSITIVE, HYST_INF, "time constants")                             \
  V(w0, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "weight of the direct input")                    \
  V(start, FIXED, 1, "rest|steady", "1", 0, 0, 1, "initial lags: 0, or the first input")                  \
  V(share, DERIVED, n, "real", "1", 0.0, 0.0, 1.0, "relative change of a lag in one step: 1 - e^(-dt/T)") \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                          \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                        \
  V(q, CSTATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "lagged inputs")

enum { REST, STEADY };

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  for (int i = 0; i < n; i++) share[i] = -hyst_expm1(-dt / T[i]);
  return NULL;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  double sum = 0;
  for (int i = 0; i < n; i++) sum += w[i] * q[i];
  *y = *w0 != 0 ? sum + *w0 * *u : sum;
}
HYST_DERIV_FN(deriv) {
  HYST_OPEN_DERIV
  for (int i = 0; i < n; i++) d_q[i] = (*u - q[i]) / T[i];
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  for (int i = 0; i < n; i++) {
    if (dt > 0) q[i] += share[i] * (*u - q[i]);
    else if (*start == (double)STEADY) q[i] = *u;
  }
}
HYST_FEEDTHROUGH_FN(feedthrough) {
  HYST_OPEN_FEEDTHROUGH
  return *w0 != 0; /* otherwise y depends only on the states */
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  double sum = 0;
  for (int i = 0; i < n; i++) {
    sum += w[i] * s_q[i];
    t_q[i] = (*s_u - s_q[i]) / T[i];
  }
  *t_y = sum + *w0 * *s_u;
}
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  const int steady = dt == 0 && *start == (double)STEADY;
  for (int i = 0; i < n; i++) {
    const double part = dt > 0 ? share[i] : steady ? 1 : 0;
    double *const row = s_q + i * n_columns;
    for (int64_t c = 0; c < n_columns; c++) row[c] += part * (s_u[c] - row[c]);
  }
  for (; s_share < end_share && dt > 0; s_share++)
    s_q[s_share->element * n_columns + s_share->column] += s_share->size * (*u - q[s_share->element]);
  HYST_ADVANCE(update);
  for (int64_t c = 0; c < n_columns; c++) t_y[c] = *w0 * s_u[c];
  for (int i = 0; i < n; i++)
    for (int64_t c = 0; c < n_columns; c++) t_y[c] += w[i] * s_q[i * n_columns + c];
  for (; s_w < end_w; s_w++) t_y[s_w->column] += s_w->size * q[s_w->element];
  for (; s_w0 < end_w0; s_w0++) t_y[s_w0->column] += s_w0->size * *u;
}
HYST_BLOCK(creep,
           (.text = "Creep: weighted sum of the input and its first-order lags",
            .equation = "q_i' = (u - q_i)/T_i, y = w0 u + sum_i w_i q_i", .source = "Krejci & Kuhnen 2001",
            .family = "operators", .tolerance = "rounding", .sensitivity = sensitivity, .derives = 1),
           .rate = HYST_CONTINUOUS, .flags = HYST_STEP, .prepare = prepare, .output = output, .tangent = tangent,
           .deriv = deriv, .update = update, .feedthrough = feedthrough)
