/* Krasnosel'skii-Pokrovskii operator: a weighted sum of kernels between two ramps, r(x) = -1 for x < 0, +1 for x > a,
 * straight between.  A kernel rises along r(u - p2) and falls along r(u - p1), p1 <= p2:
 *   k = max(k_last, r(u - p2)) for rising u, k = min(k_last, r(u - p1)) for falling u.
 * p1 <= p2 are the points lo, lo + a, .., hi - a of an even grid: 210 = 20 * 21 / 2 kernels are the reference model of
 * Zhao & Tan 2008, section V.  A kernel is a line of relays from (alpha, beta) = (p2, p1) to (p2 + a, p1 + a).  So the
 * sum is a Preisach operator whose Everett function is linear on the triangles of the grid, with the sum of the weights
 * of all kernels between beta and alpha at its nodes (everett.h): a step does not depend on the number of kernels.
 *
 * Before the first reversal each kernel has the value of the middle of its ramps at u0, as after ever smaller loops
 * around u0.  Then a rise to u moves the kernels with p2 - p1 < 2 (u - u0), which adds a kink in every half step. */
#include "core/elementary/limit.h"
#include "core/hyst.h"
#include "core/memory/everett.h"
#include "core/memory/return_point.h"

#define DIMS(D)                                                           \
  D(n, 4, 1, 1000, "number of grid points; there are n(n + 1)/2 kernels") \
  D(depth, 256, 4, 100000, "maximum number of stored extrema")
#define VARS(V)                                                                                                 \
  V(lo, FIXED, 1, "real", "=u", -1.0, -HYST_INF, HYST_INF, "input at which the lowest ramp leaves -1")          \
  V(hi, FIXED, 1, "real", "=u", 1.0, -HYST_INF, HYST_INF, "input at which the highest ramp reaches 1")          \
  V(w, FIXED, n *(n + 1) / 2, "real", "1", 0.1, -HYST_INF, HYST_INF,                                            \
    "weights of the kernels (p2, p1) = (0, 0), (1, 0), (1, 1), (2, 0), .., (n - 1, n - 1) in steps from lo")    \
  V(offset, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "constant term of the output")                     \
  V(u0, FIXED, 1, "real", "=u", 0.0, -HYST_INF, HYST_INF, "initial kernels: the mean of their two ramps at u0") \
  V(E, DERIVED, n *(n + 1) / 2, "real", "1", 0.0, -HYST_INF, HYST_INF, "Everett function at the nodes")         \
  V(virgin, DERIVED, 6 * n, "real", "1", 0.0, -HYST_INF, HYST_INF, "first branch: values and slopes")           \
  V(kink, DERIVED, 1, "real", "1", 0.0, 0.0, 1.0, "first kink of the first branch in a cell")                   \
  V(origin, DERIVED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "u0, limited to [lo, hi]")                       \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                                \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                              \
  V(memory, STATE, HYST_TURNING_POINTS(depth), "real", "1", 0.0, -HYST_INF, HYST_INF, "dominant extrema of u")

typedef struct {
  hyst_everett grid;
  const double *virgin;
  double kink;
} law;

static law law_of(const double *E, const double *virgin, double kink, int n, double lo, double hi) {
  const law l = {{E, n, lo, hi}, virgin, kink};
  return l;
}

/* a cell has three pieces: up to `kink`, half a step further, and the rest */
static double first_branch(const void *ctx, double u) {
  const law *l = (const law *)ctx;
  double rest;
  const int i = hyst_everett_cell(&l->grid, u, l->grid.n, &rest);
  const double *piece = l->virgin + 6 * i + 2 * ((rest >= l->kink) + (rest >= l->kink + 0.5));
  return piece[0] + piece[1] * rest;
}

static double first_slope(const void *ctx, double u, double seed) {
  const law *l = (const law *)ctx;
  double rest;
  const int i = hyst_everett_cell_toward(&l->grid, u, l->grid.n, seed, &rest), up = seed > 0;
  const double later = l->kink + 0.5;
  const int k = (rest > l->kink || (up && rest == l->kink)) + (rest > later || (up && rest == later));
  return seed * l->virgin[6 * i + 2 * k + 1] * (l->grid.n / (l->grid.hi - l->grid.lo));
}

