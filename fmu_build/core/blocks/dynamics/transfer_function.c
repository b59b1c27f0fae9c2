/* Linear transfer function of any order, discretised exactly for the step in use.
 * Controllable canonical form in scaled time: with p = s / sigma, sigma a power of two chosen so that no coefficient of
 * the monic denominator exceeds 1, the states are v_i = p^i 1/a(p) u.  Unscaled companion matrices of a 500 Hz
 * system hold entries 1e7 apart.  Discretisation of the held (zoh) or ramped (foh) input by one matrix exponential of
 * [A B 0; 0 0 1; 0 0 0] dt: Van Loan, IEEE Trans. Automat. Control 23 (1978) 395-404; Franklin, Powell & Workman,
 * Digital Control of Dynamic Systems, 3rd ed., section 6.3.2 (triangle hold). */
#include "core/elementary/matrix_exponential.h"

enum { MOST_ORDER = 32 };

#define DIMS(D)                                                \
  D(na, 1, 1, MOST_ORDER, "degree of the denominator (order)") \
  D(nb, 0, 0, MOST_ORDER, "degree of the numerator, at most na")
#define VARS(V)                                                                                                        \
  V(b, FIXED, nb + 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "numerator, highest power of s first")                    \
  V(a, FIXED, na + 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "denominator, highest power of s first; a[1] not 0")      \
  V(hold, FIXED, 1, "zoh|foh", "1", 0.0, 0.0, 1.0, "input within a step: held at its new value, or a ramp to it")      \
  V(start, FIXED, 1, "rest|steady", "1", 0.0, 0.0, 1.0,                                                                \
    "initial states: zero, or in equilibrium with the first input")                                                    \
  V(alpha, DERIVED, na, "real", "1", 0.0, -HYST_INF, HYST_INF, "monic denominator in scaled time, lowest power first") \
  V(c, DERIVED, na, "real", "1", 0.0, -HYST_INF, HYST_INF, "output row of the state space")                            \
  V(d, DERIVED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "direct term")                                               \
  V(sigma, DERIVED, 1, "real", "1/s", 1.0, -HYST_INF, HYST_INF, "time scale")                                          \
  V(A, DERIVED, na *na, "real", "1", 0.0, -HYST_INF, HYST_INF, "state matrix over a step")                             \
  V(B0, DERIVED, na, "real", "1", 0.0, -HYST_INF, HYST_INF, "weight of the input at the start of a step")              \
  V(B1, DERIVED, na, "real", "1", 0.0, -HYST_INF, HYST_INF, "weight of the input at the end of a step")                \
  V(work, DERIVED, HYST_EXPM_WORK(na + 2), "real", "1", 0.0, -HYST_INF, HYST_INF, "workspace for matrices")            \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                                       \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                                     \
  V(v, CSTATE, na, "real", "1", 0.0, -HYST_INF, HYST_INF, "states")                                                    \
  V(u_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input at the last step")

static double power_of_two(int e) { return hyst_from_bits((uint64_t)(e + 1023) << 52); } /* |e| <= 1022 */

/* The exponent of the smallest power of two sigma with |a_k / a_0| <= sigma^k for all k. */
static int time_scale(int na, const double *a) {
  int most = -1023;
  for (int k = 1; k <= na; k++) {
    const double ratio = a[k] / a[0];
    if (ratio == 0) continue;
    const int e = (int)(hyst_to_bits(hyst_fabs(ratio)) >> 52) - 1022; /* |ratio| < 2^e */
    const int root = e > 0 ? (e + k - 1) / k : -(-e / k);
    if (root > most) most = root;
  }
  return most == -1023 ? 0 : most; /* integrators in series have no time scale */
}

static int all_finite(int n, const double *v) {
  for (int i = 0; i < n; i++)
    if (!hyst_isfinite(v[i])) return 0;
  return 1;
}

/* Discretisation: e^([A B 0; 0 0 1; 0 0 0] dt) = [Ad G1 G2; ...]; ramp: v+ = Ad v + G1 u_0 + G2 (u_1 - u_0). */
static int discretise(int na, const double *alpha, double rate, double *work, int foh, double *A, double *B0,
                      double *B1) {
  const int n = na + 2;
  hyst_dd *M = (hyst_dd *)work;
  for (int i = 0; i < n * n; i++) M[i] = hyst_dd_of(0);
  for (int i = 0; i + 1 < na; i++) M[i * n + i + 1] = hyst_dd_of(rate);
  for (int i = 0; i < na; i++) M[(na - 1) * n + i] = hyst_dd_mul(hyst_dd_of(-alpha[i]), hyst_dd_of(rate));
  M[(na - 1) * n + na] = hyst_dd_of(rate);
  M[na * n + na + 1] = hyst_dd_of(1);
  const hyst_dd *E = hyst_expm(n, work);
  if (!E) return 0;
  for (int i = 0; i < na; i++) {
    for (int j = 0; j < na; j++) A[i * na + j] = E[i * n + j].hi;
    const hyst_dd G1 = E[i * n + na], G2 = E[i * n + na + 1], minus_G2 = {-G2.hi, -G2.lo};
    B0[i] = foh ? hyst_dd_add(G1, minus_G2).hi : 0;
    B1[i] = foh ? G2.hi : G1.hi;
  }
  return 1;
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  if (nb > na) return "the numerator must not have a higher degree than the denominator";
  if (a[0] == 0) return "the first coefficient of a must not be 0";
  if (*start == 1 && a[na] == 0)
    return "start = steady: an integrator (last coefficient of a is 0) has no steady state";
  for (int k = 1; k <= na; k++)
    if (!hyst_isfinite(a[k] / a[0])) return "the first coefficient of a is too small relative to the others";
  const int e = time_scale(na, a);
  if (e > 1022) return "the magnitudes of the coefficients differ too much"; /* otherwise 2^-e is 0 or infinite */
  const double slower = power_of_two(-e);
  *sigma = power_of_two(e);
  for (int k = 1; k <= na; k++) { /* multiplied in steps, because sigma^k may be out of range */
    alpha[na - k] = a[k] / a[0];
    for (int i = 0; i < k; i++) alpha[na - k] *= slower;
  }
  *d = nb == na ? b[0] / a[0] : 0;
  for (int i = 0; i < na; i++) {
    c[i] = i <= nb ? b[nb - i] / a[0] : 0;
    for (int k = i; k < na; k++) c[i] *= slower;
    c[i] -= *d * alpha[i];
  }
  /* |alpha| <= 1 by the choice of e; a NaN in d makes every c NaN */
  if (!all_finite(na, c)) return "the magnitudes of the coefficients differ too much";
  if (dt == 0) return NULL; /* the initialisation uses no matrices */
  const double rate = *sigma * dt;
  if (!(rate < 1e12)) return "the step is too long: more than 1e12 times the fastest time constant";
  if (!discretise(na, alpha, rate, work, *hold == 1, A, B0, B1)) return "the output overflows in one step";
  return NULL;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  double sum = *d * *u;
  for (int i = 0; i < na; i++) sum += c[i] * v[i];
  *y = sum;
}
HYST_DERIV_FN(deriv) {
  HYST_OPEN_DERIV
  double top = *u;
  for (int i = 0; i < na; i++) top -= alpha[i] * v[i];
  for (int i = 0; i + 1 < na; i++) d_v[i] = *sigma * v[i + 1];
  d_v[na - 1] = *sigma * top;
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  if (dt == 0) {
    if (*start == 1) v[0] = *u / alpha[0]; /* the other states are derivatives */
    *u_last = *u;
    return;
  }
  double next[MOST_ORDER];
  for (int i = 0; i < na; i++) {
    next[i] = B0[i] * *u_last + B1[i] * *u;
    for (int j = 0; j < na; j++) next[i] += A[i * na + j] * v[j];
  }
  for (int i = 0; i < na; i++) v[i] = next[i];
  *u_last = *u;
}
HYST_FEEDTHROUGH_FN(feedthrough) {
  HYST_OPEN_FEEDTHROUGH
  return nb == na;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  double sum = *d * *s_u, top = *s_u;
  for (int i = 0; i < na; i++) {
    sum += c[i] * s_v[i];
    top -= alpha[i] * s_v[i];
  }
  *t_y = sum;
  for (int i = 0; i + 1 < na; i++) t_v[i] = *sigma * s_v[i + 1];
  t_v[na - 1] = *sigma * top;
}
/* the linear recursion for some columns of rows of n_columns: a constant number of them makes vectors */
static inline void columns_step(int some, int na, int64_t n_columns, const double *A, const double *B0,
                                const double *B1, const double *before, const double *now, double *v) {
  enum { MOST = 8 };
  double next[MOST_ORDER][MOST];
  for (int i = 0; i < na; i++) {
    for (int c = 0; c < some; c++) next[i][c] = B0[i] * before[c] + B1[i] * now[c];
    for (int j = 0; j < na; j++)
      for (int c = 0; c < some; c++) next[i][c] += A[i * na + j] * v[j * n_columns + c];
  }
  for (int i = 0; i < na; i++)
    for (int c = 0; c < some; c++) v[i * n_columns + c] = next[i][c];
}
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  int64_t at = 0;
  for (; dt > 0 && at + 8 <= n_columns; at += 8)
    columns_step(8, na, n_columns, A, B0, B1, s_u_last + at, s_u + at, s_v + at);
  for (; dt > 0 && at < n_columns; at++) columns_step(1, na, n_columns, A, B0, B1, s_u_last + at, s_u + at, s_v + at);
  for (int64_t k = 0; k < n_columns; k++) s_u_last[k] = s_u[k];
  for (int64_t k = 0; k < n_columns && dt == 0 && *start == 1; k++) s_v[k] = s_u[k] / alpha[0];
  for (const hyst_change *e = s_A; e < end_A && dt > 0; e++)
    s_v[e->element / na * n_columns + e->column] += e->size * v[e->element % na];
  for (const hyst_change *e = s_B0; e < end_B0 && dt > 0; e++)
    s_v[e->element * n_columns + e->column] += e->size * *u_last;
  for (const hyst_change *e = s_B1; e < end_B1 && dt > 0; e++) s_v[e->element * n_columns + e->column] += e->size * *u;
  HYST_ADVANCE(update);
  for (const hyst_change *e = s_alpha; e < end_alpha && dt == 0 && *start == 1; e++)
    if (e->element == 0) s_v[e->column] -= e->size * v[0] / alpha[0];
  for (int64_t k = 0; k < n_columns; k++) t_y[k] = *d * s_u[k];
  for (int i = 0; i < na; i++)
    for (int64_t k = 0; k < n_columns; k++) t_y[k] += c[i] * s_v[i * n_columns + k];
  for (const hyst_change *e = s_c; e < end_c; e++) t_y[e->column] += e->size * v[e->element];
  for (const hyst_change *e = s_d; e < end_d; e++) t_y[e->column] += e->size * *u;
}
HYST_BLOCK(transfer_function,
           (.text = "Linear transfer function of any order, discretised exactly",
            .equation = "y = (b_0 s^nb + ... + b_nb) / (a_0 s^na + ... + a_na) u",
            .source = "Van Loan 1978; Franklin, Powell & Workman, 3rd ed., section 6.3.2", .family = "dynamics",
            .tolerance = "rounding", .sensitivity = sensitivity, .derives = 1),
           .rate = HYST_CONTINUOUS, .flags = HYST_STEP, .prepare = prepare, .output = output, .tangent = tangent,
           .deriv = deriv, .update = update, .feedthrough = feedthrough)
