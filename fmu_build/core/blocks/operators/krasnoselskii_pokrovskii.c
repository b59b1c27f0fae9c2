/* Krasnosel'skii-Pokrovskii operator: a weighted sum of kernels between two ramps, r(x) = -1 for x < 0, +1 for x > a,
 * straight between.  A kernel rises along r(u - p2) and falls along r(u - p1), p1 <= p2:
 *   k = max(k_last, r(u - p2)) for rising u, k = min(k_last, r(u - p1)) for falling u.
 * Since r(u - p2) <= r(u - p1), this limits k_last to the interval between the two for either direction of u: a
 * generalised play.
 * Unlike a play a kernel saturates, and p1 != -p2 makes it asymmetric. 210 = 20 * 21 / 2 kernels on the triangle p1 <=
 * p2 of a grid of 20 are the reference model of Zhao & Tan 2008, section V. */
#include "core/elementary/limit.h"
#include "core/hyst.h"

#define DIMS(D) D(n, 10, 1, 100000, "number of kernels")
#define VARS(V)                                                                                                   \
  V(a, PARAM, 1, "real", "1", 4.0, 1e-300, HYST_INF, "rise length of the ridge function")                         \
  V(p1, PARAM, n, "real", "1", -2.25, -HYST_INF, HYST_INF, "inputs at which the falling ramps reach -1")          \
  V(p2, PARAM, n, "real", "1", -1.75, -HYST_INF, HYST_INF, "inputs at which the rising ramps leave -1; p1 <= p2") \
  V(w, PARAM, n, "real", "1", 0.1, -HYST_INF, HYST_INF, "weights of the kernels")                                 \
  V(offset, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output for cancelling kernels")                     \
  V(k0, FIXED, n, "real", "1", 0.0, -1.0, 1.0, "values of the kernels before the first input")                    \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                                  \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                                \
  V(k, STATE, n, "real", "1", 0.0, -1.0, 1.0, "kernels")

static double ridge(double x, double slope) { return hyst_clamp(x * slope - 1, -1, 1); }

/* k is within -1 and +1, so that only one bound of each ramp matters.  The other two would cost half of the time,
 * because compilers use conditional jumps to limit a value between constants. */
static double kernel(double k, double u, double p1, double p2, double slope) {
  const double rising = (u - p2) * slope - 1, falling = (u - p1) * slope - 1;
  return hyst_clamp(k, rising > 1 ? 1 : rising, falling < -1 ? -1 : falling);
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  for (int i = 0; i < n; i++)
    if (p1[i] > p2[i]) return "p1 must not be greater than p2: a kernel falls to the left of its rise";
  return NULL;
}
HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  for (int i = 0; i < n; i++) k[i] = k0[i];
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const double slope = 2 / *a;
  double sum = *offset;
  for (int i = 0; i < n; i++) sum += w[i] * kernel(k[i], *u, p1[i], p2[i], slope);
  *y = sum;
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const double slope = 2 / *a;
  for (int i = 0; i < n; i++) k[i] = kernel(k[i], *u, p1[i], p2[i], slope);
}
static double ridge_tangent(double x, double slope, double seed) {
  return slope * hyst_clamp_tangent(x * slope - 1, -1, 1, seed);
}

/* a kernel is constant between its ramps and follows a ramp in one direction */
static double kernel_tangent(double k, double u, double p1, double p2, double slope, double seed) {
  const double low = ridge(u - p2, slope), high = ridge(u - p1, slope);
  const double d_low = ridge_tangent(u - p2, slope, seed), d_high = ridge_tangent(u - p1, slope, seed);
  if (k < low || (k == low && d_low > 0)) return d_low;
  if (k > high || (k == high && d_high < 0)) return d_high;
  return 0;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double slope = 2 / *a;
  double sum = 0;
  for (int i = 0; i < n; i++) sum += w[i] * kernel_tangent(k[i], *u, p1[i], p2[i], slope, *s_u);
  *t_y = sum;
}
HYST_BLOCK(krasnoselskii_pokrovskii,
           (.text = "Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps",
            .equation = "k = max(k, r(u - p2)) rising, min(k, r(u - p1)) falling, y = offset + sum_i w_i k_i",
            .source = "Krasnosel'skii & Pokrovskii 1989, ch. 2; ridge function of Webb, Lagoudas & Kurdila 1998",
            .family = "operators", .tolerance = "rounding"),
           .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
