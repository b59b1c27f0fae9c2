/* Adaptive inverse: the exact inverse of a Prandtl-Ishlinskii operator whose weights are learned during operation.
 *
 * The operator is linear in its weights theta = (w0, w): behind linear dynamics G0 and a known delay the measured
 * output is y = theta' phi, phi = G0 z^-delay of the command and of its plays.  A Kalman filter with theta as a random
 * walk (P grows by P_0 dt / T) learns theta from the prediction error y - theta' phi. A feedback in v changes the
 * command, and phi contains the command, so the feedback causes no prediction error. The following measures make it
 * robust:
 *   f_h       a feedback corrects errors slower than f_h: y and phi pass a first-order high pass, so that a disturbance
 *             or an offset changes no weight (prefilter of the criterion: Ljung, System Identification, 2nd ed., 14.4)
 *   gate      the weights are constant while the reference is constant, so that noise at rest does not change them
 *   trust     P starts at start^2 P_0; it is set to P_0 after six consecutive prediction errors above `change`
 *   box       w0 >= w0_min and w >= 0 bound the slope of the inverse; theta stays within `box` sd of its initial value
 *   P         symmetric, no diagonal element above P_0; the random walk is much larger than rounding errors
 * Kuhnen & Janocha, European Control Conference 1999 (adaptive inverse); Krejci & Kuhnen 2001 (inverse); Kalman filter
 * of a random walk: Ljung & Gunnarsson, Automatica 26 (1990) 7-21. */
#include "core/blocks/controllers/control.h"
#include "core/elementary/elementary.h"
#include "core/elementary/elementary_sine.h"
#include "core/elementary/limit.h"
#include "core/elementary/second_order.h"
#include "core/memory/play.h"

enum { IN_A_ROW = 6 };

#define DIMS(D)                                \
  D(n, 10, 1, 500, "number of play operators") \
  D(delay, 1, 0, 1000, "steps until a command reaches the plant")
#define VARS(V)                                                                                                      \
  V(w0, FIXED, 1, "real", "1", 1.0, HYST_POSITIVE, HYST_INF, "weight of the linear term at the start")               \
  V(r, FIXED, n, "real", "1", 0.1, 0.0, HYST_INF, "thresholds (play half-widths), not decreasing")                   \
  V(w, FIXED, n, "real", "1", 0.1, 0.0, HYST_INF, "weights of the plays at the start")                               \
  V(u0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "initial memory: plant and plays rest at this value of u")  \
  V(f_n, PARAM, 1, "real", "Hz", 0.0, 0.0, HYST_INF, "natural frequency of G0; 0: no dynamics")                      \
  V(zeta, PARAM, 1, "real", "1", 0.7, 0.0, HYST_INF, "damping ratio of G0")                                          \
  V(f_h, FIXED, 1, "real", "Hz", 0.0, 0.0, HYST_INF, "slower errors are not learned (0: all are learned)")           \
  V(sd, PARAM, n + 1, "real", "1", 0.05, 0.0, HYST_INF, "standard deviations of w0 and w after a sudden change")     \
  V(start, FIXED, 1, "real", "1", 0.1, 0.0, 1.0, "standard deviations at the start, relative to sd")                 \
  V(T, PARAM, 1, "real", "s", 3.0, HYST_POSITIVE, HYST_INF, "time in which the drift of a weight reaches sd")        \
  V(sigma, PARAM, 1, "real", "1", 0.01, HYST_POSITIVE, HYST_INF, "standard deviation of the prediction error")       \
  V(change, PARAM, 1, "real", "1", 0.04, HYST_POSITIVE, HYST_INF, "prediction error that indicates a sudden change") \
  V(pause, PARAM, 1, "real", "s", 0.2, 0.0, HYST_INF, "shortest time between two sudden changes")                    \
  V(box, PARAM, 1, "real", "1", 6.0, 0.0, HYST_INF, "largest deviation of a weight from its initial value, in sd")   \
  V(w0_min, PARAM, 1, "real", "1", 0.1, HYST_POSITIVE, HYST_INF, "lower limit of w0")                                \
  HYST_LIMIT_ROWS(V)                                                                                                 \
  V(F, DERIVED, 9, "real", "1", 0.0, -HYST_INF, HYST_INF, "transition matrix of G0 over a step")                     \
  V(slow, DERIVED, 1, "real", "1", 0.0, 0.0, 1.0, "gain of the low pass in a step")                                  \
  V(work, DERIVED, HYST_SECOND_ORDER_WORK, "real", "1", 0.0, -HYST_INF, HYST_INF, "workspace for matrices")          \
  V(v, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "wanted output of the operator")                             \
  V(y_d, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "reference; the weights change only while it moves")       \
  V(y, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "measured output of the plant")                              \
  V(u, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "operator input for the output v")                          \
  V(theta, OUTPUT, n + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "current weights w0 and w")                         \
  V(y_hat, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "prediction of y before the update of the weights")     \
  V(gate, OUTPUT, 1, "real", "1", 0.0, 0.0, 1.0, "1 if the sample updated the weights")                              \
  V(changes, OUTPUT, 1, "real", "1", 0.0, 0.0, HYST_INF, "number of sudden changes")                                 \
  V(weights, STATE, n + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "weights w0 and w")                                \
  V(P, STATE, (n + 1) * (n + 2) / 2, "real", "1", 0.0, -HYST_INF, HYST_INF, "covariance: rows up to the diagonal")   \
  V(z, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "plays of the command")                                      \
  V(z_then, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "plays of the delayed command")                         \
  V(phi, STATE, n + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "regressors: delayed command and plays through G0")    \
  V(dphi, STATE, n + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "rates of the regressors / omega_n")                  \
  V(low, STATE, n + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "slow part of the regressors")                         \
  V(fast, STATE, n + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "fast part of the regressors")                        \
  V(y_low, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "slow part of the measured output")                      \
  V(gain, STATE, n + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "P phi of the last update")                           \
  V(commands, STATE, delay + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "last commands, newest first")                \
  V(v_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "v at the last step")                                   \
  V(y_d_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "reference at the last step")                         \
  V(predicted, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "last prediction")                                   \
  V(learned, STATE, 1, "real", "1", 0.0, 0.0, 1.0, "1 if the last sample updated the weights")                       \
  V(wrong, STATE, 1, "real", "1", 0.0, 0.0, IN_A_ROW, "number of consecutive prediction errors above `change`")      \
  V(since, STATE, 1, "real", "s", 0.0, 0.0, HYST_INF, "time since the last sudden change")                           \
  V(count, STATE, 1, "real", "1", 0.0, 0.0, HYST_INF, "number of sudden changes")

