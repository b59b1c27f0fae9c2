/* Exact inverse of the Zhao-Tan operator (memory = dominant): the same memory driven by h, with the inverse branch
 * d = g^-1(v) of g(d) = (1 - e^-d) d.  The inverse operator of the paper (Zhao & Tan 2008, eq. 11) is an
 * approximation that a network corrects; this one is exact. */
#include "core/elementary/elementary.h"
#include "core/memory/return_point.h"

#define DIMS(D) D(depth, 256, 4, 100000, "maximum number of stored extrema")
#define VARS(V)                                                                                                 \
  V(x0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "initial memory: the operator rests at x = x0, h = 0") \
  V(h, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "wanted output of the operator")                        \
  V(x, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "operator input for the output h")                     \
  V(extrema, STATE, HYST_TURNING_POINTS(depth), "real", "1", 0.0, -HYST_INF, HYST_INF, "dominant extrema of h")

/* g^-1(v) by Halley's method: from the series at 0, or from the asymptote, 2 to 4 steps to full accuracy */
static double branch(const void *none, double v) {
  (void)none;
  if (!(v > 0 && v < 50)) return v; /* e^-50: g(d) = d to the last bit */
  const double s = hyst_sqrt(v);
  double d = v < 3 ? s + v * (0.25 + s * (7.0 / 96)) : v + v * hyst_exp(-v);
  for (int i = 0; i < 5; i++) {
    const double m = hyst_expm1(-d), e = 1 + m; /* e^-d */
    const double g = -m * d - v, dg = e * d - m, ddg = e * (2 - d);
    const double step = g * dg / (dg * dg - 0.5 * g * ddg);
    d -= step;
    if (hyst_fabs(step) < 1e-6 * d) break; /* the next error is of the order of the cube of this step */
  }
  return d;
}

HYST_RETURN_POINT(extrema, *h, x, hyst_turn_dominant(extrema, depth, *h, 0, *x0, branch, NULL), 0, *x0)
static double branch_slope(const void *none, double v, int grows) {
  (void)grows;
  const double d = branch(none, v), m = hyst_expm1(-d);
  return 1 / (d * (1 + m) - m); /* the slope is infinite at the start of a branch */
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  *t_x = hyst_turn_dominant_slope(extrema, depth, *h, 0, *s_h, branch_slope, NULL);
}
HYST_BLOCK(zhao_tan_inverse,
           (.text = "Exact inverse of the Zhao-Tan operator",
            .equation = "x = x_p + sgn(h - h_p) g^-1(|h - h_p|), g(d) = (1 - e^-d) d",
            .source = "Zhao & Tan 2008, eq. 1, solved for x; inverse by the same memory: Krejci & Kuhnen 2001",
            .family = "inverses", .inverts = "zhao_tan", .invert_condition = "memory = 'dominant'",
            .tolerance = "iteration"),
           .rate = HYST_HYSTERETIC, .init = init, .output = output, .tangent = tangent, .update = update)
