/* Piezo amplifier: voltage limits, first-order bandwidth, and a current limit, which bounds the rate of the voltage at
 * the capacitance of the actuator.  Fleming & Leang, Design, Modeling and Control of Nanopositioning Systems, 2014,
 * chapter 14.  The voltage over a step with a held command is exact: a ramp at the current limit, then a lag.
 * `excess` is what the limits take from the command: an anti-windup feeds it back. */
#include "core/elementary/elementary_sine.h"
#include "core/elementary/limit.h"
#include "core/hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                        \
  V(u_min, PARAM, 1, "real", "V", -20.0, -1e300, 1e300, "lowest voltage")                              \
  V(u_max, PARAM, 1, "real", "V", 130.0, -1e300, 1e300, "highest voltage")                             \
  V(i_max, PARAM, 1, "real", "A", 0.25, HYST_POSITIVE, 1e300, "largest current")                       \
  V(C, PARAM, 1, "real", "F", 1.8e-6, HYST_POSITIVE, 1e300, "capacitance of the actuator")             \
  V(f_b, PARAM, 1, "real", "Hz", 1e4, HYST_POSITIVE, 1e12, "bandwidth of small signals (-3 dB)")       \
  V(omega, DERIVED, 1, "real", "rad/s", 1.0, -HYST_INF, HYST_INF, "bandwidth")                         \
  V(most, DERIVED, 1, "real", "V", 1.0, -HYST_INF, HYST_INF, "voltage error at the current limit")     \
  V(u, INPUT, 1, "real", "V", 0.0, -HYST_INF, HYST_INF, "commanded voltage")                           \
  V(y, OUTPUT, 1, "real", "V", 0.0, -HYST_INF, HYST_INF, "voltage at the actuator")                    \
  V(excess, OUTPUT, 1, "real", "V", 0.0, -HYST_INF, HYST_INF, "part of the command beyond the limits") \
  V(voltage, CSTATE, 1, "real", "V", 0.0, -HYST_INF, HYST_INF, "voltage at the actuator")

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  if (*u_min > *u_max) return "u_min must not be greater than u_max";
  *omega = HYST_2PI * *f_b;
  *most = *i_max / *C / *omega;
  return NULL;
}
/* voltage error, limited to what the current can remove at the rate of the lag */
static double driving(double wanted, double voltage, double most) { return hyst_clamp(wanted - voltage, -most, most); }

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const double wanted = hyst_clamp(*u, *u_min, *u_max), error = wanted - *voltage;
  *y = *voltage;
  *excess = (*u - wanted) + (error - driving(wanted, *voltage, *most));
}
HYST_DERIV_FN(deriv) {
  HYST_OPEN_DERIV
  *d_voltage = *omega * driving(hyst_clamp(*u, *u_min, *u_max), *voltage, *most);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  if (dt == 0) return;
  const double wanted = hyst_clamp(*u, *u_min, *u_max), rate = *omega * *most;
  const double error = wanted - *voltage, sign = error < 0 ? -1 : 1, far = hyst_fabs(error) - *most;
  const double ramp = far > 0 ? far / rate : 0; /* time at the current limit */
  if (!(ramp < dt)) *voltage += sign * rate * dt;
  else *voltage = wanted - sign * hyst_clamp(hyst_fabs(error), 0, *most) * hyst_exp(-*omega * (dt - ramp));
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double wanted = hyst_clamp(*u, *u_min, *u_max), error = wanted - *voltage;
  const double s_wanted = hyst_clamp_tangent(*u, *u_min, *u_max, *s_u), s_error = s_wanted - *s_voltage;
  const double s_driving = hyst_clamp_tangent(error, -*most, *most, s_error);
  *t_y = *s_voltage;
  *t_excess = (*s_u - s_wanted) + (s_error - s_driving);
  *t_voltage = *omega * s_driving;
}
HYST_BLOCK(amplifier,
           (.text = "Piezo amplifier with limited voltage, current and bandwidth",
            .equation = "y' = clamp(2 pi f_b (clamp(u, u_min, u_max) - y), -i_max/C, i_max/C)",
            .source = "Fleming & Leang 2014, chapter 14", .family = "dynamics", .tolerance = "rounding"),
           .rate = HYST_CONTINUOUS, .prepare = prepare, .output = output, .tangent = tangent, .deriv = deriv,
           .update = update)
