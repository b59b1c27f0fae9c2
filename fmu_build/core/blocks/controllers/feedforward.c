/* Inverse of a second-order plant G0(s) = gain / (s^2/omega_n^2 + 2 zeta s/omega_n + 1), from a reference and its
 * derivatives: without differentiation, hence without noise and delay. */
#include "core/elementary/elementary_sine.h"
#include "core/hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                      \
  V(f_n, PARAM, 1, "real", "Hz", 500.0, HYST_POSITIVE, HYST_INF, "natural frequency omega_n / 2 pi") \
  V(zeta, PARAM, 1, "real", "1", 0.7, 0.0, HYST_INF, "damping ratio")                                \
  V(gain, PARAM, 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "static gain of the plant, not 0")        \
  V(r, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "reference")                                 \
  V(dr, INPUT, 1, "real", "1/s", 0.0, -HYST_INF, HYST_INF, "first derivative of r")                  \
  V(ddr, INPUT, 1, "real", "1/s2", 0.0, -HYST_INF, HYST_INF, "second derivative of r")               \
  V(v, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "plant input for the output r")

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  return *gain == 0 ? "gain must not be 0" : NULL;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const double omega_n = HYST_2PI * *f_n;
  *v = (*r + 2 * *zeta / omega_n * *dr + *ddr / omega_n / omega_n) / *gain;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double omega_n = HYST_2PI * *f_n;
  *t_v = (*s_r + 2 * *zeta / omega_n * *s_dr + *s_ddr / omega_n / omega_n) / *gain;
}
HYST_BLOCK(feedforward,
           (.text = "Feed-forward: inverse of a second-order plant",
            .equation = "v = (r + 2 zeta / omega_n r' + r'' / omega_n^2) / gain, omega_n = 2 pi f_n",
            .source = "inverse of G0(s): Yu & Alici 2005 (plant H -> G0)", .family = "controllers",
            .tolerance = "rounding"),
           .rate = HYST_FUNCTION, .prepare = prepare, .output = output, .tangent = tangent)
