/* Bouc-Wen oscillator: the plant of the nonlinearbenchmark.org hysteretic benchmark (Noel & Schoukens 2016).
 *   m_L y'' + c_L y' + k_L y + z = u,   z' = alpha y' - beta (gamma |y'| |z|^(nu-1) z + delta y' |z|^nu)
 * Newmark's method, gamma = 1/2 and beta = 1/4 (trapezoidal rule), for y and z together, solved by Newton's method;
 * u runs linearly over a step.  A step longer than half a radian of the stiffest oscillation is divided. */
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                              \
  V(m_L, PARAM, 1, "real", "kg", 2.0, 1e-100, 1e100, "mass")                                                 \
  V(c_L, PARAM, 1, "real", "N.s/m", 10.0, 0.0, 1e100, "viscous damping")                                     \
  V(k_L, PARAM, 1, "real", "N/m", 5e4, 0.0, 1e100, "linear stiffness")                                       \
  V(alpha, PARAM, 1, "real", "N/m", 5e4, 0.0, 1e100, "stiffness of the hysteretic force at z = 0")           \
  V(beta, PARAM, 1, "real", "1/m", 1e3, 0.0, 1e100, "weight of the loop (unit of measure valid for nu = 1)") \
  V(gamma, PARAM, 1, "real", "1", 0.8, -1e100, 1e100, "shape of the loop")                                   \
  V(delta, PARAM, 1, "real", "1", -1.1, -1e100, 1e100, "shape of the loop")                                  \
  V(nu, PARAM, 1, "real", "1", 1.0, 1.0, 20.0, "sharpness of the knee")                                      \
  V(u, INPUT, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "force")                                             \
  V(y, OUTPUT, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement")                                     \
  V(z, OUTPUT, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "hysteretic force")                                 \
  V(q, CSTATE, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement")                                     \
  V(v, CSTATE, 1, "real", "m/s", 0.0, -HYST_INF, HYST_INF, "velocity")                                       \
  V(f, CSTATE, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "hysteretic force")                                 \
  V(a, STATE, 1, "real", "m/s2", 0.0, -HYST_INF, HYST_INF, "acceleration")

enum { MOST_STEPS = 10000, MOST_ITERATIONS = 50 };

typedef struct {
  double m, c, k, alpha, beta, gamma, delta, nu;
} plant;
#define PLANT {*m_L, *c_L, *k_L, *alpha, *beta, *gamma, *delta, *nu}

/* z' and its partial derivatives */
typedef struct {
  double rate, by_v, by_f;
} hysteresis;

static inline hysteresis flow(const plant *p, double v, double f) {
  const double size = hyst_fabs(f), less = p->nu == 1 ? 1 : hyst_pow(size, p->nu - 1), more = less * size;
  const double sign_v = v > 0 ? 1 : v < 0 ? -1 : 0, sign_f = f > 0 ? 1 : f < 0 ? -1 : 0;
  const double by_v = p->alpha - p->beta * (p->gamma * sign_v * less * f + p->delta * more);
  const hysteresis z = {by_v * v, by_v, -p->beta * p->nu * less * (p->gamma * hyst_fabs(v) + p->delta * v * sign_f)};
  return z;
}

/* makes one Newmark step of length h to the force u; state: displacement, velocity, hysteretic force, acceleration */
static void newmark(const plant *p, double h, double u, double *q, double *v, double *f, double *a) {
  const double q_p = *q + h * *v + 0.25 * h * h * *a, v_p = *v + 0.5 * h * *a;
  const double f_p = *f + 0.5 * h * flow(p, *v, *f).rate;
  double A = *a, F = *f;
  for (int i = 0; i < MOST_ITERATIONS; i++) {
    const double V = v_p + 0.5 * h * A;
    const hysteresis z = flow(p, V, F);
    /* residuals of the balance of forces and of the trapezoidal rule, and their Jacobian in (A, F) */
    const double r1 = p->m * A + p->c * V + p->k * (q_p + 0.25 * h * h * A) + F - u;
    const double r2 = F - f_p - 0.5 * h * z.rate;
    const double j11 = p->m + 0.5 * h * p->c + 0.25 * h * h * p->k, j21 = -0.25 * h * h * z.by_v;
    const double j22 = 1 - 0.5 * h * z.by_f, determinant = j11 * j22 - j21;
    const double dA = (j22 * r1 - r2) / determinant, dF = (j11 * r2 - j21 * r1) / determinant;
    if (!hyst_isfinite(A - dA) || !hyst_isfinite(F - dF)) break; /* the last finite values are kept */
    A -= dA;
    F -= dF;
    if (hyst_fabs(dA) <= 1e-15 * hyst_fabs(A) && hyst_fabs(dF) <= 1e-15 * hyst_fabs(F)) break;
  }
  *q = q_p + 0.25 * h * h * A;
  *v = v_p + 0.5 * h * A;
  *f = F;
  *a = A;
}

