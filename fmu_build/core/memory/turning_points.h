/* turning_points.h - the turning-point machine, shared by all operators with return-point memory (Madelung,
 * wiping-out).
 *
 * The memory is the list of dominant extrema of the input, outermost first, with the output at each.  From the last
 * one, (x_p, h_p), the output follows a branch  h = h_p + sgn(x - x_p) g(|x - x_p|).  When x passes an older extremum,
 * the loop closes: the pair is wiped out and the older branch continues.  Before the first reversal the virgin branch
 * follows Masing's rule,  h = h0 + sgn(x - x0) g(2 |x - x0|) / 2.  Zhao-Tan, Ma, Prandtl-Ishlinskii, their inverses and
 * Preisach differ only in g.  A step costs one evaluation of g, whatever the number of elementary operators.
 *
 * The last input follows the stored extrema in the list; a reversal makes it an extremum by increasing the count.
 *
 * The list has room for `depth` extrema (at least 4).  When it is full, the smallest stored loop is dropped as if it
 * had closed (it is the last pair, because dominant extrema are nested), and the newest extremum, the start of the
 * current branch, takes its place.  The error is bounded by that loop; the outermost extrema stay.
 *
 * Trap: with the last extremum instead of this list the operator is unbounded under noise and nested loops (Zhao & Tan
 * 2008 say "dominant").  hyst_turn_last() exists for literal replicas only. */
#ifndef HYST_TURNING_POINTS_H
#define HYST_TURNING_POINTS_H
#include "core/elementary/elementary.h"
#include "core/hyst.h"
#include "core/memory/stored.h"

/* The memory is one row of a block's table, V(memory, STATE, HYST_TURNING_POINTS(depth), ...): */
#define HYST_TURNING_POINTS(depth) (6 + 2 * (depth))
enum { HYST_TP_COUNT, HYST_TP_DIRECTION, HYST_TP_X, HYST_TP_H, HYST_TP_LIST };

typedef double (*hyst_branch)(const void *g, double d); /* g(d), d >= 0, g(0) = 0, increasing */

/* The branch of a new input x, found without changing the memory. */
typedef struct {
  double direction, h;
  int count; /* number of extrema; the branch starts from the newest one, or from the origin */
} hyst_turn;

/* Wiping-out: direction and count of the branch to x among dominant extrema, without the output.  m: the memory row;
 * x0: origin of the virgin branch.  Only the loop has a conditional jump that depends on reversals, because reversals
 * of a measured signal are unpredictable. */
static inline hyst_turn hyst_turn_wipe_out(const double *m, int depth, double x, double x0) {
  const double *xs = m + HYST_TP_LIST;
  hyst_turn t = {m[HYST_TP_DIRECTION], m[HYST_TP_H], hyst_stored(m[HYST_TP_COUNT], depth)};
  if (x == m[HYST_TP_X]) return t; /* a plateau is no reversal */
  const double s = hyst_copysign(1, x - m[HYST_TP_X]);
  int n = t.count + (t.direction * s < 0); /* after a reversal the last input, already in the list, is an extremum */
  while (n >= 2 && s * x >= s * xs[n - 2]) n -= 2; /* x passed the extremum before the newest one */
  /* the outermost extremum closes on the opposite virgin branch */
  if (n == 1 && (x - x0) * s >= (x0 - xs[0]) * s) n = 0;
  t.direction = s;
  t.count = n;
  return t;
}

/* Dominant extrema.  h0: output at the origin of the virgin branch. */
static inline hyst_turn hyst_turn_dominant(const double *m, int depth, double x, double x0, double h0, hyst_branch g,
                                           const void *ctx) {
  const double *xs = m + HYST_TP_LIST, *hs = xs + depth + 1;
  hyst_turn t = hyst_turn_wipe_out(m, depth, x, x0);
  if (x == m[HYST_TP_X]) return t;
  const double s = t.direction;
  const int n = t.count;
  if (n > 0) t.h = hs[n - 1] + s * g(ctx, s * (x - xs[n - 1]));
  else t.h = x >= x0 ? h0 + 0.5 * g(ctx, 2 * (x - x0)) : h0 - 0.5 * g(ctx, 2 * (x0 - x));
  return t;
}

/* Uses the last extremum only, passed or not, without a virgin rule: the literal reading, for replicas.  Older extrema
 * stay in the list without effect. */
static inline hyst_turn hyst_turn_last(const double *m, int depth, double x, double x0, double h0, hyst_branch g,
                                       const void *ctx) {
  const double *xs = m + HYST_TP_LIST, *hs = xs + depth + 1;
  hyst_turn t = {m[HYST_TP_DIRECTION], m[HYST_TP_H], hyst_stored(m[HYST_TP_COUNT], depth)};
  if (x == m[HYST_TP_X]) return t;
  const double s = hyst_copysign(1, x - m[HYST_TP_X]);
  if (t.direction * s < 0) t.count++;
  const double x_p = t.count > 0 ? xs[t.count - 1] : x0, h_p = t.count > 0 ? hs[t.count - 1] : h0;
  t.h = x >= x_p ? h_p + g(ctx, x - x_p) : h_p - g(ctx, x_p - x);
  t.direction = s;
  return t;
}

