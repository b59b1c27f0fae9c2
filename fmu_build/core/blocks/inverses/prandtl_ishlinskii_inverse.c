/* Exact inverse of the Prandtl-Ishlinskii operator with the same parameters: the same memory driven by y, with the
 * inverse loading curve.  It is again a Prandtl-Ishlinskii operator.
 * Krejci & Kuhnen, IEE Proc. Control Theory Appl. 148 (2001) 185-192, eq. 10-14. */
#include "core/memory/piecewise.h"
#include "core/memory/return_point.h"

#define DIMS(D)                                   \
  D(n, 10, 1, 100000, "number of play operators") \
  D(depth, 256, 4, 100000, "maximum number of stored extrema")
#define VARS(V)                                                                                                 \
  V(w0, FIXED, 1, "real", "1", 1.0, HYST_POSITIVE, HYST_INF, "weight of the linear term, greater than 0")       \
  V(r, FIXED, n, "real", "1", 0.1, 0.0, HYST_INF, "thresholds (play half-widths), not decreasing")              \
  V(w, FIXED, n, "real", "1", 0.1, -HYST_INF, HYST_INF, "weights of the plays")                                 \
  V(u0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "initial memory: every play rests at this value of u") \
  V(curve, DERIVED, HYST_PIECEWISE(n), "real", "1", 0.0, -HYST_INF, HYST_INF, "loading curve as prefix sums")   \
  V(y, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "wanted output of the operator")                        \
  V(u, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "operator input for the output y")                     \
  V(memory, STATE, HYST_TURNING_POINTS(depth), "real", "1", 0.0, -HYST_INF, HYST_INF, "dominant extrema of y")

static double slope(const double *curve, int n) {
  const hyst_piecewise f = {curve, n};
  return hyst_piecewise_slope(&f);
}
static hyst_turn turn(const double *curve, int n, const double *memory, int depth, double y, double u0) {
  const hyst_piecewise f = {curve, n};
  return hyst_turn_dominant(memory, depth, y, hyst_piecewise_slope(&f) * u0, u0, hyst_piecewise_inverse_branch, &f);
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  return hyst_piecewise_build(curve, n, *w0, r, w, 1);
}
HYST_RETURN_POINT(memory, *y, u, turn(curve, n, memory, depth, *y, *u0), slope(curve, n) * *u0, *u0)
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const hyst_piecewise f = {curve, n};
  *t_u =
      hyst_turn_dominant_slope(memory, depth, *y, slope(curve, n) * *u0, *s_y, hyst_piecewise_inverse_branch_slope, &f);
}
HYST_BLOCK(prandtl_ishlinskii_inverse,
           (.text = "Exact inverse of the Prandtl-Ishlinskii operator",
            .equation = "u such that w0 u + sum_i w_i p_{r_i}[u] = y", .source = "Krejci & Kuhnen 2001, eq. 10-14",
            .family = "inverses", .inverts = "prandtl_ishlinskii",
            .invert_condition = "w0 > 0 and w0 + w_1 + ... + w_i > 0 for every i", .tolerance = "rounding"),
           .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
