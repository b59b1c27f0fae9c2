/* LuGre friction: the force of elastic bristles over the displacement u of one surface along the other.
 *   z' = v - |v| z / d(v),   d(v) = d_c + (d_s - d_c) e^(-(v/v_s)^2),   v = u'
 *   y = sigma_0 z + sigma_1 z' + sigma_2 v
 * The deflection of steady motion d is g / sigma_0 for the force g of the paper, so that y is linear in all sigma. u is
 * a ramp over a step. At constant velocity, z approaches sgn(v) d(v) exponentially along the path of u. Therefore a
 * step of any length is exact, also for stiff bristles. The model of Dahl has d_s = d_c and sigma_1 = 0. Canudas de
 * Wit, Olsson, Astrom & Lischinsky, IEEE Trans. Automat. Control 40 (1995) 419-425. The output depends on the current
 * input, so the state holds the last step and its start values. */
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                                 \
  V(sigma_0, PARAM, 1, "real", "N/m", 10.0, -HYST_INF, HYST_INF, "stiffness of the bristles")                   \
  V(sigma_1, PARAM, 1, "real", "N.s/m", 0.1, -HYST_INF, HYST_INF, "damping of the bristles")                    \
  V(sigma_2, PARAM, 1, "real", "N.s/m", 0.1, -HYST_INF, HYST_INF, "viscous friction")                           \
  V(d_c, PARAM, 1, "real", "m", 0.1, 1e-100, 1e100, "deflection in fast motion: Coulomb friction over sigma_0") \
  V(d_s, PARAM, 1, "real", "m", 0.15, 1e-100, 1e100, "deflection in slow motion: static friction over sigma_0") \
  V(v_s, PARAM, 1, "real", "m/s", 0.5, 1e-100, 1e100, "Stribeck velocity")                                      \
  V(z0, FIXED, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "initial deflection of the bristles")                  \
  V(u, INPUT, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement")                                         \
  V(y, OUTPUT, 1, "real", "N", 0.0, -HYST_INF, HYST_INF, "friction force")                                      \
  V(step, STATE, 1, "real", "s", 0.0, 0.0, HYST_INF, "last step")                                               \
  V(u_end, STATE, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement at the end of the last step")         \
  V(u_begin, STATE, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "displacement at the start of the last step")     \
  V(z_begin, STATE, 1, "real", "m", 0.0, -HYST_INF, HYST_INF, "deflection at the start of the last step")

typedef struct {
  double v, d, share, left, z; /* left: part of the deflection z_begin - sgn(v) d at the end of the ramp */
} ramp;
static ramp along(double d_c, double d_s, double v_s, double z_begin, double du, double step) {
  ramp r = {0, d_s, 1, 1, z_begin};
  if (step > 0) {
    r.v = du / step;
    r.share = hyst_exp(-(r.v / v_s) * (r.v / v_s));
    r.d = d_c + (d_s - d_c) * r.share;
    r.left = hyst_expm1(-hyst_fabs(du) / r.d);
    r.z -= r.left * (hyst_copysign(r.d, du) - z_begin);
    r.left += 1;
  }
  return r;
}

HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  *z_begin = *z0;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const ramp r = along(*d_c, *d_s, *v_s, *z_begin, *u - *u_begin, *step);
  *y = *sigma_0 * r.z + *sigma_1 * (r.v - hyst_fabs(r.v) / r.d * r.z) + *sigma_2 * r.v;
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  *z_begin = along(*d_c, *d_s, *v_s, *z_begin, *u_end - *u_begin, *step).z;
  *u_begin = *u_end;
  *u_end = *u;
  *step = dt;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double du = *u - *u_begin, s = du > 0 || (du == 0 && *s_u > 0) ? 1 : -1;
  const ramp r = along(*d_c, *d_s, *v_s, *z_begin, du, *step);
  const double t_v = *step > 0 ? *s_u / *step : 0, to = s * r.d - *z_begin;
  const double t_d = r.share > 0 ? -2 * r.v / *v_s * r.share / *v_s * (*d_s - *d_c) * t_v : 0;
  const double t_path = *step > 0 ? (s * *s_u - s * du / r.d * t_d) / r.d : 0;
  const double t_z = (1 - r.left) * s * t_d + r.left * to * t_path;
  const double t_rate = t_v - (s * t_v * r.z + s * r.v * (t_z - r.z / r.d * t_d)) / r.d;
  *t_y = *sigma_0 * t_z + *sigma_1 * t_rate + *sigma_2 * t_v;
}
HYST_BLOCK(
    lugre,
    (.text = "LuGre friction: bristles with a Stribeck curve",
     .equation =
         "z' = v - |v| z / d, d = d_c + (d_s - d_c) e^(-(v/v_s)^2), y = sigma_0 z + sigma_1 z' + sigma_2 v, v = u'",
     .source = "Canudas de Wit, Olsson, Astrom & Lischinsky 1995, with d = g / sigma_0", .family = "dynamics",
     .tolerance = "rounding"),
    .rate = HYST_SAMPLED, .init = init, .output = output, .tangent = tangent, .update = update)
