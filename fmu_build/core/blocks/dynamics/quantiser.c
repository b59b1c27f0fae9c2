/* Uniform quantiser of a converter (ADC, DAC): the nearest of the levels offset + k q, k a whole number.
 * Half a step is rounded up.  offset = 0 is a mid-tread characteristic, offset = q / 2 a mid-rise one (Widrow & Kollar,
 * Quantization Noise, 2008, chapter 1).  Its slope is 0 between the levels. */
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define DIMS(D)
#define VARS(V)                                                                                                     \
  V(q, PARAM, 1, "real", "1", 0.01, HYST_POSITIVE, HYST_INF, "distance between two levels (least significant bit)") \
  V(offset, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "one of the levels")                                   \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "signal")                                                   \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "nearest level")

static const double MOST = 4503599627370496.0; /* 2^52: above it, doubles are not closer than the levels */

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const double level = (*u - *offset) / *q;
  *y = hyst_fabs(level) < MOST ? *offset + *q * hyst_floor(level + 0.5) : *u;
}
HYST_BLOCK(quantiser,
           (.text = "Uniform quantiser of an ADC or DAC", .equation = "y = offset + q floor((u - offset) / q + 1/2)",
            .source = "Widrow & Kollar 2008, chapter 1", .family = "dynamics", .tolerance = "rounding"),
           .rate = HYST_FUNCTION, .output = output)
