/* Inverse Zhao-Tan operator, reconstructed from the paper: the branch g(d) = (1 + e^-d) d, d = |h - h_p|, on the
 * extrema of the wanted output h.  Eq. 11 of the paper is lost; this form agrees with its figures: increasing, concave
 * for d < 2, so its loops are clockwise.  As (1 + e^-d) d = 2 d - (1 - e^-d) d it is 2 h minus the forward operator of
 * h, an approximation that a network on (h, x) corrects; the exact inverse is zhao_tan_inverse. */
#include "core/elementary/elementary.h"
#include "core/memory/return_point.h"

#define DIMS(D) D(depth, 256, 4, 100000, "maximum number of stored extrema")
#define VARS(V)                                                                                                 \
  V(x0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "initial memory: the operator rests at x = x0, h = 0") \
  V(h, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "wanted output of the operator")                        \
  V(x, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "approximate operator input, for an inverse network")  \
  V(extrema, STATE, HYST_TURNING_POINTS(depth), "real", "1", 0.0, -HYST_INF, HYST_INF, "dominant extrema of h")

static double branch(const void *none, double d) {
  (void)none;
  return d + d * hyst_exp(-d);
}

HYST_RETURN_POINT(extrema, *h, x, hyst_turn_dominant(extrema, depth, *h, 0, *x0, branch, NULL), 0, *x0)
static double branch_slope(const void *none, double d, int grows) {
  (void)none, (void)grows;
  return 1 + (1 - d) * hyst_exp(-d);
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  *t_x = hyst_turn_dominant_slope(extrema, depth, *h, 0, *s_h, branch_slope, NULL);
}
HYST_BLOCK(zhao_tan_inverse_reconstructed,
           (.text = "Inverse Zhao-Tan operator, reconstructed from the paper",
            .equation = "x = x_p + sgn(h - h_p) (1 + e^-d) d, d = |h - h_p|; virgin branch by Masing",
            .source = "Zhao & Tan 2008, eq. 11 (lost; reconstructed)", .family = "inverses", .tolerance = "rounding"),
           .rate = HYST_HYSTERETIC, .init = init, .output = output, .tangent = tangent, .update = update)
