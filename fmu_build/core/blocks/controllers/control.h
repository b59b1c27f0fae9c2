/* control.h - shared by all controllers: rows of their tables, a filtered difference, and anti-windup. */
#ifndef HYST_CONTROL_H
#define HYST_CONTROL_H
#include "core/elementary/limit.h"
#include "core/hyst.h"

/* rows for VARS(V): limits of the command; signals of a loop around a feed-forward; memory of hyst_difference() */
#define HYST_LIMIT_ROWS(V)                                                                 \
  V(u_min, PARAM, 1, "real", "1", -HYST_NO_LIMIT, -HYST_INF, HYST_INF, "lower limit of u") \
  V(u_max, PARAM, 1, "real", "1", HYST_NO_LIMIT, -HYST_INF, HYST_INF, "upper limit of u")
#define HYST_LOOP_ROWS(V, text_of_u_ff)                                                 \
  V(y_d, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "reference")                  \
  V(y, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "measured output of the plant") \
  V(u_ff, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, text_of_u_ff)                \
  V(u, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "control")
#define HYST_DIFFERENCE_ROWS(V)                                                                \
  V(de, STATE, 1, "real", "1/s", 0.0, -HYST_INF, HYST_INF, "filtered derivative of the error") \
  V(e_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "error at the last step")

/* returns NULL, or the error of prepare() for HYST_LIMIT_ROWS */
static inline const char *hyst_wrong_limits(double u_min, double u_max) {
  return u_min > u_max ? "u_min must not be greater than u_max" : NULL;
}
/* prepare() of a block without other checks or derived values */
#define HYST_LIMIT_PREPARE                    \
  HYST_PREPARE_FN(prepare) {                  \
    HYST_OPEN_PREPARE                         \
    return hyst_wrong_limits(*u_min, *u_max); \
  }

/* de/dt with the filter 1 / (tau s + 1), by the backward rule; tau = 0: no filter; dt = 0: the result is 0. */
static inline double hyst_difference(double d_last, double e, double e_last, double tau, double dt) {
  return dt > 0 ? (tau * d_last + (e - e_last)) / (tau + dt) : 0;
}

/* Whether a step of the integral, which moves the unlimited output from u_before to u_after, moves it further outside
 * of the limits.  Such a step is omitted (conditional integration: Astrom & Hagglund, PID Controllers, 2nd ed.,
 * 3.5). */
static inline int hyst_winds_up(double u_before, double u_after, double lo, double hi) {
  return (u_after > hi && u_after > u_before) || (u_after < lo && u_after < u_before);
}
#endif
