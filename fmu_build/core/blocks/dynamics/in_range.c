/* In range: whether every signal lies within its limits. In parallel to a model, it shows if the input is within the
 * range of the fit.
 */
#include "core/hyst.h"

#define DIMS(D) D(n, 1, 1, 100000, "number of signals")
#define VARS(V)                                                                   \
  V(lo, PARAM, n, "real", "1", -1.0, -1e300, 1e300, "lower limit (-1e300: none)") \
  V(hi, PARAM, n, "real", "1", 1.0, -1e300, 1e300, "upper limit (1e300: none)")   \
  V(u, INPUT, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "signals")                \
  V(y, OUTPUT, 1, "real", "1", 0.0, 0.0, 1.0, "1 if all signals are within their limits, else 0")

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  for (int i = 0; i < n; i++)
    if (lo[i] > hi[i]) return "lo must not be greater than hi";
  return NULL;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  int inside = 1;
  for (int i = 0; i < n; i++) inside &= u[i] >= lo[i] && u[i] <= hi[i];
  *y = inside;
}
HYST_BLOCK(in_range,
           (.text = "Test whether all signals are within their limits",
            .equation = "y = 1 if lo_i <= u_i <= hi_i for all i, else 0", .source = "definition", .family = "dynamics",
            .tolerance = "rounding"),
           .rate = HYST_FUNCTION, .prepare = prepare, .output = output)
