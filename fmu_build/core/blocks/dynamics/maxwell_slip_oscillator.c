/* Oscillator that is held by a Maxwell-slip friction: springs in parallel, each in series with a slider.
 *   m_L y'' + c_L y' + k_L y + z = u,   z = sum_i k_i s_i,   s_i' = y' while |s_i| < r_i or |s_i| falls, otherwise 0
 * The deflection s_i is a stop of half-width r_i, so that z follows the path of y with the memory of all its
 * reversals.  Velocity Verlet for y, exact stops; u runs linearly over a step.  A step longer than a tenth of a radian
 * of the stiffest oscillation is divided, because a stop yields between two places of y.  Lampaert, Al-Bender &
 * Swevers, IEEE Int. Conf. Control Applications 2003 (Maxwell slip); Krejci & Kuhnen 2001 (the stop). */
#include "core/elementary/elementary.h"
#include "core/elementary/limit.h"
#include "core/hyst.h"

#define DIMS(D) D(n, 4, 1, 1000, "number of springs with a slider")
#define VARS(V)                                                                                      \
  V(m_L, PARAM, 1, "real", "kg", 2.0, 1e-100, 1e100, "mass")                                         \
  V(c_L, PARAM, 1, "real", "N.s/m", 10.0, 0.0, 1e100, "viscous damping")                             \
  V(k_L, PARAM, 1, "real", "N/m", 5e4, 0.0, 1e100, "linear stiffness")                               \
  V(k, PARAM, n, "real", "N/m", 1e4, 0.0, 1e100, "stiffnesses of the springs with a slider")         \
  V(r, PARAM, n, "real", "m", 1e-5, 0.0, 1e100, "deflections at which the sliders yield")            \
  V(u, INPUT, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "force")                                     \
  V(y, OUTPUT, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement")                             \
  V(z, OUTPUT, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "friction force")                           \
  V(q, CSTATE, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement")                             \
  V(v, CSTATE, 1, "real", "m/s", 0.0, -HYST_INF, HYST_INF, "velocity")                               \
  V(s, CSTATE, n, "real", "m", 0.0, -HYST_INF, HYST_INF, "deflections of the springs with a slider") \
  V(u_last, STATE, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "force at the last step")

enum { MOST_STEPS = 50000 };

/* force of all springs; a solver may leave a deflection beyond its end, where the slider has given way */
static double friction(int n, const double *k, const double *r, const double *s) {
  double sum = 0;
  for (int i = 0; i < n; i++) sum += k[i] * hyst_clamp(s[i], -r[i], r[i]);
  return sum;
}

/* returns 1 if the spring takes up a motion in the direction of v */
static int follows(double s, double r, double v) { return v > 0 ? s < r : s > -r; }

