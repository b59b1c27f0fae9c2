/* Coleman-Hodgdon operator with the constant slopes that are usual for piezo actuators:
 *   y' = alpha |u'| (b u - y) + k u'.
 * It is rate-independent, so it is integrated in u.  With y = b u + w and s = sgn(u'), w obeys the linear equation
 *   dw/d(s u) = s (k - b) - alpha w,
 * so that w approaches s (k - b) / alpha by an exponential in the path of u: a step to a new input is exact, whatever
 * its length, as long as the input does not turn on the way.  Loops are counter-clockwise for b > k.  Once
 * |w| <= |k - b| / alpha, it stays so, and y increases with u if 0 < b < 2 k: then the operator has an inverse.  For
 * 0 <= b <= k it is a Bouc-Wen operator with n = 1, gamma = 0, beta = alpha; a piezo actuator has b > k.  Coleman &
 * Hodgdon, Int. J. Eng. Sci. 24 (1986) 897-919, with f(u) = b u and g(u) = k. */
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                               \
  V(alpha, PARAM, 1, "real", "1", 1.0, 1e-100, 1e100, "rate of the exponential, in 1 / input")                \
  V(b, PARAM, 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "slope of the line y = b u")                          \
  V(k, PARAM, 1, "real", "1", 0.6, -HYST_INF, HYST_INF, "slope of y on the line y = b u")                     \
  V(y0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output at u0")                                      \
  V(u0, FIXED, 1, "real", "=u", 0.0, -HYST_INF, HYST_INF, "input that belongs to y0, before the first input") \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                              \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                            \
  V(u_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "last input")                                    \
  V(w_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "y - b u at the last input")

/* w after the path du; slope: k - b */
static double after(double alpha, double slope, double w, double du) {
  const double done = -hyst_expm1(-alpha * hyst_fabs(du)); /* 0 .. 1 */
  return w * (1 - done) + hyst_copysign(done / alpha, du) * slope;
}

HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  *u_last = *u0;
  *w_last = *y0 - *b * *u0;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *y = *b * *u + after(*alpha, *k - *b, *w_last, *u - *u_last);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  *w_last = after(*alpha, *k - *b, *w_last, *u - *u_last);
  *u_last = *u;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double du = *u - *u_last, s = du > 0 || (du == 0 && *s_u > 0) ? 1 : -1;
  *t_y = (*k - s * *alpha * after(*alpha, *k - *b, *w_last, du)) * *s_u;
}
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  const double du = *u - *u_last, path = hyst_fabs(du), left = 1 + hyst_expm1(-*alpha * path), done = 1 - left;
  const double sum = hyst_copysign(done / *alpha, du), w = after(*alpha, *k - *b, *w_last, du);
  const double by_alpha =
      (du < 0 ? -1 : 1) * (path * left - done / *alpha) / *alpha * (*k - *b) - path * left * *w_last;
  for (int64_t c = 0; c < n_columns; c++) {
    const double d = s_u[c] - s_u_last[c], s = du > 0 || (du == 0 && d > 0) ? 1 : -1;
    s_w_last[c] = left * s_w_last[c] + (*k - *b - s * *alpha * w) * d;
  }
  for (const hyst_change *e = s_alpha; e < end_alpha; e++) s_w_last[e->column] += e->size * by_alpha;
  for (const hyst_change *e = s_k; e < end_k; e++) s_w_last[e->column] += e->size * sum;
  for (const hyst_change *e = s_b; e < end_b; e++) s_w_last[e->column] -= e->size * sum;
  HYST_ADVANCE(update);
  for (int64_t c = 0; c < n_columns; c++) s_u_last[c] = s_u[c], t_y[c] = *b * s_u[c] + s_w_last[c];
  for (const hyst_change *e = s_b; e < end_b; e++) t_y[e->column] += e->size * *u;
}
HYST_BLOCK(coleman_hodgdon,
           (.text = "Coleman-Hodgdon operator", .equation = "y' = alpha |u'| (b u - y) + k u'",
            .source = "Coleman & Hodgdon 1986, with f(u) = b u and g(u) = k", .family = "operators",
            .tolerance = "rounding", .sensitivity = sensitivity),
           .rate = HYST_HYSTERETIC, .init = init, .output = output, .tangent = tangent, .update = update)
