/* Implicit inverse: the u for which the model between u and h has the wanted output, h = y.
 * Connect u to the input of a model and its output to h; no second model and no training are needed.  The graph tries
 * values of u on the model (pure output() calls, so its memory stays) before the model takes the root: see
 * core/graph/implicit.h, and core/elementary/root.h for outputs out of range or not monotone.  The model must be
 * static: operators with memory and functions.  Without a model, h is constant and u goes to a bound. */
#include "core/elementary/limit.h"
#include "core/elementary/root.h"
#include "core/hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                                   \
  V(lo, PARAM, 1, "real", "1", -1.0, -1e300, 1e300, "lower limit of u")                                           \
  V(hi, PARAM, 1, "real", "1", 1.0, -1e300, 1e300, "upper limit of u")                                            \
  V(y, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "wanted output")                                          \
  V(h, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "model output")                                           \
  V(u, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "model input")                                           \
  V(u_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "last root")                                         \
  V(asked, STATE, 4, "real", "1", 0.0, -HYST_INF, HYST_INF, "y, lo, hi of the last root, and h - y at this root") \
  V(before, STATE, 2, "real", "1", 0.0, -HYST_INF, HYST_INF, "previous root, and h at this root")

static double constant(void *off, double u) {
  (void)u;
  return *(const double *)off;
}
static double alone(double off, double lo, double hi, double last) {
  const hyst_tried at = {hyst_clamp(last, lo, hi), off};
  double at_root;
  return hyst_root(constant, &off, lo, hi, at, at, &at_root);
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  return *lo < *hi ? NULL : "lo must be less than hi";
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *u = alone(*h - *y, *lo, *hi, *u_last);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  *u_last = alone(*h - *y, *lo, *hi, *u_last);
}
HYST_BLOCK(implicit_inverse,
           (.text = "Implicit inverse: the input at which a static model has the wanted output",
            .equation = "u in [lo, hi] such that h(u) = y, h the output of the model between u and h",
            .source = "bracketed root finding: Chandrupatla 1997", .family = "inverses", .tolerance = "iteration"),
           .rate = HYST_HYSTERETIC, .trial = 2, .prepare = prepare, .output = output, .update = update)
