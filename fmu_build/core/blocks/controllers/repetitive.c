/* Plug-in repetitive control: corrections of the reference of any controller, learnt from the errors one period ago.
 * The filter Q has zero phase: it looks n_q steps back and n_q ahead of the same step of the last period, so that its
 * taps are given for one side.  The learning filter L looks n_l steps both ways and makes up for the phase of the
 * closed loop.  The loop stays stable if abs(Q - L T) < 1 at all frequencies, T its complementary sensitivity.  The
 * period of the reference must be n steps of the unit. */
#include "core/hyst.h"
#include "core/memory/stored.h"

#define RING (n + n_q + n_l + 1) /* from n + max(n_q, n_l) steps ago to the current one */

#define DIMS(D)                                          \
  D(n, 20, 2, 1000000, "steps per period")               \
  D(n_q, 1, 0, 10000, "taps of Q on each side, below n") \
  D(n_l, 1, 0, 10000, "taps of L on each side, below n")
#define VARS(V)                                                                                                        \
  V(q, PARAM, n_q + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "taps of Q: the middle tap, then one side")              \
  V(l, PARAM, 2 * n_l + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "taps of L, from n_l steps back to n_l steps ahead") \
  V(y_d, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "reference")                                                 \
  V(y, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "measured output of the plant")                                \
  V(active, INPUT, 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "learning is off if active <= 0")                         \
  V(r, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "corrected reference for the controller")                     \
  V(w, STATE, RING, "real", "1", 0.0, -HYST_INF, HYST_INF, "past corrections")                                         \
  V(e, STATE, RING, "real", "1", 0.0, -HYST_INF, HYST_INF, "past errors")                                              \
  V(at, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "index of the current step in w and e")

/* returns the element of a ring that is n steps older than `at` */
static inline int past(int at, int n, int ring) { return at < n ? at - n + ring : at - n; }

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  return n_q < n && n_l < n ? NULL : "n_q and n_l must be below n";
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *r = *y_d + w[hyst_stored(*at, RING - 1)];
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const int ring = RING, before = hyst_stored(*at, ring - 1);
  const int now = dt == 0 ? before : before + 1 == ring ? 0 : before + 1;
  const int same = past(now, n, ring);
  double sum = q[0] * w[same];
  for (int j = 1; j <= n_q; j++) sum += q[j] * (w[past(now, n + j, ring)] + w[past(now, n - j, ring)]);
  for (int j = -n_l; j <= n_l; j++) sum += l[n_l + j] * e[past(now, n - j, ring)];
  w[now] = sum;
  e[now] = *active > 0 ? *y_d - *y : 0;
  *at = now;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  *t_r = *s_y_d;
}
HYST_BLOCK(repetitive,
           (.text = "Repetitive control: corrects the reference by the errors of the last period",
            .equation = "r_k = y_d + w_k, w_k = sum_j q_|j| w_(k-n+j) + sum_j l_j e_(k-n+j), e = y_d - y",
            .source = "Hara, Yamamoto, Omata & Nakano, IEEE Trans. Automat. Control 33 (1988) 659-668; zero phase: "
                      "Tomizuka, Tsao & Chew, ASME J. Dyn. Syst. Meas. Control 111 (1989) 353-358",
            .family = "controllers", .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .prepare = prepare, .output = output, .tangent = tangent, .update = update)