static hyst_turn turn(law l, const double *memory, int depth, double u, double origin) {
  return hyst_everett_turn(&l.grid, memory, depth, u, origin, first_branch, &l);
}

/* the weights of the kernels (i, first .. last) for along = 0, of (first .. last, i) for along = 1 */
static double weights(const double *w, int along, int i, int first, int last) {
  double sum = 0;
  for (int k = first; k <= last; k++) {
    const ptrdiff_t row = along ? k : i, column = along ? i : k;
    sum += w[row * (row + 1) / 2 + column];
  }
  return sum;
}

static int within(int i, int least, int most) { return i < least ? least : i > most ? most : i; }

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  if (!(*lo < *hi)) return "lo must be less than hi";
  double all = *offset;
  for (int i = 1; i <= n; i++) { /* E(i, j): kernels with p2 < i and p1 >= j */
    double row = 0, *now = E + (ptrdiff_t)i * (i - 1) / 2;
    for (int j = i - 1; j >= 0; j--) {
      row += w[(ptrdiff_t)i * (i - 1) / 2 + j];
      now[j] = row + (j < i - 1 ? now[j - (i - 1)] : 0);
    }
    all += row;
  }
  *origin = hyst_clamp(*u0, *lo, *hi);
  const double middle = (*origin - *lo) / (*hi - *lo) * (2 * n); /* p1 + p2 of the kernels in the middle, in steps */
  const int whole = middle >= 2 * n ? 2 * n : (int)middle;
  *kink = 0.5 * (middle - whole);
  double end = all; /* from the right end, where all kernels are 1 */
  for (int i = n - 1; i >= 0; i--)
    for (int k = 2; k >= 0; k--) {
      const double from = k == 0 ? 0 : *kink + 0.5 * (k - 1), to = k == 2 ? 1 : *kink + 0.5 * k;
      const int rises = 2 * i + k > whole; /* this piece is above u0 */
      const double slope = 2 * (rises ? weights(w, 0, i, within(whole - i + 1 - k, 0, n), i)
                                      : weights(w, 1, i, i, within(whole - i - k, -1, n - 1)));
      double *piece = virgin + 6 * i + 2 * k;
      piece[1] = slope;
      piece[0] = end - slope * to;
      end -= slope * (to - from);
    }
  return NULL;
}
static double at_origin(const double *E, const double *virgin, double kink, int n, double lo, double hi,
                        double origin) {
  const law l = law_of(E, virgin, kink, n, lo, hi);
  return first_branch(&l, origin);
}
HYST_RETURN_POINT(memory, hyst_clamp(*u, *lo, *hi), y,
                  turn(law_of(E, virgin, *kink, n, *lo, *hi), memory, depth, hyst_clamp(*u, *lo, *hi), *origin),
                  *origin, at_origin(E, virgin, *kink, n, *lo, *hi, *origin))
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const law l = law_of(E, virgin, *kink, n, *lo, *hi);
  const double seed = hyst_clamp_tangent(*u, *lo, *hi, *s_u), at = hyst_clamp(*u, *lo, *hi);
  *t_y = seed == 0 ? 0 : hyst_everett_turn_tangent(&l.grid, memory, depth, at, *origin, seed, first_slope, &l);
}
HYST_BLOCK(krasnoselskii_pokrovskii,
           (.text = "Krasnosel'skii-Pokrovskii operator: weighted kernels between two ramps",
            .equation = "k = max(k, r(u - p2)) rising, min(k, r(u - p1)) falling, y = offset + sum_i w_i k_i",
            .source = "Krasnosel'skii & Pokrovskii 1989, ch. 2; ridge function of Webb, Lagoudas & Kurdila 1998",
            .family = "operators", .tolerance = "rounding"),
           .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
