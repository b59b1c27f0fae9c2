/* Zhao-Tan hysteretic operator: from an extremum (x_p, h_p) the branch h = h_p +- (1 - e^-d) d, d = |x - x_p|.
 * memory = dominant: the extrema that return-point memory keeps (Zhao & Tan 2008, eq. 1: "dominant extremum"),
 * with Masing's virgin branch; the operator then is a Prandtl-Ishlinskii operator of play density 4 e^-2r (1 - r).
 * memory = last: the last extremum, as the text of the paper says.  This output has no bound and drifts under noise;
 * use it only to repeat published figures. */
#include "core/elementary/elementary.h"
#include "core/memory/return_point.h"

#define DIMS(D) D(depth, 256, 4, 100000, "maximum number of stored extrema")
#define VARS(V)                                                                                                 \
  V(memory, FIXED, 1, "dominant|last", "1", 0, 0, 1, "extremum at which a branch starts")                       \
  V(x0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "initial memory: the operator rests at x = x0, h = 0") \
  V(x, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                                \
  V(h, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output of the operator")                              \
  V(extrema, STATE, HYST_TURNING_POINTS(depth), "real", "1", 0.0, -HYST_INF, HYST_INF, "extrema of x")

static double branch(const void *none, double d) {
  (void)none;
  return -hyst_expm1(-d) * d;
}

HYST_RETURN_POINT(extrema, *x, h, hyst_turn_chosen(*memory, extrema, depth, *x, *x0, 0, branch, NULL), *x0, 0)
static double branch_slope(const void *none, double d, int grows) {
  (void)none, (void)grows;
  const double m = hyst_expm1(-d);
  return d * (1 + m) - m;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  *t_h = hyst_turn_chosen_slope(*memory, extrema, depth, *x, *x0, *s_x, branch_slope, NULL);
}
HYST_BLOCK(
    zhao_tan,
    (.text = "Zhao-Tan hysteretic operator",
     .equation = "h = h_p + sgn(x - x_p) (1 - e^-d) d, d = |x - x_p|; virgin branch h = sgn(x - x0) g(2|x - x0|)/2",
     .source = "Zhao & Tan 2008, eq. 1", .family = "operators", .tolerance = "rounding"),
    .rate = HYST_HYSTERETIC, .init = init, .output = output, .tangent = tangent, .update = update)
