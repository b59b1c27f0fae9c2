/* Modified Bouc-Wen model of a magnetorheological damper: the force over the displacement u of the piston.
 *   c_1 w' = alpha z + k_0 d + c_0 d',   d = u - w,   z' = A d' - gamma |d'| |z|^(n-1) z - beta d' |z|^n
 *   y = c_1 w' + k_1 (u - x_0)
 * A Bouc-Wen operator, a spring and a dashpot in parallel act on the deflection d. They are in series with the dashpot
 * c_1, whose displacement is w, and a second spring is parallel to both. u is a ramp over a step, which is divided into
 * Runge-Kutta steps of order 4; each is shorter than a quarter of the time constants and of the path to saturation. z
 * is limited to z_max = (A / (beta + gamma))^(1/n). Spencer, Dyke, Sain & Carlson, J. Eng. Mech. 123 (1997) 230-238.
 * The output depends on the current input, so the state holds the last step and its start values. */
#include "core/elementary/elementary.h"
#include "core/elementary/limit.h"
#include "core/hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                                 \
  V(c_0, PARAM, 1, "real", "N.s/m", 0.1, 0.0, 1e100, "damping parallel to the operator")                        \
  V(c_1, PARAM, 1, "real", "N.s/m", 2.0, 1e-100, 1e100, "damping in series with the operator")                  \
  V(k_0, PARAM, 1, "real", "N/m", 0.2, 0.0, 1e100, "stiffness parallel to the operator")                        \
  V(k_1, PARAM, 1, "real", "N/m", 0.05, -HYST_INF, HYST_INF, "stiffness parallel to both dashpots")             \
  V(x_0, PARAM, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "offset: displacement at which k_1 has no force")     \
  V(alpha, PARAM, 1, "real", "N/m", 5.0, 0.0, 1e100, "weight of z in the force")                                \
  V(A, PARAM, 1, "real", "1", 1.0, 1e-100, 1e100, "slope of z at z = 0")                                        \
  V(beta, PARAM, 1, "real", "1/m2", 4.0, -1e100, 1e100, "shape of the loop; beta + gamma > 0 (unit for n = 2)") \
  V(gamma, PARAM, 1, "real", "1/m2", 4.0, 0.0, 1e100, "width of the loop (unit for n = 2)")                     \
  V(n, PARAM, 1, "real", "1", 2.0, 1.0, 20.0, "sharpness of the knee")                                          \
  V(z0, FIXED, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "initial z; at most z_max in absolute value")          \
  V(z_max, DERIVED, 1, "real", "m", 0.0, 0.0, HYST_INF, "bound of z")                                           \
  V(u, INPUT, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement")                                         \
  V(y, OUTPUT, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "force")                                               \
  V(step, STATE, 1, "real", "s", 0.0, 0.0, HYST_INF, "last step")                                               \
  V(u_end, STATE, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement at the end of the last step")         \
  V(u_begin, STATE, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement at the start of the last step")     \
  V(d_begin, STATE, 1, "real", "m", 0.0, -HYST_INF, HYST_INF,                                                   \
    "deflection of the operator at the start of the last step")                                                 \
  V(z_begin, STATE, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "z at the start of the last step")

enum { MOST_STEPS = 400, PER_CONSTANT = 4 };

/* coefficients of w' = by_v v + by_d d + by_z z, and of the operator: beta and gamma over their sum */
typedef struct {
  double by_v, by_d, by_z, A, beta, gamma, n, z_max;
} damper;
#define DAMPER                \
  {*c_0 / (*c_0 + *c_1),      \
   *k_0 / (*c_0 + *c_1),      \
   *alpha / (*c_0 + *c_1),    \
   *A,                        \
   *beta / (*beta + *gamma),  \
   *gamma / (*beta + *gamma), \
   *n,                        \
   *z_max}

/* deflection d and z, or their rates, with tangents */
typedef struct {
  double d, z, t_d, t_z;
} point;

static double series(const damper *p, double v, double d, double z) { return p->by_v * v + p->by_d * d + p->by_z * z; }
static double sign(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

static point rate(const damper *p, double v, double t_v, point x) {
  const double z = hyst_clamp(x.z, -p->z_max, p->z_max), t_z = hyst_clamp_tangent(x.z, -p->z_max, p->z_max, x.t_z);
  const double slip = v - series(p, v, x.d, z), t_slip = t_v - series(p, t_v, x.t_d, t_z), size = hyst_fabs(z);
  const double less = p->n == 1 ? 1 : hyst_pow(size / p->z_max, p->n - 1), full = less * size / p->z_max;
  const double turned = sign(slip != 0 ? slip : t_slip), to = sign(z != 0 ? z : t_z),
               bend = p->beta + p->gamma * turned * to;
  const double t_full = p->n * less / p->z_max * to * t_z;
  const point found = {slip, p->A * slip * (1 - bend * full), t_slip,
                       p->A * (t_slip * (1 - bend * full) - slip * bend * t_full)};
  return found;
}
static point plus(point x, double h, point r) {
  const point sum = {x.d + h * r.d, x.z + h * r.z, x.t_d + h * r.t_d, x.t_z + h * r.t_z};
  return sum;
}

/* advances x over a ramp of length du, which takes dt > 0 */
static point along(const damper *p, point x, double du, double t_du, double dt) {
  const double way = (1 - p->by_v) * hyst_fabs(du) + dt * (p->by_d * hyst_fabs(x.d) + p->by_z * p->z_max);
  const double wanted = (double)PER_CONSTANT * (p->n * p->A / p->z_max * way + dt * (p->by_d + p->by_z * p->A));
  const int steps = wanted < (double)MOST_STEPS ? 1 + (int)wanted : MOST_STEPS;
  const double h = dt / steps, v = du / dt, t_v = t_du / dt;
  for (int i = 0; i < steps; i++) {
    const point k1 = rate(p, v, t_v, x), k2 = rate(p, v, t_v, plus(x, 0.5 * h, k1)),
                k3 = rate(p, v, t_v, plus(x, 0.5 * h, k2)), k4 = rate(p, v, t_v, plus(x, h, k3));
    x = plus(x, h / 6, plus(plus(k1, 2, plus(k2, 1, k3)), 1, k4));
    x.t_z = hyst_clamp_tangent(x.z, -p->z_max, p->z_max, x.t_z);
    x.z = hyst_clamp(x.z, -p->z_max, p->z_max);
  }
  return x;
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  if (!(*beta + *gamma > 0)) return "beta + gamma must be greater than 0";
  *z_max = hyst_pow(*A / (*beta + *gamma), 1 / *n);
  return (double)PER_CONSTANT * dt * (*k_0 + *alpha * *A) / (*c_0 + *c_1) < (double)MOST_STEPS
             ? NULL
             : "the step is too long: it contains a hundred time constants of the dashpots";
}
HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  *z_begin = hyst_clamp(*z0, -*z_max, *z_max);
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const damper p = DAMPER;
  const double du = *u - *u_begin;
  point x = {*d_begin, *z_begin, 0, 0};
  if (*step > 0) x = along(&p, x, du, 0, *step);
  *y = *c_1 * series(&p, *step > 0 ? du / *step : 0, x.d, x.z) + *k_1 * (*u - *x_0);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const damper p = DAMPER;
  point x = {*d_begin, *z_begin, 0, 0};
  if (*step > 0) x = along(&p, x, *u_end - *u_begin, 0, *step);
  *d_begin = x.d;
  *z_begin = x.z;
  *u_begin = *u_end;
  *u_end = *u;
  *step = dt;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const damper p = DAMPER;
  point x = {*d_begin, *z_begin, 0, 0};
  if (*step > 0) x = along(&p, x, *u - *u_begin, *s_u, *step);
  *t_y = *c_1 * series(&p, *step > 0 ? *s_u / *step : 0, x.t_d, x.t_z) + *k_1 * *s_u;
}
HYST_BLOCK(
    modified_bouc_wen,
    (.text = "Modified Bouc-Wen model of a magnetorheological damper",
     .equation = "c_1 w' = alpha z + k_0 d + c_0 d', d = u - w, z' = A d' - gamma |d'| |z|^(n-1) z - beta d' |z|^n, "
                 "y = c_1 w' + k_1 (u - x_0)",
     .source = "Spencer, Dyke, Sain & Carlson 1997", .family = "dynamics", .tolerance = "integration",
     .rule_error = 1e-4),
    .rate = HYST_SAMPLED, .flags = HYST_STEP, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
    .update = update)
