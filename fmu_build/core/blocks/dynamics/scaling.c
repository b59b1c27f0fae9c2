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
    if (lo[i] > hi[i]) return "lo must not be greater than hi";
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
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  for (int i = 0; i < n; i++) {
    const double slope = u[i] < lo[i] || u[i] > hi[i] ? 0 : gain[i];
    for (int64_t c = 0; c < n_columns; c++) t_y[i * n_columns + c] = slope * s_u[i * n_columns + c];
  }
  for (; s_gain < end_gain; s_gain++) {
    const int i = s_gain->element;
    t_y[i * n_columns + s_gain->column] += s_gain->size * hyst_clamp(u[i], lo[i], hi[i]);
  }
  for (; s_offset < end_offset; s_offset++) t_y[s_offset->element * n_columns + s_offset->column] += s_offset->size;
  for (; s_lo < end_lo; s_lo++)
    if (u[s_lo->element] < lo[s_lo->element])
      t_y[s_lo->element * n_columns + s_lo->column] += gain[s_lo->element] * s_lo->size;
  for (; s_hi < end_hi; s_hi++)
    if (u[s_hi->element] > hi[s_hi->element])
      t_y[s_hi->element * n_columns + s_hi->column] += gain[s_hi->element] * s_hi->size;
}
HYST_BLOCK(scaling,
           (.text = "Limit, gain and offset of each signal",
            .equation = "y_i = min(hi_i, max(lo_i, u_i)) gain_i + offset_i",
            .source = "affine normalisation; limits of the training range", .family = "dynamics", .inverts = "scaling",
            .invert_condition = "there is one signal and its gain is not 0; the inverse has different values",
            .tolerance = "rounding", .sensitivity = sensitivity),
           .rate = HYST_FUNCTION, .prepare = prepare, .output = output, .tangent = tangent)
