/* White Gaussian noise, one new value per step, the same bits on every platform.
 * A value is a function of (seed, number of the step), so a restored state repeats the noise. */
#include "core/elementary/random.h"

#define DIMS(D)
#define VARS(V)                                                             \
  V(sigma, PARAM, 1, "real", "1", 1.0, 0.0, HYST_INF, "standard deviation") \
  V(seed, FIXED, 1, "int", "1", 1.0, 0.0, 2147483647.0, "seed")             \
  V(w, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "noise")           \
  V(counter, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "index of the step")

static const double MOST = 4503599627370496.0; /* all later steps have this index */

/* a saved state is untrusted */
static uint64_t number(double counter) { return counter >= 0 && counter <= MOST ? (uint64_t)counter : 0; }

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  *w = *sigma * hyst_random_normal((uint64_t)*seed, number(*counter));
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  if (dt > 0 && *counter < MOST) *counter += 1;
}
HYST_BLOCK(noise,
           (.text = "White Gaussian noise", .equation = "w_k = sigma N(0, 1), by (seed, k)",
            .source = "SplitMix64: Steele, Lea & Flood 2014; Box & Muller 1958", .family = "sources",
            .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .output = output, .update = update)