/* number of steps of at most half a radian in dt */
static double divisions(const plant *p, double dt) {
  return 1 + hyst_floor(2 * dt * hyst_sqrt((p->k + p->alpha) / p->m));
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  const plant p = PLANT;
  return divisions(&p, dt) < (double)MOST_STEPS
             ? NULL
             : "the step is too long: it contains thousands of periods of the oscillator";
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *y = *q;
  *z = *f;
}
HYST_DERIV_FN(deriv) {
  HYST_OPEN_DERIV
  const plant p = PLANT;
  *d_q = *v;
  *d_v = (*u - *c_L * *v - *k_L * *q - *f) / *m_L;
  *d_f = flow(&p, *v, *f).rate;
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const plant p = PLANT;
  if (dt > 0) {
    const int steps = (int)divisions(&p, dt);
    const double before = p.m * *a + p.c * *v + p.k * *q + *f; /* the force at the last step, from the balance */
    for (int i = 1; i <= steps; i++)
      newmark(&p, dt / steps, i == steps ? *u : before + (*u - before) * i / steps, q, v, f, a);
  } else {
    *a = (*u - p.c * *v - p.k * *q - *f) / p.m;
  }
}
HYST_FEEDTHROUGH_FN(feedthrough) {
  (void)dim_, (void)p_;
  return 0; /* the outputs are states */
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double size = hyst_fabs(*f), less = *nu == 1 ? 1 : hyst_pow(size, *nu - 1);
  const double d_speed = *v > 0 ? *s_v : *v < 0 ? -*s_v : hyst_fabs(*s_v); /* derivatives of |v| and |f| */
  const double d_size = *f > 0 ? *s_f : *f < 0 ? -*s_f : hyst_fabs(*s_f);
  *t_y = *s_q;
  *t_z = *s_f;
  *t_q = *s_v;
  *t_v = (*s_u - *c_L * *s_v - *k_L * *s_q - *s_f) / *m_L;
  *t_f = *alpha * *s_v -
         *beta * less *
             (*gamma * (d_speed * *f + *nu * hyst_fabs(*v) * *s_f) + *delta * (*s_v * size + *nu * *v * d_size));
}
/* The steps of update(), each with its derivative: that of the balance and of the trapezoidal rule, by the Jacobian of
 * Newton's method. Between the parts of a divided step the force follows from the balance, as in update(). */
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  const plant p = PLANT;
  const int steps = dt > 0 ? (int)divisions(&p, dt) : 0;
  const double h = dt / (steps ? steps : 1), before = p.m * *a + p.c * *v + p.k * *q + *f;
  for (int i = 1; i <= steps; i++) {
    const double q0 = *q, v0 = *v, f0 = *f, a0 = *a, left = i < steps ? 1.0 / (steps - i + 1) : 1;
    const hysteresis z0 = flow(&p, v0, f0);
    newmark(&p, h, i == steps ? *u : before + (*u - before) * i / steps, q, v, f, a);
    const hysteresis z1 = flow(&p, *v, *f);
    /* right-hand sides: t_y of the balance, t_z of the trapezoidal rule */
    for (int64_t c = 0; c < n_columns; c++) {
      const double v_p = s_v[c] + 0.5 * h * s_a[c], q_p = s_q[c] + h * s_v[c] + 0.25 * h * h * s_a[c];
      const double last = p.m * s_a[c] + p.c * s_v[c] + p.k * s_q[c] + s_f[c];
      t_y[c] = (i < steps ? last + (s_u[c] - last) * left : s_u[c]) - p.c * v_p - p.k * q_p;
      t_z[c] = s_f[c] + 0.5 * h * (z0.by_v * s_v[c] + z0.by_f * s_f[c] + z1.by_v * v_p);
    }
    const double rest = i < steps ? 1 - left : 0; /* derivative of the force at the last part of the step */
    for (const hyst_change *e = s_m_L; e < end_m_L; e++) t_y[e->column] += e->size * (rest * a0 - *a);
    for (const hyst_change *e = s_c_L; e < end_c_L; e++) t_y[e->column] += e->size * (rest * v0 - *v);
    for (const hyst_change *e = s_k_L; e < end_k_L; e++) t_y[e->column] += e->size * (rest * q0 - *q);
    const double size0 = hyst_fabs(f0), size1 = hyst_fabs(*f), speed0 = hyst_fabs(v0), speed1 = hyst_fabs(*v);
    const double less0 = *nu == 1 ? 1 : hyst_pow(size0, *nu - 1), less1 = *nu == 1 ? 1 : hyst_pow(size1, *nu - 1);
    const double g0 = speed0 * less0 * f0, g1 = speed1 * less1 * *f, d0 = v0 * less0 * size0, d1 = *v * less1 * size1;
    const double w0 = *gamma * g0 + *delta * d0, w1 = *gamma * g1 + *delta * d1;
    for (const hyst_change *e = s_alpha; e < end_alpha; e++) t_z[e->column] += 0.5 * h * e->size * (v0 + *v);
    for (const hyst_change *e = s_beta; e < end_beta; e++) t_z[e->column] -= 0.5 * h * e->size * (w0 + w1);
    for (const hyst_change *e = s_gamma; e < end_gamma; e++) t_z[e->column] -= 0.5 * h * e->size * *beta * (g0 + g1);
    for (const hyst_change *e = s_delta; e < end_delta; e++) t_z[e->column] -= 0.5 * h * e->size * *beta * (d0 + d1);
    for (const hyst_change *e = s_nu; e < end_nu; e++) {
      const double sum = (size0 > 0 ? w0 * hyst_log(size0) : 0) + (size1 > 0 ? w1 * hyst_log(size1) : 0);
      t_z[e->column] -= 0.5 * h * e->size * *beta * sum;
    }
    const double j11 = p.m + 0.5 * h * p.c + 0.25 * h * h * p.k, j21 = -0.25 * h * h * z1.by_v;
    const double j22 = 1 - 0.5 * h * z1.by_f, determinant = j11 * j22 - j21;
    for (int64_t c = 0; c < n_columns; c++) {
      const double A = (j22 * t_y[c] - t_z[c]) / determinant, F = (j11 * t_z[c] - j21 * t_y[c]) / determinant;
      s_q[c] += h * s_v[c] + 0.25 * h * h * (s_a[c] + A);
      s_v[c] += 0.5 * h * (s_a[c] + A);
      s_f[c] = F;
      s_a[c] = A;
    }
  }
  if (steps == 0) {
    HYST_ADVANCE(update);
    for (int64_t c = 0; c < n_columns; c++) s_a[c] = (s_u[c] - p.c * s_v[c] - p.k * s_q[c] - s_f[c]) / p.m;
    for (const hyst_change *e = s_m_L; e < end_m_L; e++) s_a[e->column] -= e->size * *a / p.m;
    for (const hyst_change *e = s_c_L; e < end_c_L; e++) s_a[e->column] -= e->size * *v / p.m;
    for (const hyst_change *e = s_k_L; e < end_k_L; e++) s_a[e->column] -= e->size * *q / p.m;
  }
  for (int64_t c = 0; c < n_columns; c++) t_y[c] = s_q[c], t_z[c] = s_f[c];
}
HYST_BLOCK(
    bouc_wen_oscillator,
    (.text = "Oscillator with a Bouc-Wen force: the hysteretic benchmark plant",
     .equation = "m_L y'' + c_L y' + k_L y + z = u; z' = alpha y' - beta (gamma |y'| |z|^(nu-1) z + delta y' |z|^nu)",
     .source = "Noel & Schoukens, Hysteretic benchmark with a dynamic nonlinearity, 2016, eq. 1-2",
     .family = "dynamics", .tolerance = "integration", .rule_error = 1e-5, .rule_step = 1e-6, .smooth = 1e-8,
     .hold = "foh", .sensitivity = sensitivity),
    .rate = HYST_CONTINUOUS, .flags = HYST_STEP, .prepare = prepare, .output = output, .tangent = tangent,
    .deriv = deriv, .update = update, .feedthrough = feedthrough)
