/* everett.h - branches of a Preisach operator: from an extremum (u_p, y_p) a falling branch is y = y_p - 2 E(u_p, u), a
 * rising one y = y_p + 2 E(u, u_p).  E(alpha, beta), alpha >= beta, is half the height of the loop between beta and
 * alpha (Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1): the turning-point machine with branches that
 * depend on their start, not only on their length.
 *
 * E is given at the nodes of an even grid of n steps over [lo, hi], 0 on the diagonal, and linear on triangles, each
 * square cut parallel to the diagonal. */
#ifndef HYST_EVERETT_H
#define HYST_EVERETT_H
#include "core/hyst.h"
#include "core/memory/turning_points.h"

typedef double (*hyst_first_branch)(const void *first, double u); /* output before the first reversal */

typedef struct {
  const double *E; /* (alpha_1, beta_0), (alpha_2, beta_0), (alpha_2, beta_1), .., (alpha_n, beta_(n-1)) */
  int n;
  double lo, hi;
} hyst_everett;

static inline double hyst_everett_node(const hyst_everett *l, int i, int j) {
  return i > j ? l->E[(ptrdiff_t)i * (i - 1) / 2 + j] : 0; /* alpha_i, beta_j */
}

/* (x - lo) in steps, divided into an integer 0..steps - 1 and a rest; x may come from an untrusted memory */
static inline int hyst_everett_cell(const hyst_everett *l, double x, int steps, double *rest) {
  const double place = (x - l->lo) / (l->hi - l->lo) * steps;
  const int i = place >= steps ? steps - 1 : place >= 0 ? (int)place : 0;
  *rest = place - i;
  return i;
}

static inline double hyst_everett_at(const hyst_everett *l, double alpha, double beta) {
  double a, b;
  const int i = hyst_everett_cell(l, alpha, l->n, &a), j = hyst_everett_cell(l, beta, l->n, &b);
  const double far = hyst_everett_node(l, i, j), near = hyst_everett_node(l, i + 1, j + 1);
  if (a >= b) return far + a * (hyst_everett_node(l, i + 1, j) - far) + b * (near - hyst_everett_node(l, i + 1, j));
  return far + b * (hyst_everett_node(l, i, j + 1) - far) + a * (near - hyst_everett_node(l, i, j + 1));
}

/* the branch to u, which is within [lo, hi] */
static inline hyst_turn hyst_everett_turn(const hyst_everett *l, const double *memory, int depth, double u,
                                          double origin, hyst_first_branch first, const void *ctx) {
  hyst_turn t = hyst_turn_wipe_out(memory, depth, u, origin);
  if (u == memory[HYST_TP_X]) return t;
  const double *last = memory + HYST_TP_LIST + t.count - 1; /* the extremum; its output is depth + 1 elements later */
  if (t.count == 0) t.h = first(ctx, u);
  else if (t.direction > 0) t.h = last[depth + 1] + 2 * hyst_everett_at(l, u, *last);
  else t.h = last[depth + 1] - 2 * hyst_everett_at(l, *last, u);
  return t;
}

/* returns the cell that x enters in the direction of the seed */
static inline int hyst_everett_cell_toward(const hyst_everett *l, double x, int steps, double seed, double *rest) {
  const int i = hyst_everett_cell(l, x, steps, rest);
  if (*rest > 0 || seed > 0 || i == 0) return i;
  *rest = 1;
  return i - 1;
}

/* dE for changes da of alpha or db of beta, one of them 0 */
static inline double hyst_everett_tangent(const hyst_everett *l, double alpha, double beta, double da, double db) {
  double a, b;
  const int i = hyst_everett_cell_toward(l, alpha, l->n, da, &a), j = hyst_everett_cell_toward(l, beta, l->n, db, &b);
  const double far = hyst_everett_node(l, i, j), near = hyst_everett_node(l, i + 1, j + 1);
  const double right = hyst_everett_node(l, i + 1, j), above = hyst_everett_node(l, i, j + 1);
  const double steps = l->n / (l->hi - l->lo);
  if (a > b || (a == b && da >= db)) return steps * (da * (right - far) + db * (near - right));
  return steps * (db * (above - far) + da * (near - above));
}

/* tangent of the output; slope: of the first branch, dy for the seed */
typedef double (*hyst_first_slope)(const void *first, double u, double seed);
static inline double hyst_everett_turn_tangent(const hyst_everett *l, const double *memory, int depth, double u,
                                               double origin, double seed, hyst_first_slope slope, const void *ctx) {
  const hyst_turn t = hyst_turn_toward(memory, depth, u, origin, seed);
  if (t.count == 0) return slope(ctx, u, seed);
  const double last = memory[HYST_TP_LIST + t.count - 1];
  return t.direction > 0 ? 2 * hyst_everett_tangent(l, u, last, seed, 0)
                         : -2 * hyst_everett_tangent(l, last, u, 0, seed);
}
#endif
