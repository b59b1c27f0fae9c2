/* Filtered derivative: du/dt through 1 / (tau s + 1) by the backward rule, tau = 0: the plain difference.  The feature
 * that makes a network rate-dependent (Yu & Alici 2005: inputs u and du/dt); 0 until a step has been made.
 * The output depends on the current input, so the state holds the previous step and its start values. */
#include "core/blocks/controllers/control.h"

#define DIMS(D)
#define VARS(V)                                                                                         \
  V(tau, PARAM, 1, "real", "s", 0.0, 0.0, HYST_INF, "time constant of the filter; 0: plain difference") \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                        \
  V(du, OUTPUT, 1, "real", "1/s", 0.0, -HYST_INF, HYST_INF, "derivative of u")                          \
  V(step, STATE, 1, "real", "s", 0.0, 0.0, HYST_INF, "length of the last step")                         \
  V(u_end, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input at the end of the last step")        \
  V(u_begin, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input at the start of the last step")    \
  V(du_begin, STATE, 1, "real", "1/s", 0.0, -HYST_INF, HYST_INF, "derivative at the start of the last step")

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *du = hyst_difference(*du_begin, *u, *u_begin, *tau, *step);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  *du_begin = hyst_difference(*du_begin, *u_end, *u_begin, *tau, *step);
  *u_begin = *u_end;
  *u_end = *u;
  *step = dt;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  *t_du = *step > 0 ? *s_u / (*tau + *step) : 0;
}
HYST_BLOCK(differentiator,
           (.text = "Filtered derivative of a signal", .equation = "du_k = (tau du_(k-1) + u_k - u_(k-1)) / (tau + h)",
            .source = "Astrom & Hagglund, PID Controllers, 2nd ed. 1995, section 3.6 (backward differences)",
            .family = "dynamics", .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .output = output, .tangent = tangent, .update = update)
