/* turning_points.h - the one machine behind every operator with return-point (Madelung, "wiping-out") memory.
 *
 * The memory is the list of dominant extrema of the input, outermost first, and the output at each.  From the last one,
 * (x_p, h_p), the output follows a branch  h = h_p + sgn(x - x_p) g(|x - x_p|).  When x passes an older extremum, that
 * loop is closed: the pair is wiped out and the older branch goes on.  Before the first reversal the virgin branch of
 * Masing's rule holds,  h = h0 + sgn(x - x0) g(2 |x - x0|) / 2.  Zhao-Tan, Ma, Prandtl-Ishlinskii, their inverses and
 * Preisach differ in g alone.  Cost per step: one evaluation of g, whatever the number of elementary operators.
 *
 * The list has room for `depth` extrema (at least 4).  When it is full, the smallest stored loop - dominant extrema are
 * nested, so it is the last pair - is forgotten as if it had closed, and the newest extremum, from which the current
 * branch starts, takes its place.  What is lost is bounded by that loop; the outermost extrema stay.
 *
 * Trap: "last extremum" memory instead of this list leaves the operator unbounded (../shared science notes; Zhao & Tan
 * 2008 say "dominant").  It exists as hyst_turn_last() for literal replicas only. */
#ifndef HYST_TURNING_POINTS_H
#define HYST_TURNING_POINTS_H
#include "hyst.h"

/* The memory is one row of a block's table, V(memory, STATE, HYST_TURNING_POINTS(depth), ...): */
#define HYST_TURNING_POINTS(depth) (4 + 2 * (depth))
enum { HYST_TP_COUNT, HYST_TP_DIRECTION, HYST_TP_X, HYST_TP_H, HYST_TP_LIST };

typedef double (*hyst_branch)(const void *g, double d); /* g(d), d >= 0, g(0) = 0, increasing */

/* Where a new input x finds its branch, without touching the memory: the extremum (top_x, top_h) that the branch starts
 * from, which is the newest of `count`.  On the virgin branch count = 0 and top is not used. */
typedef struct {
  double direction, h, top_x, top_h;
  int count;
} hyst_turn;

/* Dominant extrema.  m: the memory row, x0 and h0: origin of the virgin branch.
 * Reversals of a measured signal are unpredictable, so the way through here has one branch that depends on them. */
static inline hyst_turn hyst_turn_dominant(const double *m, int depth, double x, double x0, double h0, hyst_branch g,
                                           const void *ctx) {
  const double *xs = m + HYST_TP_LIST, *hs = xs + depth;
  const double last = m[HYST_TP_X];
  hyst_turn t = {m[HYST_TP_DIRECTION], m[HYST_TP_H], 0, 0, (int)m[HYST_TP_COUNT]};
  if (x == last) return t; /* a plateau is not a reversal */
  const int stored = t.count;
  const double s = x > last ? 1 : -1;
  int n = stored + (t.direction * s < 0);          /* after a reversal the last input is the newest extremum */
  while (n >= 2 && s * x >= s * xs[n - 2]) n -= 2; /* wiping-out: x passed the extremum before the newest one */
  if (n > 0) {
    t.top_x = n > stored ? last : xs[n - 1];
    t.top_h = n > stored ? t.h : hs[n - 1];
    t.h = t.top_h + s * g(ctx, s * (x - t.top_x));
  }
  /* the outermost extremum closes on the virgin branch of the other side */
  if (n == 1 && (x - x0) * s >= (t.top_x - x0) * -s) n = 0;
  if (n == 0) t.h = x >= x0 ? h0 + 0.5 * g(ctx, 2 * (x - x0)) : h0 - 0.5 * g(ctx, 2 * (x0 - x));
  t.direction = s;
  t.count = n;
  return t;
}

/* The last extremum only, whether it was passed or not; no virgin rule.  The literal reading, for replicas. */
static inline hyst_turn hyst_turn_last(const double *m, int depth, double x, double x0, double h0, hyst_branch g,
                                       const void *ctx) {
  const double *xs = m + HYST_TP_LIST, *hs = xs + depth;
  const double last = m[HYST_TP_X];
  hyst_turn t = {m[HYST_TP_DIRECTION], m[HYST_TP_H], x0, h0, (int)m[HYST_TP_COUNT]};
  if (x == last) return t;
  const double s = x > last ? 1 : -1;
  if (t.direction * s < 0) t.top_x = last, t.top_h = t.h, t.count = 1;
  else if (t.count == 1) t.top_x = xs[0], t.top_h = hs[0];
  t.h = x >= t.top_x ? t.top_h + g(ctx, x - t.top_x) : t.top_h - g(ctx, t.top_x - x);
  t.direction = s;
  return t;
}

/* Commit what hyst_turn_...() found. */
static inline void hyst_tp_commit(double *m, int depth, double x, hyst_turn t) {
  double *xs = m + HYST_TP_LIST, *hs = xs + depth;
  if (x == m[HYST_TP_X]) return;
  if (t.count > depth) t.count -= 2; /* full: forget the smallest stored loop */
  if (t.count > 0) xs[t.count - 1] = t.top_x, hs[t.count - 1] = t.top_h;
  m[HYST_TP_COUNT] = t.count;
  m[HYST_TP_DIRECTION] = t.direction;
  m[HYST_TP_X] = x;
  m[HYST_TP_H] = t.h;
}

static inline void hyst_tp_init(double *m, int depth, double x0, double h0) {
  for (int i = 0; i < HYST_TURNING_POINTS(depth); i++) m[i] = 0;
  m[HYST_TP_X] = x0;
  m[HYST_TP_H] = h0;
}
#endif
