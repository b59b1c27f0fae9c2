/* Weighted sum of signals: adders, differences (k = 1, -1), readouts of several operators. */
#include "core/hyst.h"

#define DIMS(D) D(n, 2, 1, 100000, "number of signals")
#define VARS(V)                                                               \
  V(k, PARAM, n, "real", "1", 1.0, -HYST_INF, HYST_INF, "weights")            \
  V(offset, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "constant term") \
  V(u, INPUT, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "inputs")             \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "weighted sum")

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  double sum = *offset;
  for (int i = 0; i < n; i++) sum += k[i] * u[i];
  *y = sum;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  double sum = 0;
  for (int i = 0; i < n; i++) sum += k[i] * s_u[i];
  *t_y = sum;
}
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  for (int64_t c = 0; c < n_columns; c++) t_y[c] = 0;
  for (int i = 0; i < n; i++)
    for (int64_t c = 0; c < n_columns; c++) t_y[c] += k[i] * s_u[i * n_columns + c];
  for (; s_k < end_k; s_k++) t_y[s_k->column] += s_k->size * u[s_k->element];
  for (; s_offset < end_offset; s_offset++) t_y[s_offset->column] += s_offset->size;
}
HYST_BLOCK(sum,
           (.text = "Weighted sum of signals", .equation = "y = offset + sum_i k_i u_i", .source = "linear readout",
            .family = "dynamics", .tolerance = "rounding", .sensitivity = sensitivity),
           .rate = HYST_FUNCTION, .output = output, .tangent = tangent)
