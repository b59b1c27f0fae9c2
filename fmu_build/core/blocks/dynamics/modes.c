/* Second-order modes in parallel, discretised exactly for an input that is held over the step: a lightly damped stage
 * by its natural frequencies, damping ratios and static gains, each of which may be varied alone.
 * Modal form: Preumont, Vibration Control of Active Structures, 3rd ed. 2011, section 2.4.  States of a mode are its
 * displacement q and its velocity over omega. */
#include "core/elementary/elementary_sine.h"
#include "core/elementary/matrix_exponential.h"

#define DIMS(D) D(n, 1, 1, 1000, "number of modes")
#define VARS(V)                                                                                               \
  V(f_n, FIXED, n, "real", "Hz", 1.0, HYST_POSITIVE, 1e12, "natural frequencies")                             \
  V(zeta, FIXED, n, "real", "1", 0.02, 0.0, 1e6, "damping ratios")                                            \
  V(k, PARAM, n, "real", "1", 1.0, -HYST_INF, HYST_INF, "static gains")                                       \
  V(A, DERIVED, 4 * n, "real", "1", 0.0, -HYST_INF, HYST_INF, "state matrices over a step, row by row")       \
  V(B, DERIVED, 2 * n, "real", "1", 0.0, -HYST_INF, HYST_INF, "weights of an input that is held over a step") \
  V(work, DERIVED, HYST_EXPM_WORK(3), "real", "1", 0.0, -HYST_INF, HYST_INF, "workspace for matrices")        \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                              \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "sum of the modes")                                  \
  V(q, CSTATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "displacements of the modes, not multiplied by k")   \
  V(v, CSTATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "velocities of the modes / omega")

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  if (dt == 0) return NULL; /* the initialisation uses no matrices */
  for (int i = 0; i < n; i++) {
    const double turn = HYST_2PI * f_n[i] * dt;
    if (!(turn * (1 + zeta[i]) < 1e12)) return "the step is too long for the fastest mode (more than 1e12 radians)";
    hyst_dd *M = (hyst_dd *)work;
    for (int j = 0; j < 9; j++) M[j] = hyst_dd_of(0);
    M[1] = M[5] = hyst_dd_of(turn);
    M[3] = hyst_dd_of(-turn);
    M[4] = hyst_dd_of(-2 * zeta[i] * turn);
    const hyst_dd *E = hyst_expm(3, work);
    if (!E) return "the output overflows in one step";
    for (int j = 0; j < 4; j++) A[4 * i + j] = E[3 * (j / 2) + j % 2].hi;
    for (int j = 0; j < 2; j++) B[2 * i + j] = E[3 * j + 2].hi;
  }
  return NULL;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  double sum = 0;
  for (int i = 0; i < n; i++) sum += k[i] * q[i];
  *y = sum;
}
HYST_DERIV_FN(deriv) {
  HYST_OPEN_DERIV
  for (int i = 0; i < n; i++) {
    const double omega = HYST_2PI * f_n[i];
    d_q[i] = omega * v[i];
    d_v[i] = omega * (*u - q[i] - 2 * zeta[i] * v[i]);
  }
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  if (dt == 0) return;
  for (int i = 0; i < n; i++) {
    const double *a = A + 4 * i, *b = B + 2 * i, q_last = q[i];
    q[i] = a[0] * q_last + a[1] * v[i] + b[0] * *u;
    v[i] = a[2] * q_last + a[3] * v[i] + b[1] * *u;
  }
}
HYST_FEEDTHROUGH_FN(feedthrough) {
  HYST_OPEN_FEEDTHROUGH
  return 0;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  double sum = 0;
  for (int i = 0; i < n; i++) {
    const double omega = HYST_2PI * f_n[i];
    sum += k[i] * s_q[i];
    t_q[i] = omega * s_v[i];
    t_v[i] = omega * (*s_u - s_q[i] - 2 * zeta[i] * s_v[i]);
  }
  *t_y = sum;
}
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  for (int i = 0; i < n && dt > 0; i++) {
    const double *const a = A + 4 * i, *const b = B + 2 * i;
    double *const row_q = s_q + i * n_columns, *const row_v = s_v + i * n_columns;
    for (int64_t c = 0; c < n_columns; c++) {
      const double last = row_q[c];
      row_q[c] = a[0] * last + a[1] * row_v[c] + b[0] * s_u[c];
      row_v[c] = a[2] * last + a[3] * row_v[c] + b[1] * s_u[c];
    }
  }
  for (; s_A < end_A && dt > 0; s_A++) {
    const int i = s_A->element / 4, j = s_A->element % 4;
    (j < 2 ? s_q : s_v)[i * n_columns + s_A->column] += s_A->size * (j % 2 ? v : q)[i];
  }
  for (; s_B < end_B && dt > 0; s_B++)
    (s_B->element % 2 ? s_v : s_q)[s_B->element / 2 * n_columns + s_B->column] += s_B->size * *u;
  HYST_ADVANCE(update);
  for (int64_t c = 0; c < n_columns; c++) t_y[c] = 0;
  for (int i = 0; i < n; i++)
    for (int64_t c = 0; c < n_columns; c++) t_y[c] += k[i] * s_q[i * n_columns + c];
  for (; s_k < end_k; s_k++) t_y[s_k->column] += s_k->size * q[s_k->element];
}
HYST_BLOCK(modes,
           (.text = "Second-order modes in parallel, discretised exactly",
            .equation = "y = sum_i k_i omega_i^2 / (s^2 + 2 zeta_i omega_i s + omega_i^2) u, omega_i = 2 pi f_n_i",
            .source = "Preumont 2011, section 2.4", .family = "dynamics", .tolerance = "rounding",
            .sensitivity = sensitivity, .derives = 1),
           .rate = HYST_CONTINUOUS, .flags = HYST_STEP, .prepare = prepare, .output = output, .tangent = tangent,
           .deriv = deriv, .update = update, .feedthrough = feedthrough)
