/* Preisach operator in Everett's form on a grid over [lo, hi], see everett.h.  E is the integral of the relay density
 * over the triangle between alpha and beta; a Prandtl-Ishlinskii operator with thresholds on half steps, E = phi((alpha
 * - beta) / 2), is represented exactly.  Outside [lo, hi] nothing switches.
 *
 * Before the first reversal: low and high, from saturation, along E(u, lo) or E(hi, u).  demagnetised, from the middle
 * of the range after ever smaller loops: then a rise to u switches the relays between the diagonal and the line
 * alpha + beta = lo + hi, so its slope is 2 dE/dalpha on that line. */
#include "core/elementary/limit.h"
#include "core/hyst.h"
#include "core/memory/everett.h"
#include "core/memory/return_point.h"

#define DIMS(D)                                          \
  D(n, 2, 1, 1000, "number of grid steps over [lo, hi]") \
  D(depth, 256, 4, 100000, "maximum number of stored extrema")
#define VARS(V)                                                                                                   \
  V(lo, FIXED, 1, "real", "=u", -4.0, -HYST_INF, HYST_INF, "input of negative saturation")                        \
  V(hi, FIXED, 1, "real", "=u", 4.0, -HYST_INF, HYST_INF, "input of positive saturation")                         \
  V(E, FIXED, n *(n + 1) / 2, "real", "1", 1.0, -HYST_INF, HYST_INF,                                              \
    "Everett function at (alpha_1, beta_0), (alpha_2, beta_0), (alpha_2, beta_1), .., (alpha_n, beta_(n-1))")     \
  V(offset, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "mean of the two saturated outputs")                 \
  V(start, FIXED, 1, "demagnetised|low|high", "1", 0, 0, 2, "initial memory")                                     \
  V(virgin, DERIVED, 2 * n + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "first branch, at half steps of the grid") \
  V(origin, DERIVED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input at the start of the first branch")          \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                                  \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                                \
  V(memory, STATE, HYST_TURNING_POINTS(depth), "real", "1", 0.0, -HYST_INF, HYST_INF, "dominant extrema of u")

enum { DEMAGNETISED, LOW, HIGH };

typedef struct {
  hyst_everett grid;
  const double *virgin;
} law;

static law law_of(const double *E, const double *virgin, int n, double lo, double hi) {
  const law l = {{E, n, lo, hi}, virgin};
  return l;
}

static double at_node(const law *l, int i, int j) { return hyst_everett_node(&l->grid, i, j); }

static double first_branch(const void *ctx, double u) {
  const law *l = (const law *)ctx;
  double rest;
  const int k = hyst_everett_cell(&l->grid, u, 2 * l->grid.n, &rest);
  return l->virgin[k] + rest * (l->virgin[k + 1] - l->virgin[k]);
}

static hyst_turn turn(law l, const double *memory, int depth, double u, double origin) {
  return hyst_everett_turn(&l.grid, memory, depth, u, origin, first_branch, &l);
}

/* From the middle: 2 dE/dalpha upwards, -2 dE/dbeta downwards, for each half step on alpha + beta = lo + hi.  That line
 * crosses the squares of the grid diagonally and changes triangle in the middle of each. */
static void fill_demagnetised(const law *l, double *virgin, double offset) {
  const int n = l->grid.n;
  virgin[n] = 0;
  for (int k = n; k < 2 * n; k++) {
    const int i = k / 2, j = n - 1 - i, beyond = k % 2;
    virgin[k + 1] = virgin[k] + (beyond ? at_node(l, i + 1, j) - at_node(l, i, j)
                                        : at_node(l, i + 1, j + 1) - at_node(l, i, j + 1));
  }
  for (int k = n; k > 0; k--) {
    const int j = (k - 1) / 2, i = n - 1 - j, beyond = (k - 1) % 2;
    virgin[k - 1] = virgin[k] + (beyond ? at_node(l, i, j + 1) - at_node(l, i, j)
                                        : at_node(l, i + 1, j + 1) - at_node(l, i + 1, j));
  }
  const double rest = offset + at_node(l, n, 0) - virgin[2 * n]; /* the first branch ends at saturation */
  for (int k = 0; k <= 2 * n; k++) virgin[k] += rest;
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  if (!(*lo < *hi)) return "lo must be less than hi";
  const law l = law_of(E, virgin, n, *lo, *hi);
  *origin = *start == (double)LOW ? *lo : *start == (double)HIGH ? *hi : 0.5 * *lo + 0.5 * *hi;
  if (*start == (double)DEMAGNETISED) {
    fill_demagnetised(&l, virgin, *offset);
    return NULL;
  }
  for (int k = 0; k <= 2 * n; k++) { /* between two nodes E(u, lo) and E(hi, u) are linear */
    const int i = k / 2, next = (k + 1) / 2;
    virgin[k] = *start == (double)LOW ? *offset - at_node(&l, n, 0) + at_node(&l, i, 0) + at_node(&l, next, 0)
                                      : *offset + at_node(&l, n, 0) - at_node(&l, n, i) - at_node(&l, n, next);
  }
  return NULL;
}
HYST_RETURN_POINT(memory, hyst_clamp(*u, *lo, *hi), y,
                  turn(law_of(E, virgin, n, *lo, *hi), memory, depth, hyst_clamp(*u, *lo, *hi), *origin), *origin,
                  virgin[*start == (double)LOW    ? 0
                         : *start == (double)HIGH ? 2 * n
                                                  : n])
static double first_slope(const void *ctx, double u, double seed) {
  const law *l = (const law *)ctx;
  const int n = l->grid.n;
  double rest;
  const int k = hyst_everett_cell_toward(&l->grid, u, 2 * n, seed, &rest);
  return seed * (l->virgin[k + 1] - l->virgin[k]) * (2 * n / (l->grid.hi - l->grid.lo));
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const law l = law_of(E, virgin, n, *lo, *hi);
  const double seed = hyst_clamp_tangent(*u, *lo, *hi, *s_u), at = hyst_clamp(*u, *lo, *hi);
  *t_y = seed == 0 ? 0 : hyst_everett_turn_tangent(&l.grid, memory, depth, at, *origin, seed, first_slope, &l);
}
HYST_BLOCK(preisach,
           (.text = "Preisach operator in Everett's form",
            .equation = "y = y_p - 2 E(u_p, u) falling, y_p + 2 E(u, u_p) rising, E linear between its grid values",
            .source = "Mayergoyz, Mathematical Models of Hysteresis 1991, ch. 1; Everett 1955", .family = "operators",
            .tolerance = "rounding"),
           .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
