/* Disturbance: a step at a time plus a sine. */
#include "core/blocks/sources/waveform.h"

#define DIMS(D)
#define VARS(V)                                                                          \
  V(step, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "height of the step")         \
  V(t_step, PARAM, 1, "real", "s", 0.0, -HYST_INF, HYST_INF, "time of the step")         \
  V(amplitude, PARAM, 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "amplitude of the sine") \
  V(frequency, PARAM, 1, "real", "Hz", 1.0, 0.0, 1e12, "frequency of the sine")          \
  V(phase, PARAM, 1, "real", "rad", 0.0, -1e12, 1e12, "phase of the sine at time 0")     \
  V(t, TIME, 1, "real", "s", 0.0, -HYST_INF, HYST_INF, "time")                           \
  V(d, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "disturbance")

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *d = (hyst_reached(*t, *t_step) ? *step : 0) + *amplitude * hyst_wave_sine(*t, *frequency, *phase).r;
}
HYST_BLOCK(disturbance,
           (.text = "Disturbance: step plus sine",
            .equation = "d = step [t >= t_step] + amplitude sin(2 pi frequency t + phase)", .source = "definition",
            .family = "sources", .tolerance = "rounding"),
           .rate = HYST_FUNCTION, .output = output)
