/* Scaling of each signal: limit, gain, offset.  Normalises the signals of a model and limits the inputs of a network to
 * the range of its training data. */
#include "core/elementary/limit.h"
#include "core/hyst.h"

#define DIMS(D) D(n, 1, 1, 100000, "number of signals")
#define VARS(V)                                                                                  \
  V(gain, PARAM, n, "real", "1", 1.0, -HYST_INF, HYST_INF, "gain")                               \
  V(offset, PARAM, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "offset, added after the gain")     \
  V(lo, PARAM, n, "real", "1", -1e300, -1e300, 1e300, "lower limit of the input (-1e300: none)") \
  V(hi, PARAM, n, "real", "1", 1e300, -1e300, 1e300, "upper limit of the input (1e300: none)")   \
  V(u, INPUT, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "inputs")                                \
  V(y, OUTPUT, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "limited, scaled and shifted inputs")

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  for (int i = 0; i < n; i++)
    if (lo[i] > hi[i]) return "the limits need lo <= hi";
  return NULL;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  for (int i = 0; i < n; i++) y[i] = hyst_clamp(u[i], lo[i], hi[i]) * gain[i] + offset[i];
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  for (int i = 0; i < n; i++) t_y[i] = hyst_clamp_tangent(u[i], lo[i], hi[i], s_u[i]) * gain[i];
}
HYST_BLOCK(scaling,
           (.text = "Limit, gain and offset of each signal",
            .equation = "y_i = min(hi_i, max(lo_i, u_i)) gain_i + offset_i",
            .source = "affine normalisation; limits of the training range", .family = "dynamics", .inverts = "scaling",
            .invert_condition = "one signal with gain other than 0; the inverse has other values",
            .tolerance = "rounding"),
           .rate = HYST_FUNCTION, .prepare = prepare, .output = output, .tangent = tangent)