/* ---- slopes, for directional derivatives ------------------------------------------------------------------------ */
typedef double (*hyst_branch_slope)(const void *g, double d, int grows); /* g'(d) for increasing or decreasing d */

/* Direction and count as in hyst_turn_wipe_out(), for an input that continues from x in the direction of the seed,
 * which decides if x is an extremum, and if a loop that closes at x is wiped out. */
static inline hyst_turn hyst_turn_toward(const double *m, int depth, double x, double x0, double seed) {
  const double *xs = m + HYST_TP_LIST;
  const double s = hyst_copysign(1, x == m[HYST_TP_X] ? seed : x - m[HYST_TP_X]);
  const int onward = s * seed > 0;
  int n = hyst_stored(m[HYST_TP_COUNT], depth) + (m[HYST_TP_DIRECTION] * s < 0);
  while (n >= 2 && (s * x > s * xs[n - 2] || (onward && x == xs[n - 2]))) n -= 2;
  if (n == 1 && ((x - x0) * s > (x0 - xs[0]) * s || (onward && x - x0 == x0 - xs[0]))) n = 0;
  const hyst_turn t = {s, m[HYST_TP_H], n};
  return t;
}

/* tangent of the output for the seed of the input: slope of a branch from `origin`, scaled by two if virgin */
static inline double hyst_turn_slope_from(double origin, int virgin, double x, double seed, hyst_branch_slope slope,
                                          const void *ctx) {
  const double d = hyst_fabs(x - origin);
  return seed * slope(ctx, virgin ? 2 * d : d, d == 0 || (x - origin) * seed > 0);
}

static inline double hyst_turn_dominant_slope(const double *m, int depth, double x, double x0, double seed,
                                              hyst_branch_slope slope, const void *ctx) {
  if (seed == 0) return 0;
  const int n = hyst_turn_toward(m, depth, x, x0, seed).count;
  return hyst_turn_slope_from(n > 0 ? m[HYST_TP_LIST + n - 1] : x0, n == 0, x, seed, slope, ctx);
}

static inline double hyst_turn_last_slope(const double *m, int depth, double x, double x0, double seed,
                                          hyst_branch_slope slope, const void *ctx) {
  if (seed == 0) return 0;
  const double s = x == m[HYST_TP_X] ? seed : x - m[HYST_TP_X];
  const int n = hyst_stored(m[HYST_TP_COUNT], depth) + (m[HYST_TP_DIRECTION] * s < 0);
  return hyst_turn_slope_from(n > 0 ? m[HYST_TP_LIST + n - 1] : x0, 0, x, seed, slope, ctx);
}

/* Selected by a row V(memory, FIXED, 1, "dominant|last", ...) of the table. */
enum { HYST_DOMINANT, HYST_LAST };
static inline hyst_turn hyst_turn_chosen(double memory, const double *m, int depth, double x, double x0, double h0,
                                         hyst_branch g, const void *ctx) {
  return memory == (double)HYST_LAST ? hyst_turn_last(m, depth, x, x0, h0, g, ctx)
                                     : hyst_turn_dominant(m, depth, x, x0, h0, g, ctx);
}

static inline double hyst_turn_chosen_slope(double memory, const double *m, int depth, double x, double x0, double seed,
                                            hyst_branch_slope slope, const void *ctx) {
  return memory == (double)HYST_LAST ? hyst_turn_last_slope(m, depth, x, x0, seed, slope, ctx)
                                     : hyst_turn_dominant_slope(m, depth, x, x0, seed, slope, ctx);
}

/* Stores the result of hyst_turn_...() in the memory. */
static inline void hyst_tp_commit(double *m, int depth, double x, hyst_turn t) {
  double *xs = m + HYST_TP_LIST, *hs = xs + depth + 1;
  if (t.count > depth) { /* if the list is full, the newest extremum replaces the smallest stored loop */
    t.count = depth - 1;
    xs[depth - 2] = xs[depth];
    hs[depth - 2] = hs[depth];
  }
  m[HYST_TP_COUNT] = t.count;
  m[HYST_TP_DIRECTION] = t.direction;
  m[HYST_TP_X] = xs[t.count] = x;
  m[HYST_TP_H] = hs[t.count] = t.h;
}

static inline void hyst_tp_init(double *m, int depth, double x0, double h0) {
  for (int i = 0; i < HYST_TURNING_POINTS(depth); i++) m[i] = 0;
  const hyst_turn rest = {0, h0, 0};
  hyst_tp_commit(m, depth, x0, rest);
}
#endif
