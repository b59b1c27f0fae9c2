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
HYST_BLOCK(sum,
           (.text = "Weighted sum of signals", .equation = "y = offset + sum_i k_i u_i", .source = "linear readout",
            .family = "dynamics", .tolerance = "rounding"),
           .rate = HYST_FUNCTION, .output = output, .tangent = tangent)
