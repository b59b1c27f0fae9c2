/* Disturbance observer: estimates the disturbance at the input of a second-order plant (load, residual hysteresis, gain
 * error) from command and measurement, and subtracts it from the command.  It is a state observer of the plant with a
 * constant disturbance and all poles at exp(-2 pi f_o h): the exact discrete form of Q(s) (G0(s)^-1 y - u), without an
 * inverse of the sampled plant, whose zero near -1 would ring.  y is the response to the command of n steps ago: n = 1
 * where the plant steps first, one more for every step of delay that is known. */
#include "core/blocks/controllers/control.h"
#include "core/elementary/elementary_sine.h"
#include "core/elementary/limit.h"
#include "core/elementary/second_order.h"
#include "core/hyst.h"

#define DIMS(D) D(n, 1, 1, 100000, "steps from a command to its response in y; 1: no delay")
#define VARS(V)                                                                                                  \
  V(f_n, PARAM, 1, "real", "Hz", 1.0, HYST_POSITIVE, HYST_INF, "natural frequency of the plant")                 \
  V(zeta, PARAM, 1, "real", "1", 0.7, 0.0, HYST_INF, "damping ratio of the plant")                               \
  V(gain, PARAM, 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "static gain of the plant, not 0")                    \
  V(f_o, PARAM, 1, "real", "Hz", 0.5, HYST_POSITIVE, HYST_INF, "bandwidth of the observer")                      \
  HYST_LIMIT_ROWS(V)                                                                                             \
  V(F, DERIVED, 9, "real", "1", 0.0, -HYST_INF, HYST_INF, "transition matrix of the states over a step")         \
  V(M, DERIVED, 3, "real", "1", 0.0, -HYST_INF, HYST_INF, "observer gains")                                      \
  V(work, DERIVED, HYST_SECOND_ORDER_WORK, "real", "1", 0.0, -HYST_INF, HYST_INF, "workspace for matrices")      \
  V(u_c, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "command for the undisturbed plant")                   \
  V(y, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "measured output of the plant")                          \
  V(u, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "command minus the estimated disturbance")              \
  V(d_hat, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "estimated disturbance at the input of the plant")  \
  V(estimate, STATE, 3, "real", "1", 0.0, -HYST_INF, HYST_INF, "estimated position, velocity / omega_n, gain d") \
  V(past, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "commands of the last n steps, newest first")

/* computes out = F in */
static void times(const double *F, const double *in, double *out) {
  for (int i = 0; i < 3; i++) out[i] = F[3 * i] * in[0] + F[3 * i + 1] * in[1] + F[3 * i + 2] * in[2];
}
/* computes out = row F */
static void row_times(const double *row, const double *F, double *out) {
  for (int j = 0; j < 3; j++) out[j] = row[0] * F[j] + row[1] * F[3 + j] + row[2] * F[6 + j];
}

/* Ackermann's formula for (I - M H) F with all eigenvalues at z: M = (F - z)^3 O^-1 (0 0 1)', O = [HF; HF^2; HF^3].
 * The last column of O^-1 is orthogonal to the first two rows of O. */
static int place(const double *F, double z, double *M) {
  const double *o1 = F; /* H = (1 0 0) */
  double o2[3], o3[3];
  row_times(o1, F, o2);
  row_times(o2, F, o3);
  double q[3];
  for (int i = 0; i < 3; i++) q[i] = o1[(i + 1) % 3] * o2[(i + 2) % 3] - o1[(i + 2) % 3] * o2[(i + 1) % 3];
  const double det = q[0] * o3[0] + q[1] * o3[1] + q[2] * o3[2];
  for (int i = 0; i < 3; i++) M[i] = q[i] / det;
  for (int k = 0; k < 3; k++) {
    times(F, M, q);
    for (int i = 0; i < 3; i++) M[i] = q[i] - z * M[i];
  }
  return hyst_isfinite(M[0] + M[1] + M[2]);
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  if (*gain == 0) return "gain must not be 0";
  const char *const wrong = hyst_wrong_limits(*u_min, *u_max);
  if (wrong || dt == 0) return wrong; /* the initialisation uses no matrices */
  return hyst_second_order(HYST_2PI * *f_n * dt, *zeta, work, F) && place(F, hyst_exp(-HYST_2PI * *f_o * dt), M)
             ? NULL
             : "the step is too long for f_n and zeta";
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *d_hat = estimate[2] / *gain;
  *u = hyst_clamp(*u_c - *d_hat, *u_min, *u_max);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  if (dt > 0) {
    const double driven[3] = {estimate[0], estimate[1], estimate[2] + *gain * past[n - 1]};
    double ahead[3];
    times(F, driven, ahead);
    ahead[2] = estimate[2];
    const double innovation = *y - ahead[0];
    for (int i = 0; i < 3; i++) estimate[i] = ahead[i] + M[i] * innovation;
  } else {
    estimate[0] = *y;
  }
  for (int i = n - 1; i > 0; i--) past[i] = past[i - 1];
  past[0] = hyst_clamp(*u_c - estimate[2] / *gain, *u_min, *u_max);
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  *t_d_hat = 0;
  *t_u = hyst_clamp_tangent(*u_c - estimate[2] / *gain, *u_min, *u_max, *s_u_c);
}
HYST_BLOCK(disturbance_observer,
           (.text = "Disturbance observer: subtracts an estimated input disturbance from the command",
            .equation = "u = u_c - d_hat; d_hat: observer of y'' = omega_n^2 (gain (u + d) - y) - 2 zeta omega_n y', "
                        "d' = 0, poles at exp(-2 pi f_o h)",
            .source = "Ohnishi 1987; Johnson, IEEE Trans. Automat. Control 16 (1971) 635; poles: Gao, ACC 2003",
            .family = "controllers", .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .flags = HYST_STEP, .prepare = prepare, .output = output, .tangent = tangent,
           .update = update)
