/* Iterative learning control: adds corrections to the feed-forward, learnt from the errors of earlier periods.
 * The memory is one period of n steps.  At its end every correction is updated by the error `lead` steps later, and a
 * zero-phase filter (smooth, 1 - 2 smooth, smooth) removes what the plant cannot follow.  The period of the reference
 * must be n steps of the unit. */
#include "core/blocks/controllers/control.h"
#include "core/elementary/limit.h"
#include "core/memory/stored.h"

#define DIMS(D) D(n, 20, 1, 1000000, "steps per period of the reference")
#define VARS(V)                                                                                            \
  V(gain, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "learning gain; 0: no learning")                \
  V(lead, PARAM, 1, "int", "1", 1.0, 0.0, 1000000.0, "steps from a command to its effect")                 \
  V(smooth, PARAM, 1, "real", "1", 0.0, 0.0, 0.25, "weight of each neighbour in the filter; 0: no filter") \
  HYST_LIMIT_ROWS(V)                                                                                       \
  HYST_LOOP_ROWS(V, "feed-forward, or command of another controller")                                      \
  V(w, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "corrections of one period")                       \
  V(e, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "errors of the current period")                    \
  V(at, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "current step of the period")

static void learn(int n, double *w, const double *e, double gain, int lead, double smooth) {
  for (int k = 0; k < n; k++) w[k] += gain * e[(k + lead) % n];
  const double first = w[0];
  double before = w[n - 1];
  for (int k = 0; k < n; k++) {
    const double now = w[k], after = k + 1 < n ? w[k + 1] : first;
    w[k] = smooth * (before + after) + (1 - 2 * smooth) * now;
    before = now;
  }
}

HYST_LIMIT_PREPARE
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *u = hyst_clamp(*u_ff + w[hyst_stored(*at, n - 1)], *u_min, *u_max);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  int now = hyst_stored(*at, n - 1) + (dt > 0);
  if (now == n) {
    learn(n, w, e, *gain, (int)*lead % n, *smooth);
    now = 0;
  }
  e[now] = *y_d - *y;
  *at = now;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  *t_u = hyst_clamp_tangent(*u_ff + w[hyst_stored(*at, n - 1)], *u_min, *u_max, *s_u_ff);
}
HYST_BLOCK(
    iterative_learning,
    (.text = "Iterative learning control: corrections from the errors of earlier periods",
     .equation = "u_k = u_ff + w_k; after each period w_k <- Q (w_k + gain e_(k + lead)), e = y_d - y, "
                 "Q w_k = smooth w_(k-1) + (1 - 2 smooth) w_k + smooth w_(k+1)",
     .source = "Arimoto, Kawamura & Miyazaki 1984; Bristow, Tharayil & Alleyne, IEEE Control Systems 26 (2006) 96",
     .family = "controllers", .tolerance = "rounding"),
    .rate = HYST_SAMPLED, .prepare = prepare, .output = output, .tangent = tangent, .update = update)
