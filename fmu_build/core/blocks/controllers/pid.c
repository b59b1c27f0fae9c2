/* PID controller with feed-forward, parallel form, with filtered derivative, limits and anti-windup.
 * The integral uses the backward rule; initialisation gives no derivative kick. */
#include "core/blocks/controllers/control.h"
#include "core/elementary/limit.h"

#define DIMS(D)
#define VARS(V)                                                                                        \
  V(Kp, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "proportional gain")                          \
  V(Ki, PARAM, 1, "real", "1/s", 0.0, -HYST_INF, HYST_INF, "integral gain")                            \
  V(Kd, PARAM, 1, "real", "s", 0.0, -HYST_INF, HYST_INF, "derivative gain")                            \
  V(tau, PARAM, 1, "real", "s", 0.0, 0.0, HYST_INF, "time constant of the derivative filter; 0: none") \
  HYST_LIMIT_ROWS(V)                                                                                   \
  HYST_LOOP_ROWS(V, "feed-forward")                                                                    \
  V(integral, STATE, 1, "real", "s", 0.0, -HYST_INF, HYST_INF, "integral of the error")                \
  HYST_DIFFERENCE_ROWS(V)

HYST_LIMIT_PREPARE
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *u = hyst_clamp(*u_ff + *Kp * (*y_d - *y) + *Ki * *integral + *Kd * *de, *u_min, *u_max);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const double e = *y_d - *y, step = e * dt;
  *de = hyst_difference(*de, e, *e_last, *tau, dt);
  *e_last = e;
  const double before = *u_ff + *Kp * e + *Ki * *integral + *Kd * *de;
  if (!hyst_winds_up(before, before + *Ki * step, *u_min, *u_max)) *integral += step;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double free = *u_ff + *Kp * (*y_d - *y) + *Ki * *integral + *Kd * *de;
  *t_u = hyst_clamp_tangent(free, *u_min, *u_max, *s_u_ff + *Kp * (*s_y_d - *s_y));
}
HYST_BLOCK(pid,
           (.text = "PID controller with feed-forward and anti-windup",
            .equation = "u = u_ff + Kp e + Ki int e dt + Kd de/dt, e = y_d - y",
            .source = "Astrom & Hagglund, PID Controllers, 2nd ed. 1995, chapter 3", .family = "controllers",
            .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .prepare = prepare, .output = output, .tangent = tangent, .update = update)
