/* Oscillator with a Duhem force of any shape, not only that of the law of Bouc and Wen:
 *   m_L y'' + c_L y' + k_L y + z = u,   dz/dy = f(s z), s = sgn(y')
 * f is piecewise linear on n equal knots over [-z_max, z_max], constant beyond them, and the same for both directions
 * of motion.  With f(-x) >= f(x) and f(-x) > 0 for x >= 0 the force is passive: it stores at most
 * S(z) = integral of x/f(-x) over x = 0..|z|.  Velocity Verlet for y, the explicit midpoint rule for z, both of second
 * order; u runs linearly over a step.  A step longer than half a radian of the stiffest oscillation is divided. */
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define DIMS(D) D(n, 5, 2, 1000, "number of knots of f")
#define VARS(V)                                                                                       \
  V(m_L, PARAM, 1, "real", "kg", 2.0, 1e-100, 1e100, "mass")                                          \
  V(c_L, PARAM, 1, "real", "N.s/m", 10.0, 0.0, 1e100, "viscous damping")                              \
  V(k_L, PARAM, 1, "real", "N/m", 5e4, 0.0, 1e100, "linear stiffness")                                \
  V(f, PARAM, n, "real", "N/m", 5e4, -1e100, 1e100, "stiffness of the hysteretic force at the knots") \
  V(z_max, PARAM, 1, "real", "N", 100.0, 1e-100, 1e100, "largest knot; the smallest is -z_max")       \
  V(u, INPUT, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "force")                                      \
  V(y, OUTPUT, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement")                              \
  V(z, OUTPUT, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "hysteretic force")                          \
  V(q, CSTATE, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement")                              \
  V(v, CSTATE, 1, "real", "m/s", 0.0, -HYST_INF, HYST_INF, "velocity")                                \
  V(g, CSTATE, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "hysteretic force")                          \
  V(u_last, STATE, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "input at the last step")

enum { MOST_STEPS = 10000 };

typedef struct {
  const double *f;
  double z_max;
  int last; /* index of the last knot */
} shape;
#define SHAPE {f, *z_max, n - 1}

/* f at x, and its derivative towards the sign of `way` */
static double stiffness(const shape *s, double x) {
  const double at = 0.5 * (x / s->z_max + 1) * s->last;
  if (!(at > 0)) return at != at ? at : s->f[0]; /* NaN stays NaN, which shows the dependence of the derivative */
  if (at >= s->last) return s->f[s->last];
  const int i = (int)at;
  return s->f[i] + (at - i) * (s->f[i + 1] - s->f[i]);
}

static double stiffness_slope(const shape *s, double x, double way) {
  const double at = 0.5 * (x / s->z_max + 1) * s->last;
  if (!(at >= 0 && at <= s->last)) return 0;
  const int i = (int)at - (way < 0 && at == (int)at);
  return i < 0 || i == s->last ? 0 : (s->f[i + 1] - s->f[i]) * (0.5 * s->last / s->z_max);
}

