/* Constraint-factor operator: the branch is g(d) = (1 - e^-d) (a0 + sum_{j=1..m} a_j d^(2j-1)), d = |x - x_p|; the
 * factor 1 - e^-d makes it 0 at its start.  m = 1, a0 = 0, a_1 = 1 is the Zhao-Tan operator.
 *
 * Exponents.  Eq. 1 of Shen & Ma 2017 and the ten coefficients of table 1 agree on the odd powers d, d^3, .., d^(2m-1),
 * m = 9: "9-order" counts the powers, the degree is 17.  The normal equations confirm it: d^(2j-1) d^(2k-1) =
 * d^(2(j+k-1)), eq. 5.  The last exponent of eq. 7, 2(m-1), is a misprint of 2(2m-1), which eq. 8 has.
 *
 * A hysteretic operator needs an increasing branch; the printed a0 = -13.1 = g'(0) gives none.  memory = last, the
 * literal reading for replicas, takes any coefficients. */
#include "core/memory/odd_branch.h"
#include "core/memory/return_point.h"

#define DIMS(D) HYST_ODD_DIMS(D)
#define VARS(V)                                                                                                 \
  HYST_ODD_ROWS(V)                                                                                              \
  V(memory, FIXED, 1, "dominant|last", "1", 0, 0, 1, "extremum at which a branch starts")                       \
  V(x0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "initial memory: the operator rests at x = x0, h = 0") \
  V(edge, DERIVED, 2, "real", "1", 0.0, -HYST_INF, HYST_INF, "g and g' at d_max")                               \
  V(x, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                                \
  V(h, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output of the operator")                              \
  V(extrema, STATE, HYST_TURNING_POINTS(depth), "real", "1", 0.0, -HYST_INF, HYST_INF, "extrema of x")

static hyst_turn turn(hyst_odd l, double memory, const double *extrema, int depth, double x, double x0) {
  return hyst_turn_chosen(memory, extrema, depth, x, x0, 0, hyst_odd_branch, &l);
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  const hyst_odd l = hyst_odd_of(*a0, a, m, *d_max, edge);
  hyst_odd_prepare(&l, edge);
  if (*memory != (double)HYST_LAST && !(hyst_odd_least_slope(&l, 0) >= 0))
    return "the branch (1 - e^-d) (a0 + sum a_j d^(2j-1)) must not decrease between d = 0 and d_max";
  return NULL;
}
HYST_RETURN_POINT(extrema, *x, h, turn(hyst_odd_of(*a0, a, m, *d_max, edge), *memory, extrema, depth, *x, *x0), *x0, 0)
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const hyst_odd l = hyst_odd_of(*a0, a, m, *d_max, edge);
  *t_h = hyst_turn_chosen_slope(*memory, extrema, depth, *x, *x0, *s_x, hyst_odd_branch_slope, &l);
}
HYST_BLOCK(
    constraint_factor,
    (.text = "Constraint-factor operator (Ma): odd polynomial branch",
     .equation = "h = h_p + sgn(x - x_p) (1 - e^-d) (a0 + sum_j a_j d^(2j-1)), d = |x - x_p|; virgin branch by Masing",
     .source = "Shen & Ma 2017, eq. 1-2, with return-point memory", .family = "operators", .tolerance = "rounding"),
    .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent, .update = update)
