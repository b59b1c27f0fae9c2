/* Exact inverse of the constraint-factor operator with the same parameters (memory = dominant): the same memory driven
 * by h, with the inverse branch, found by a bounded number of bracketed Newton steps. */
#include "core/memory/odd_branch.h"
#include "core/memory/return_point.h"

#define DIMS(D) HYST_ODD_DIMS(D)
#define VARS(V)                                                                                                 \
  HYST_ODD_ROWS(V)                                                                                              \
  V(x0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "initial memory: the operator rests at x = x0, h = 0") \
  V(edge, DERIVED, 2, "real", "1", 0.0, -HYST_INF, HYST_INF, "g and g' at d_max")                               \
  V(h, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "wanted output of the operator")                        \
  V(x, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "operator input for the output h")                     \
  V(extrema, STATE, HYST_TURNING_POINTS(depth), "real", "1", 0.0, -HYST_INF, HYST_INF, "dominant extrema of h")

static hyst_turn turn(hyst_odd l, const double *extrema, int depth, double h, double x0) {
  return hyst_turn_dominant(extrema, depth, h, 0, x0, hyst_odd_inverse, &l);
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  const hyst_odd l = hyst_odd_of(*a0, a, m, *d_max, edge);
  hyst_odd_prepare(&l, edge);
  if (!(*a0 >= 0 && hyst_odd_least_slope(&l, 1) > 0))
    return "the branch (1 - e^-d) (a0 + sum a_j d^(2j-1)) must rise between d = 0 and d_max";
  return NULL;
}
HYST_RETURN_POINT(extrema, *h, x, turn(hyst_odd_of(*a0, a, m, *d_max, edge), extrema, depth, *h, *x0), 0, *x0)
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const hyst_odd l = hyst_odd_of(*a0, a, m, *d_max, edge);
  *t_x = hyst_turn_dominant_slope(extrema, depth, *h, 0, *s_h, hyst_odd_inverse_slope, &l);
}
HYST_BLOCK(constraint_factor_inverse,
           (.text = "Exact inverse of the constraint-factor operator",
            .equation = "x = x_p + sgn(h - h_p) g^-1(|h - h_p|), g(d) = (1 - e^-d) (a0 + sum_j a_j d^(2j-1))",
            .source = "Shen & Ma 2017, eq. 1-2, solved for x; inverse by the same memory: Krejci & Kuhnen 2001",
            .family = "inverses", .inverts = "constraint_factor", .invert_condition = "memory = 'dominant'",
            .tolerance = "iteration", .smooth = 1e-7),
           .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
