/* Recursive least squares with a dead zone: theta in y = phi' theta + e, learned from one sample per step.
 * IPMC paper, section 5, eqs. 13 to 19, with beta = share mu Sigma (mu Sigma is its bound), so that Sigma cancels:
 *   K = P phi s / ((1 + s) phi' P phi),  theta += K e,  P <- (P - K phi' P) / mu  while |e| > r
 *   printed    s = share (sigma^2 - r^2) / r^2, sigma^2 = sum e_k^2 / k; inside the dead zone P still grows by 1 / mu
 *   corrected  s = share (e^2 - r^2) / r^2; inside the dead zone nothing changes
 *   plain      no dead zone: K = P phi / (mu + phi' P phi), at every sample
 * P is never formed: P = U D U' with U unit upper triangular, so it stays symmetric, and positive while s > 0
 * (Bierman, Automatica 12 (1976) 375-382; Agee & Turner 1972 for s < 0).  Where an update is not finite, theta keeps
 * its value, P starts anew and the count `learned` returns to 0. */
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define DIMS(D) D(n, 2, 1, 1000, "number of weights")
#define VARS(V)                                                                                                     \
  V(form, FIXED, 1, "corrected|printed|plain", "1", 0, 0, 2, "update: corrected, as printed, or without dead zone") \
  V(theta0, FIXED, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "initial weights")                                     \
  V(eta, FIXED, 1, "real", "1", 100.0, HYST_POSITIVE, HYST_INF, "initial covariance P(0) = eta I")                  \
  V(mu, PARAM, 1, "real", "1", 0.999, HYST_POSITIVE, 1.0, "forgetting factor; 1: none")                             \
  V(r, PARAM, 1, "real", "1", 0.05, HYST_POSITIVE, HYST_INF, "dead zone: errors up to r are ignored")               \
  V(share, PARAM, 1, "real", "1", 1.0, HYST_POSITIVE, 1.0, "gain beta relative to its bound mu Sigma")              \
  V(phi, INPUT, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "regressors")                                             \
  V(y, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "measured output")                                          \
  V(y_hat, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "prediction of y before the update of the weights")    \
  V(theta, OUTPUT, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "weights after the update")                            \
  V(learned, OUTPUT, 1, "real", "1", 0.0, 0.0, HYST_INF, "number of updates since P was eta I")                     \
  V(weights, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "weights")                                            \
  V(before, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "weights before the last update")                      \
  V(gain, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "P phi of the last update")                              \
  V(D, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "diagonal of D in P = U D U'")                              \
  V(U, STATE, n *(n - 1) / 2, "real", "1", 0.0, -HYST_INF, HYST_INF, "columns of U above the diagonal")             \
  V(count, STATE, 1, "real", "1", 0.0, 0.0, HYST_INF, "number of updates since P was eta I")                        \
  V(samples, STATE, 1, "real", "1", 0.0, 0.0, HYST_INF, "number of samples k")                                      \
  V(variance, STATE, 1, "real", "1", 0.0, 0.0, HYST_INF, "sigma^2 / r^2 as printed")

enum { CORRECTED, PRINTED, PLAIN };

static double product(int n, const double *a, const double *b) {
  double sum = 0;
  for (int i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

/* phi' P phi = sum of D_j f_j^2, f = U' phi */
static double leverage(int n, const double *D, const double *U, const double *phi) {
  double sum = 0;
  for (int j = 0; j < n; U += j++) {
    const double f = phi[j] + product(j, U, phi);
    sum += D[j] * f * f;
  }
  return sum;
}

/* P <- (P - P phi phi' P / alpha) / mu with alpha = alpha_0 + phi' P phi, column by column; returns alpha, gain: P phi
 */
static double learn(int n, double *D, double *U, const double *phi, double alpha, double mu, double *gain) {
  for (int j = 0; j < n; U += j++) {
    const double f = phi[j] + product(j, U, phi), v = D[j] * f, old = alpha;
    alpha += f * v;
    for (int i = 0; i < j; i++) {
      const double u = U[i];
      U[i] = u - f / old * gain[i];
      gain[i] += u * v;
    }
    gain[j] = v;
    D[j] = D[j] * (old / alpha) / mu;
  }
  return alpha;
}

static int all_finite(int n, const double *a) {
  for (int i = 0; i < n; i++)
    if (!hyst_isfinite(a[i])) return 0;
  return 1;
}

static void start(int n, double eta, double *D, double *U, double *gain, double *count) {
  for (int i = 0; i < n; i++) D[i] = eta, gain[i] = 0;
  for (int i = 0; i < n * (n - 1) / 2; i++) U[i] = 0;
  *count = 0;
}

HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  for (int i = 0; i < n; i++) weights[i] = before[i] = theta0[i];
  start(n, *eta, D, U, gain, count);
  *samples = *variance = 0;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *y_hat = product(n, phi, before);
  for (int i = 0; i < n; i++) theta[i] = weights[i];
  *learned = *count;
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  for (int i = 0; i < n; i++) before[i] = weights[i];
  const double e = *y - product(n, phi, weights), hPh = leverage(n, D, U, phi), size = e / *r;
  *samples += 1;
  if (*form == (double)PRINTED) *variance += size * size / *samples;
  double alpha = *mu;
  if (*form != (double)PLAIN) {
    const double s = *share * ((*form == (double)PRINTED ? *variance : size * size) - 1);
    if (hyst_fabs(e) <= *r || s == 0 || hPh == 0) { /* lambda = 0, or the regressors are 0 */
      if (*form == (double)PRINTED)
        for (int i = 0; i < n; i++) D[i] /= *mu;
      return;
    }
    alpha = hPh / s;
  }
  alpha = learn(n, D, U, phi, alpha, *mu, gain);
  for (int i = 0; i < n; i++) weights[i] += gain[i] / alpha * e;
  *count += 1;
  if (all_finite(n, weights) && all_finite(n, gain) && all_finite(n, D) && all_finite(n * (n - 1) / 2, U)) return;
  for (int i = 0; i < n; i++) weights[i] = before[i];
  start(n, *eta, D, U, gain, count);
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  *t_y_hat = product(n, s_phi, before);
  for (int i = 0; i < n; i++) t_theta[i] = 0;
  *t_learned = 0;
}
HYST_BLOCK(recursive_least_squares,
           (.text = "Recursive least squares with a dead zone: learns the weights of regressors during operation",
            .equation = "e = y - phi' theta, theta += P phi s e / ((1 + s) phi' P phi), s = share (e^2 - r^2) / r^2 "
                        "while |e| > r, P <- (P - s / (1 + s) P phi phi' P / phi' P phi) / mu",
            .source = "IPMC hysteresis model with basis function network, eq. 13-19; Bierman, Automatica 12 (1976) 375",
            .family = "networks", .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .init = init, .output = output, .tangent = tangent, .update = update)
