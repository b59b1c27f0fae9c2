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

/* Where a new input x finds its branch, without touching the memory. */
typedef struct {
  double direction, h;
  int count;    /* extrema left after the wiping-out, before the push */
  int reversal; /* the previous input was an extremum: it is pushed */
} hyst_turn;

static inline double hyst_tp_branch(double x, double x_p, double h_p, hyst_branch g, const void *ctx) {
  return x >= x_p ? h_p + g(ctx, x - x_p) : h_p - g(ctx, x_p - x);
}

static inline double hyst_tp_virgin(double x, double x0, double h0, hyst_branch g, const void *ctx) {
  return x >= x0 ? h0 + 0.5 * g(ctx, 2 * (x - x0)) : h0 - 0.5 * g(ctx, 2 * (x0 - x));
}

/* Dominant extrema.  m: the memory row, x0 and h0: origin of the virgin branch. */
static inline hyst_turn hyst_turn_dominant(const double *m, int depth, double x, double x0, double h0, hyst_branch g,
                                           const void *ctx) {
  const double *xs = m + HYST_TP_LIST, *hs = xs + depth;
  const double last = m[HYST_TP_X];
  hyst_turn t = {m[HYST_TP_DIRECTION], m[HYST_TP_H], (int)m[HYST_TP_COUNT], 0};
  if (x == last) return t; /* a plateau is not a reversal */
  const double direction = x > last ? 1 : -1;
  double top_x = 0, top_h = 0; /* the newest extremum, pushed already or about to be */
  if (t.direction != 0 && direction != t.direction) {
    t.reversal = 1;
    top_x = last;
    top_h = m[HYST_TP_H];
  } else if (t.count > 0) {
    top_x = xs[t.count - 1];
    top_h = hs[t.count - 1];
  }
  t.direction = direction;
  /* wiping-out: x has passed the extremum before the newest one */
  for (;;) {
    const int n = t.count + t.reversal;
    if (n == 0) break;
    if (n == 1) { /* the outermost extremum also closes on the virgin branch of the other side */
      const double reach = top_x > x0 ? top_x - x0 : x0 - top_x, now = x > x0 ? x - x0 : x0 - x;
      if (now >= reach) t.count = 0, t.reversal = 0;
      break;
    }
    const double older = xs[n - 2];
    if (direction > 0 ? x < older : x > older) break;
    if (t.reversal) t.reversal = 0, t.count -= 1;
    else t.count -= 2;
    if (t.count > 0) {
      top_x = xs[t.count - 1];
      top_h = hs[t.count - 1];
    }
  }
  t.h = t.count + t.reversal == 0 ? hyst_tp_virgin(x, x0, h0, g, ctx) : hyst_tp_branch(x, top_x, top_h, g, ctx);
  return t;
}

/* The last extremum only, whether it was passed or not; no virgin rule.  The literal reading, for replicas. */
static inline hyst_turn hyst_turn_last(const double *m, int depth, double x, double x0, double h0, hyst_branch g,
                                       const void *ctx) {
  const double last = m[HYST_TP_X];
  hyst_turn t = {m[HYST_TP_DIRECTION], m[HYST_TP_H], (int)m[HYST_TP_COUNT], 0};
  if (x == last) return t;
  const double direction = x > last ? 1 : -1;
  if (t.direction != 0 && direction != t.direction) {
    t.reversal = 1;
    t.count = 0;
    t.h = hyst_tp_branch(x, last, m[HYST_TP_H], g, ctx);
  } else if (t.count > 0) {
    t.h = hyst_tp_branch(x, m[HYST_TP_LIST], m[HYST_TP_LIST + depth], g, ctx);
  } else {
    t.h = hyst_tp_branch(x, x0, h0, g, ctx);
  }
  t.direction = direction;
  return t;
}

/* Commit what hyst_turn_...() found. */
static inline void hyst_tp_commit(double *m, int depth, double x, hyst_turn t) {
  double *xs = m + HYST_TP_LIST, *hs = xs + depth;
  if (t.reversal) {
    if (t.count == depth) t.count -= 2; /* full: forget the smallest stored loop */
    xs[t.count] = m[HYST_TP_X];
    hs[t.count] = m[HYST_TP_H];
    t.count++;
  }
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