static double product(int n, const double *a, const double *b) {
  double sum = 0;
  for (int i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

/* The command at which the operator gives v, on the branch from the last command: the plays begin to move in the order
 * of their thresholds, because z_i + r_i does not decrease with i, nor z_i - r_i increase.  seed: change of v, for the
 * slope at a kink; 0 if only the value counts.  slope: of the operator there. */
static double invert(int n, const double *r, const double *theta, const double *z, double last, double v, double seed,
                     double *slope) {
  double missing = v - theta[0] * last, size = hyst_fabs(v) + hyst_fabs(theta[0] * last);
  for (int i = 0; i < n; i++) {
    missing -= theta[i + 1] * z[i];
    size += hyst_fabs(theta[i + 1] * z[i]);
  }
  /* at the last command, the difference is only rounding; the seed selects the direction */
  const int stands = seed != 0 && hyst_fabs(missing) <= 1e-13 * size;
  const double way = (stands ? seed : missing) < 0 ? -1 : 1;
  double left = stands ? 0 : hyst_fabs(missing), u = last;
  *slope = theta[0];
  for (int i = 0; i < n; i++) {
    double go = way * (z[i] + way * r[i] - u);
    if (go < 0) go = 0; /* only for a memory that no run can reach */
    if (go * *slope > left || (go * *slope == left && !(way * seed > 0))) break;
    left -= go * *slope;
    u += way * go;
    *slope += theta[i + 1];
  }
  return u + way * left / *slope;
}

static void trust(int n, double share, const double *sd, double *P) {
  for (int i = 0; i < n; i++, P++) {
    for (int j = 0; j < i; j++) *P++ = 0;
    *P = share * sd[i] * sd[i];
  }
}

/* theta += K e, P <- P - K phi' P + Q, K = P phi / (sigma^2 + phi' P phi).  Returns 0 and changes nothing if the
 * numbers are out of range. */
static int learn(int n, double *theta, double *P, const double *phi, double e, double sigma, const double *sd, double q,
                 double *gain) {
  for (int i = 0, at = 0; i < n; i++) {
    gain[i] = 0;
    for (int j = 0; j < i; j++, at++) {
      gain[i] += P[at] * phi[j];
      gain[j] += P[at] * phi[i];
    }
    gain[i] += P[at++] * phi[i];
  }
  const double leverage = product(n, gain, phi), least = 1e-10 * leverage, noise = sigma * sigma;
  const double alpha = leverage + (noise > least ? noise : least); /* keeps P positive in floating point */
  if (!hyst_isfinite(alpha + e / alpha)) return 0;
  for (int i = 0, at = 0; i < n; i++) {
    theta[i] += gain[i] * (e / alpha);
    for (int j = 0; j <= i; j++, at++) P[at] -= gain[i] * (gain[j] / alpha);
    P[at - 1] += q * sd[i] * sd[i];
  }
  for (int i = 0, row = 0; i < n; row += ++i) { /* multiplies row and column i by f, so that the correlations stay */
    const double most = sd[i] * sd[i], now = P[row + i];
    if (!(now > most)) continue;
    const double f = hyst_sqrt(most / now);
    for (int j = 0; j < i; j++) P[row + j] *= f;
    for (int j = i + 1; j < n; j++) P[j * (j + 1) / 2 + i] *= f;
    P[row + i] = most;
  }
  return 1;
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  for (int i = 1; i < n; i++)
    if (r[i] < r[i - 1]) return "the thresholds r must not decrease";
  if (*w0_min > *w0) return "w0_min must not be greater than w0";
  const char *const bad = hyst_wrong_limits(*u_min, *u_max);
  if (bad || dt == 0) return bad; /* the initialisation uses no matrix */
  *slow = 1 - hyst_exp(-HYST_2PI * *f_h * dt);
  for (int i = 0; i < 9; i++) F[i] = i == 2; /* without dynamics, the position is the input */
  return *f_n == 0 || hyst_second_order(HYST_2PI * *f_n * dt, *zeta, work, F) ? NULL
                                                                              : "the step is too long for f_n and zeta";
}
HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  for (int i = 0; i <= n; i++) {
    weights[i] = i == 0 ? *w0 : w[i - 1];
    phi[i] = *u0;
    low[i] = *f_h > 0 ? *u0 : 0;
    dphi[i] = fast[i] = gain[i] = 0;
  }
  trust(n + 1, *start * *start, sd, P);
  for (int i = 0; i < n; i++) z[i] = z_then[i] = *u0;
  for (int i = 0; i <= delay; i++) commands[i] = *u0;
  *predicted = *v_last = product(n + 1, weights, phi);
  *y_low = *y_d_last = *learned = *wrong = *count = 0;
  *since = *pause; /* a sudden change is possible from the start */
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  double slope;
  *u = *v == *v_last ? commands[0] : hyst_clamp(invert(n, r, weights, z, commands[0], *v, 0, &slope), *u_min, *u_max);
  for (int i = 0; i <= n; i++) theta[i] = weights[i];
  *y_hat = *predicted;
  *gate = *learned;
  *changes = *count;
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  if (dt > 0) {
    const double then = commands[delay]; /* command of the plant over the step */
    for (int i = 0; i <= n; i++) {
      if (i > 0) z_then[i - 1] = hyst_play(z_then[i - 1], then, r[i - 1]);
      const double in = i == 0 ? then : z_then[i - 1], position = phi[i];
      phi[i] = F[0] * position + F[1] * dphi[i] + F[2] * in;
      dphi[i] = F[3] * position + F[4] * dphi[i] + F[5] * in;
      low[i] += *slow * (phi[i] - low[i]);
      fast[i] = phi[i] - low[i];
    }
    *y_low += *slow * (*y - *y_low);
    *predicted = product(n + 1, weights, phi);
    const double e = *y - *y_low - product(n + 1, weights, fast);
    *since += dt;
    *learned = *y_d != *y_d_last && learn(n + 1, weights, P, fast, e, *sigma, sd, dt / *T, gain);
    if (*learned == 1) {
      *wrong = hyst_fabs(e) > *change && *since >= *pause ? *wrong + 1 : 0;
      if (*wrong >= (double)IN_A_ROW) {
        trust(n + 1, 1, sd, P);
        *wrong = *since = 0;
        *count += 1;
      }
      for (int i = 0; i <= n; i++) {
        const double from = i == 0 ? *w0 : w[i - 1], far = *box * sd[i], least = i == 0 ? *w0_min : 0;
        weights[i] = hyst_clamp(weights[i], from - far > least ? from - far : least, from + far);
      }
    }
    for (int i = delay; i > 0; i--) commands[i] = commands[i - 1];
  } else if (*f_h > 0) {
    *y_low = *y;
  }
  if (*v != *v_last || *learned == 1) { /* otherwise rounding must not change the command */
    double slope;
    commands[0] = hyst_clamp(invert(n, r, weights, z, commands[0], *v, 0, &slope), *u_min, *u_max);
    for (int i = 0; i < n; i++) z[i] = hyst_play(z[i], commands[0], r[i]);
  }
  *v_last = *v;
  *y_d_last = *y_d;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  double slope;
  const double free = invert(n, r, weights, z, commands[0], *v, *s_v, &slope);
  *t_u = hyst_clamp_tangent(free, *u_min, *u_max, *s_v / slope);
  for (int i = 0; i <= n; i++) t_theta[i] = 0;
  *t_y_hat = *t_gate = *t_changes = 0;
}
HYST_BLOCK(adaptive_inverse,
           (.text = "Adaptive inverse of a Prandtl-Ishlinskii operator: learns its weights during operation",
            .equation = "u such that w0 u + sum_i w_i p_{r_i}[u] = v; theta = (w0, w) += K (y - theta' phi) while y_d "
                        "moves, K = P phi / (sigma^2 + phi' P phi), P <- P - K phi' P + dt / T diag(sd^2), "
                        "phi = G0 z^-delay (u, p_{r_i}[u])",
            .source = "Krejci & Kuhnen 2001, eq. 10-14; Ljung & Gunnarsson, Automatica 26 (1990) 7",
            .family = "inverses", .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .flags = HYST_STEP, .prepare = prepare, .init = init, .output = output,
           .tangent = tangent, .update = update)