/* number of steps of at most half a radian in dt */
static double divisions(const shape *s, double m, double k, double dt) {
  double most = 0;
  for (int i = 0; i <= s->last; i++)
    if (s->f[i] > most) most = s->f[i];
  return 1 + hyst_floor(2 * dt * hyst_sqrt((k + most) / m));
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  const shape s = SHAPE;
  return divisions(&s, *m_L, *k_L, dt) < (double)MOST_STEPS
             ? NULL
             : "the step is too long: it contains thousands of periods of the oscillator";
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *y = *q;
  *z = *g;
}
HYST_DERIV_FN(deriv) {
  HYST_OPEN_DERIV
  const shape s = SHAPE;
  *d_q = *v;
  *d_v = (*u - *c_L * *v - *k_L * *q - *g) / *m_L;
  *d_g = *v * stiffness(&s, *v > 0 ? *g : -*g);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const shape s = SHAPE;
  const int steps = dt > 0 ? (int)divisions(&s, *m_L, *k_L, dt) : 0;
  const double half = steps ? 0.5 * dt / steps : 0, rise = steps ? (*u - *u_last) / steps : 0;
  double force = *u_last;
  for (int i = 1; i <= steps; i++) {
    const double between = *v + half / *m_L * (force - *c_L * *v - *k_L * *q - *g), dq = 2 * half * between;
    const double sign = between > 0 ? 1 : -1, middle = *g + 0.5 * dq * stiffness(&s, sign * *g);
    *g += dq * stiffness(&s, sign * middle);
    *q += dq;
    force = i == steps ? *u : *u_last + rise * i;
    *v = (between + half / *m_L * (force - *k_L * *q - *g)) / (1 + half * *c_L / *m_L);
  }
  *u_last = *u;
}
HYST_FEEDTHROUGH_FN(feedthrough) {
  (void)dim_, (void)p_;
  return 0; /* the outputs are states */
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const shape s = SHAPE;
  const int onwards = *v > 0 || (*v == 0 && *s_v > 0);
  const double sign = onwards ? 1 : -1, x = sign * *g, way = sign * *s_g;
  *t_y = *s_q;
  *t_z = *s_g;
  *t_q = *s_v;
  *t_v = (*s_u - *c_L * *s_v - *k_L * *s_q - *s_g) / *m_L;
  *t_g = *s_v * stiffness(&s, x) + *v * stiffness_slope(&s, x, way) * way;
}
/* weight of knot k in the piecewise linear f(x) */
static double share(const shape *s, double x, int k) {
  const double at = 0.5 * (x / s->z_max + 1) * s->last, off = hyst_fabs((at > 0 ? at < s->last ? at : s->last : 0) - k);
  return off < 1 ? 1 - off : 0;
}
/* The steps of update(), each with its derivative: t_y of the velocity at half the step, t_z of z at half the step. */
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  const shape s = SHAPE;
  const int steps = dt > 0 ? (int)divisions(&s, *m_L, *k_L, dt) : 0;
  const double half = steps ? 0.5 * dt / steps : 0, rise = steps ? (*u - *u_last) / steps : 0;
  const double by = half / *m_L, less = 1 / (1 + by * *c_L);
  double force = *u_last;
  for (int i = 1; i <= steps; i++) {
    const double v0 = *v, q0 = *q, between = *v + by * (force - *c_L * *v - *k_L * *q - *g), dq = 2 * half * between;
    const double sign = between > 0 ? 1 : -1, x0 = sign * *g, f0 = stiffness(&s, x0), middle = *g + 0.5 * dq * f0;
    const double x1 = sign * middle, f1 = stiffness(&s, x1), way = between; /* change of z by f and the motion */
    const double slope0 = sign * stiffness_slope(&s, x0, way * f0 * sign);
    const double slope1 = sign * stiffness_slope(&s, x1, way * f1 * sign);
    const double done = (double)(i - 1) / steps, next = i == steps ? 1 : (double)i / steps;
    for (int64_t c = 0; c < n_columns; c++) {
      const double was = s_u_last[c] + (s_u[c] - s_u_last[c]) * done;
      t_y[c] = s_v[c] + by * (was - *c_L * s_v[c] - *k_L * s_q[c] - s_g[c]);
    }
    for (const hyst_change *e = s_m_L; e < end_m_L; e++) t_y[e->column] -= e->size * (between - v0) / *m_L;
    for (const hyst_change *e = s_c_L; e < end_c_L; e++) t_y[e->column] -= e->size * by * v0;
    for (const hyst_change *e = s_k_L; e < end_k_L; e++) t_y[e->column] -= e->size * by * q0;
    for (int64_t c = 0; c < n_columns; c++) t_z[c] = s_g[c] + half * t_y[c] * f0 + 0.5 * dq * slope0 * s_g[c];
    for (const hyst_change *e = s_f; e < end_f; e++) t_z[e->column] += 0.5 * dq * e->size * share(&s, x0, e->element);
    for (const hyst_change *e = s_z_max; e < end_z_max; e++)
      t_z[e->column] -= 0.5 * dq * e->size * slope0 * *g / *z_max;
    for (int64_t c = 0; c < n_columns; c++) s_g[c] += 2 * half * t_y[c] * f1 + dq * slope1 * t_z[c];
    for (const hyst_change *e = s_f; e < end_f; e++) s_g[e->column] += dq * e->size * share(&s, x1, e->element);
    for (const hyst_change *e = s_z_max; e < end_z_max; e++) s_g[e->column] -= dq * e->size * slope1 * middle / *z_max;
    *g += dq * f1;
    *q += dq;
    force = i == steps ? *u : *u_last + rise * i;
    *v = (between + by * (force - *k_L * *q - *g)) / (1 + half * *c_L / *m_L);
    for (int64_t c = 0; c < n_columns; c++) {
      s_q[c] += 2 * half * t_y[c];
      const double is = s_u_last[c] + (s_u[c] - s_u_last[c]) * next;
      s_v[c] = less * (t_y[c] + by * (is - *k_L * s_q[c] - s_g[c]));
    }
    for (const hyst_change *e = s_m_L; e < end_m_L; e++)
      s_v[e->column] -= e->size * less * by / *m_L * (force - *k_L * *q - *g - *c_L * *v);
    for (const hyst_change *e = s_c_L; e < end_c_L; e++) s_v[e->column] -= e->size * less * by * *v;
    for (const hyst_change *e = s_k_L; e < end_k_L; e++) s_v[e->column] -= e->size * less * by * *q;
  }
  *u_last = *u;
  for (int64_t c = 0; c < n_columns; c++) s_u_last[c] = s_u[c], t_y[c] = s_q[c], t_z[c] = s_g[c];
}
HYST_BLOCK(duhem_oscillator,
           (.text = "Oscillator with a Duhem force of any shape",
            .equation = "m_L y'' + c_L y' + k_L y + z = u; dz/dy = f(s z), s = sgn(y'), f linear between its knots",
            .source = "Oh & Bernstein 2005 (Duhem's form); Noel & Schoukens 2016 (the oscillator)",
            .family = "dynamics", .tolerance = "integration", .rule_error = 1e-5, .rule_step = 1e-6, .smooth = 1e-8,
            .hold = "foh", .sensitivity = sensitivity),
           .rate = HYST_CONTINUOUS, .flags = HYST_STEP, .prepare = prepare, .output = output, .tangent = tangent,
           .deriv = deriv, .update = update, .feedthrough = feedthrough)