/* number of steps of at most a tenth of a radian in dt */
static double divisions(double m, double k_L, int n, const double *k, double dt) {
  double stiff = k_L;
  for (int i = 0; i < n; i++) stiff += k[i];
  return 1 + hyst_floor(10 * dt * hyst_sqrt(stiff / m));
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  return divisions(*m_L, *k_L, n, k, dt) < (double)MOST_STEPS
             ? NULL
             : "the step is too long: it contains hundreds of periods of the oscillator";
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *y = *q;
  *z = friction(n, k, r, s);
}
HYST_DERIV_FN(deriv) {
  HYST_OPEN_DERIV
  *d_q = *v;
  *d_v = (*u - *c_L * *v - *k_L * *q - friction(n, k, r, s)) / *m_L;
  /* NaN stays NaN, which shows the dependence of the derivative */
  for (int i = 0; i < n; i++) d_s[i] = s[i] != s[i] ? s[i] : follows(s[i], r[i], *v) ? *v : 0;
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const int steps = dt > 0 ? (int)divisions(*m_L, *k_L, n, k, dt) : 0;
  const double by = steps ? 0.5 * dt / steps / *m_L : 0, less = 1 / (1 + by * *c_L);
  double before = *u_last - friction(n, k, r, s); /* force without spring and damper */
  for (int j = 1; j <= steps; j++) {
    const double between = *v + by * (before - *c_L * *v - *k_L * *q), dq = 2 * by * *m_L * between;
    *q += dq;
    for (int i = 0; i < n; i++) s[i] = hyst_clamp(hyst_clamp(s[i], -r[i], r[i]) + dq, -r[i], r[i]);
    before = (j == steps ? *u : *u_last + (*u - *u_last) * j / steps) - friction(n, k, r, s);
    *v = less * (between + by * (before - *k_L * *q));
  }
  *u_last = *u;
}
HYST_FEEDTHROUGH_FN(feedthrough) {
  (void)dim_, (void)p_;
  return 0; /* the outputs are states */
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  double sum = 0;
  for (int i = 0; i < n; i++) {
    sum += k[i] * hyst_clamp_tangent(s[i], -r[i], r[i], s_s[i]);
    t_s[i] = follows(s[i], r[i], *v != 0 ? *v : *s_v) ? *s_v : 0;
  }
  *t_y = *s_q;
  *t_z = sum;
  *t_q = *s_v;
  *t_v = (*s_u - *c_L * *s_v - *k_L * *s_q - sum) / *m_L;
}
/* The steps of update(), each with its derivative.  t_y: of the velocity between, t_z: of the friction force.  A spring
 * whose slider yields keeps the derivative of its end. */
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  const int steps = dt > 0 ? (int)divisions(*m_L, *k_L, n, k, dt) : 0;
  const double half = steps ? 0.5 * dt / steps : 0, by = half / *m_L, less = 1 / (1 + by * *c_L);
  double before = *u_last - friction(n, k, r, s);
  for (int j = 0; j <= steps; j++) {
    if (j > 0) {
      const double v0 = *v, q0 = *q, between = *v + by * (before - *c_L * *v - *k_L * *q), dq = 2 * half * between;
      const double done = (double)(j - 1) / steps, next = j == steps ? 1 : (double)j / steps;
      for (int64_t c = 0; c < n_columns; c++) {
        const double was = s_u_last[c] + (s_u[c] - s_u_last[c]) * done - t_z[c];
        t_y[c] = s_v[c] + by * (was - *c_L * s_v[c] - *k_L * s_q[c]);
      }
      for (const hyst_change *e = s_m_L; e < end_m_L; e++) t_y[e->column] -= e->size * (between - v0) / *m_L;
      for (const hyst_change *e = s_c_L; e < end_c_L; e++) t_y[e->column] -= e->size * by * v0;
      for (const hyst_change *e = s_k_L; e < end_k_L; e++) t_y[e->column] -= e->size * by * q0;
      for (int64_t c = 0; c < n_columns; c++) s_q[c] += 2 * half * t_y[c];
      *q += dq;
      for (int i = 0; i < n; i++) {
        const double moved = hyst_clamp(s[i], -r[i], r[i]) + dq, yields = moved >= r[i] || moved <= -r[i];
        double *const row = s_s + i * n_columns;
        for (int64_t c = 0; c < n_columns; c++) row[c] = yields ? 0 : row[c] + 2 * half * t_y[c];
        s[i] = hyst_clamp(moved, -r[i], r[i]);
      }
      for (const hyst_change *e = s_r; e < end_r; e++)
        if (hyst_fabs(s[e->element]) == r[e->element])
          s_s[e->element * n_columns + e->column] = hyst_copysign(e->size, s[e->element] * e->size);
      before = (j == steps ? *u : *u_last + (*u - *u_last) * j / steps) - friction(n, k, r, s);
      *v = less * (between + by * (before - *k_L * *q));
      for (int64_t c = 0; c < n_columns; c++)
        s_v[c] = t_y[c] + by * (s_u_last[c] + (s_u[c] - s_u_last[c]) * next - *k_L * s_q[c]);
    }
    for (int64_t c = 0; c < n_columns; c++) t_z[c] = 0;
    for (int i = 0; i < n; i++)
      for (int64_t c = 0; c < n_columns; c++) t_z[c] += k[i] * s_s[i * n_columns + c];
    for (const hyst_change *e = s_k; e < end_k; e++) t_z[e->column] += e->size * s[e->element];
    if (j == 0) continue;
    for (int64_t c = 0; c < n_columns; c++) s_v[c] = less * (s_v[c] - by * t_z[c]);
    for (const hyst_change *e = s_m_L; e < end_m_L; e++)
      s_v[e->column] -= e->size * less * by / *m_L * (before - *k_L * *q - *c_L * *v);
    for (const hyst_change *e = s_c_L; e < end_c_L; e++) s_v[e->column] -= e->size * less * by * *v;
    for (const hyst_change *e = s_k_L; e < end_k_L; e++) s_v[e->column] -= e->size * less * by * *q;
  }
  *u_last = *u;
  for (int64_t c = 0; c < n_columns; c++) s_u_last[c] = s_u[c], t_y[c] = s_q[c];
}
HYST_BLOCK(maxwell_slip_oscillator,
           (.text = "Oscillator with Maxwell-slip friction",
            .equation = "m_L y'' + c_L y' + k_L y + z = u; z = sum_i k_i s_i, s_i a stop of half-width r_i of y",
            .source = "Lampaert, Al-Bender & Swevers 2003 (Maxwell slip); Krejci & Kuhnen 2001 (the stop)",
            .family = "dynamics", .tolerance = "integration", .rule_error = 1e-5, .rule_step = 1e-6, .smooth = 1e-8,
            .hold = "foh", .sensitivity = sensitivity),
           .rate = HYST_CONTINUOUS, .flags = HYST_STEP, .prepare = prepare, .output = output, .tangent = tangent,
           .deriv = deriv, .update = update, .feedthrough = feedthrough)
