/* Prandtl-Ishlinskii operator: y = w0 u + sum_i w_i p_{r_i}[u], p_r the play of half-width r.
 * It is evaluated from the turning points of u with prefix sums of the weights, so the cost does not grow with n.
 * Krejci & Kuhnen, IEE Proc. Control Theory Appl. 148 (2001) 185-192, eq. 5-9. */
#include "core/memory/piecewise.h"
#include "core/memory/return_point.h"

#define DIMS(D)                                   \
  D(n, 10, 1, 100000, "number of play operators") \
  D(depth, 256, 4, 100000, "maximum number of stored extrema")
#define VARS(V)                                                                                                  \
  V(w0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "weight of the linear term")                            \
  V(r, FIXED, n, "real", "=u", 0.1, 0.0, HYST_INF, "thresholds (play half-widths), not decreasing")              \
  V(w, FIXED, n, "real", "1", 0.1, -HYST_INF, HYST_INF, "weights of the plays")                                  \
  V(u0, FIXED, 1, "real", "=u", 0.0, -HYST_INF, HYST_INF, "initial memory: every play rests at this value of u") \
  V(curve, DERIVED, HYST_PIECEWISE(n), "real", "1", 0.0, -HYST_INF, HYST_INF, "loading curve as prefix sums")    \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                                 \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                               \
  V(memory, STATE, HYST_TURNING_POINTS(depth), "real", "1", 0.0, -HYST_INF, HYST_INF, "dominant extrema of u")

static double slope(const double *curve, int n) {
  const hyst_piecewise f = {curve, n};
  return hyst_piecewise_slope(&f);
}
static hyst_turn turn(const double *curve, int n, const double *memory, int depth, double u, double u0) {
  const hyst_piecewise f = {curve, n};
  return hyst_turn_dominant(memory, depth, u, u0, hyst_piecewise_slope(&f) * u0, hyst_piecewise_branch, &f);
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  return hyst_piecewise_build(curve, n, *w0, r, w, 0);
}
HYST_RETURN_POINT(memory, *u, y, turn(curve, n, memory, depth, *u, *u0), *u0, slope(curve, n) * *u0)
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const hyst_piecewise f = {curve, n};
  *t_y = hyst_turn_dominant_slope(memory, depth, *u, *u0, *s_u, hyst_piecewise_branch_slope, &f);
}
HYST_BLOCK(prandtl_ishlinskii,
           (.text = "Prandtl-Ishlinskii operator: linear term plus weighted plays",
            .equation = "y = w0 u + sum_i w_i p_{r_i}[u]",
            .source = "Krejci & Kuhnen 2001, eq. 5-9; Zhao & Tan 2008, section II", .family = "operators",
            .tolerance = "rounding"),
           .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
