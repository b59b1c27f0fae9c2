/* Weighted one-sided dead zones: a piecewise linear curve without memory.  After a sum of plays it makes the operator
 * asymmetric (modified Prandtl-Ishlinskii).  Kuhnen, European Journal of Control 9 (2003) 407-418. */
#include "core/hyst.h"

#define DIMS(D) D(n, 6, 1, 100000, "number of dead zones")
#define VARS(V)                                                                                   \
  V(w0, PARAM, 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "weight of the linear term")             \
  V(r, PARAM, n, "real", "=u", 0.1, -HYST_INF, HYST_INF, "thresholds; the sign selects the side") \
  V(w, PARAM, n, "real", "1", 0.1, -HYST_INF, HYST_INF, "weights of the dead zones")              \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                  \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")

static double dead_zone(double u, double r) {
  const double d = u - r;
  return (r > 0 && d < 0) || (r < 0 && d > 0) ? 0 : d; /* r = 0: S is the input */
}

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  double sum = *w0 * *u;
  for (int i = 0; i < n; i++) sum += w[i] * dead_zone(*u, r[i]);
  *y = sum;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  double sum = *w0 * *s_u;
  for (int i = 0; i < n; i++) {
    const double beyond = *u == r[i] ? *s_u : *u - r[i]; /* at a kink, the seed selects the side */
    if (r[i] == 0 || beyond * r[i] > 0) sum += w[i] * *s_u;
  }
  *t_y = sum;
}
HYST_BLOCK(
    dead_zones,
    (.text = "Weighted sum of one-sided dead zones",
     .equation = "y = w0 u + sum_i w_i S(u, r_i); S = max(u - r, 0) for r > 0, min(u - r, 0) for r < 0, u for r = 0",
     .source = "Kuhnen 2003", .family = "operators", .inverts = "dead_zones",
     .invert_condition = "the slope is positive; the inverse has other r and w", .tolerance = "rounding"),
    .rate = HYST_FUNCTION, .output = output, .tangent = tangent)
