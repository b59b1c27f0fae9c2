/* Bumpless transfer: a command that takes over from another one without a jump.  At the first step at which u_present
 * is given, the output is u_present.  The difference to the command u_c then fades out on a straight line within T. The
 * output follows u_c meanwhile, so that the loop has its full gain from the first step on.  Without u_present it is
 * u_c. Astrom & Hagglund, PID Controllers, 2nd ed. 1995, chapter 3, set the state of the controller instead; that takes
 * a state that follows from a command, which an inverse with memory does not have. */
#include "core/elementary/elementary.h"
#include "core/elementary/limit.h"
#include "core/hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                                  \
  V(T, PARAM, 1, "real", "s", 1.0, HYST_POSITIVE, HYST_INF, "duration of the transfer")                          \
  V(u_c, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "new command")                                         \
  V(u_present, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "present command (1e300: none)")                 \
  V(u, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "command")                                              \
  V(share, STATE, 1, "real", "1", 0.0, 0.0, 1.0, "remaining share of the difference")                            \
  V(difference, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "u_present - u_c at the start of the transfer") \
  V(given, STATE, 1, "real", "1", 0.0, 0.0, 1.0, "1 if u_present was given at the last step")

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *u = *share > 0 ? *u_c + *share * *difference : *u_c;
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const int is_given = hyst_fabs(*u_present) < HYST_NO_LIMIT;
  if (is_given && !(dt > 0 && *given > 0)) {
    *share = 1;
    *difference = *u_present - *u_c;
  } else {
    *share = dt > 0 && dt < *share * *T ? *share - dt / *T : 0;
  }
  *given = is_given && dt > 0; /* the first step begins anew: importers may set inputs after the initialisation */
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  *t_u = *s_u_c;
}
HYST_BLOCK(bumpless_transfer,
           (.text = "Bumpless transfer: the output changes from the present command to a new one without a jump",
            .equation = "u = u_c + (1 - t / T) (u_present - u_c)(0), 0 <= t <= T",
            .source = "Astrom & Hagglund, PID Controllers, 2nd ed. 1995, chapter 3", .family = "controllers",
            .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .output = output, .tangent = tangent, .update = update)
