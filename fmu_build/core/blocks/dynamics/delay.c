/* Delay by n steps: after the step with input u_k the output is u_(k-n).  Without direct feed-through it breaks
 * algebraic loops. */
#include "core/hyst.h"
#include "core/memory/stored.h"

#define DIMS(D) D(n, 1, 1, 1000000, "steps of delay")
#define VARS(V)                                                                                  \
  V(y0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output until the first input arrives") \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                 \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input n steps ago")                    \
  V(ring, STATE, n + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "the last n + 1 inputs")          \
  V(oldest, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "index of the oldest input")

HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  for (int i = 0; i <= n; i++) ring[i] = *y0;
  *oldest = 0;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *y = ring[hyst_stored(*oldest, n)];
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const int at = hyst_stored(*oldest, n); /* contains u_(k-1-n), which is no longer needed */
  ring[at] = *u;
  *oldest = at == n ? 0 : at + 1;
}
HYST_FEEDTHROUGH_FN(feedthrough) {
  HYST_OPEN_FEEDTHROUGH
  return 0;
}
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  double *const taken = s_ring + hyst_stored(*oldest, n) * n_columns;
  for (int64_t c = 0; c < n_columns; c++) taken[c] = s_u[c];
  HYST_ADVANCE(update);
  const double *const given = s_ring + hyst_stored(*oldest, n) * n_columns;
  for (int64_t c = 0; c < n_columns; c++) t_y[c] = given[c];
}
HYST_BLOCK(delay,
           (.text = "Delay by a whole number of steps", .equation = "y_k = u_(k-n)",
            .source = "definition of the shift operator", .family = "dynamics", .tolerance = "rounding",
            .sensitivity = sensitivity),
           .rate = HYST_SAMPLED, .init = init, .output = output, .update = update, .feedthrough = feedthrough)
