/* Reference signal with its first two derivatives, `lead` seconds ahead for a feed-forward.
 * random_reversals: random levels alternately above and below the last one, joined by half cosines.  These nested loops
 * identify and test a hysteresis model; a seed gives the same signal on every platform. */
#include "core/blocks/sources/waveform.h"
#include "core/elementary/random.h"

#define DIMS(D) D(m, 10, 1, 100000, "number of tones, levels or reversals")
#define VARS(V)                                                                                                      \
  V(shape, FIXED, 1, "sine|triangle|decaying_sine|multisine|steps|random_reversals", "1", 0.0, 0.0, 5.0, "waveform") \
  V(amplitude, PARAM, 1, "real", "1", 1.0, -HYST_INF, HYST_INF, "factor of the waveform")                            \
  V(offset, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "offset of the signal")                                 \
  V(frequency, PARAM, 1, "real", "Hz", 1.0, 0.0, 1e12,                                                               \
    "frequency of sine, triangle, decaying_sine; half the rate of random_reversals")                                 \
  V(phase, PARAM, 1, "real", "rad", 0.0, -1e12, 1e12, "phase of sine, triangle and decaying_sine at time 0")         \
  V(turn, PARAM, 1, "real", "1", 0.0, 0.0, 1.0, "share of the period of triangle in its parabolic turn-arounds")     \
  V(decay, PARAM, 1, "real", "1/s", 0.1, 0.0, 1e12, "decay of decaying_sine: amplitude exp(-decay t)")               \
  V(lead, PARAM, 1, "real", "s", 0.0, -1e12, 1e12, "preview time of r_lead, dr_lead and ddr_lead")                   \
  V(f, PARAM, m, "real", "Hz", 1.0, 0.0, 1e12, "frequencies of multisine")                                           \
  V(a, PARAM, m, "real", "1", 0.1, -HYST_INF, HYST_INF, "amplitudes of multisine")                                   \
  V(ph, PARAM, m, "real", "rad", 0.0, -1e12, 1e12, "phases of multisine")                                            \
  V(levels, PARAM, m, "real", "1", 1.0, -HYST_INF, HYST_INF, "levels of steps; the last level stays")                \
  V(T, PARAM, 1, "real", "s", 1.0, HYST_POSITIVE, 1e300, "duration of each level of steps")                          \
  V(seed, FIXED, 1, "int", "1", 1.0, 0.0, 2147483647.0, "seed of random_reversals")                                  \
  V(extrema, DERIVED, m + 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "levels of random_reversals")                    \
  V(t, TIME, 1, "real", "s", 0.0, -HYST_INF, HYST_INF, "time")                                                       \
  V(r, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "signal at the current time")                               \
  V(r_lead, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "signal `lead` seconds ahead")                         \
  V(dr_lead, OUTPUT, 1, "real", "1/s", 0.0, -HYST_INF, HYST_INF, "first derivative of r_lead")                       \
  V(ddr_lead, OUTPUT, 1, "real", "1/s2", 0.0, -HYST_INF, HYST_INF, "second derivative of r_lead")

enum { SINE, TRIANGLE, DECAYING_SINE, MULTISINE, STEPS, RANDOM_REVERSALS };

/* Rises through 0 at the start of a cycle, as the sine does. Parabolas join the lines around the extrema, for the share
 * `turn` of the time. The acceleration is constant there; the lines are steeper, so that the extrema do not change. */
static hyst_wave triangle(double t, double frequency, double phase, double turn) {
  const double q = hyst_cycle(frequency * t + phase / HYST_2PI), reach = 0.25 * turn, speed = 4 / (1 - 2 * reach);
  const int falls = q >= 0.25 && q < 0.75;
  const double top = q - 0.25, bottom = q - 0.75, sign = q < 0.5 ? 1 : -1, from = q < 0.5 ? top : bottom;
  if (hyst_fabs(from) < reach) {
    const double bend = -sign * speed / reach;
    const hyst_wave w = {sign + 0.5 * bend * from * from, bend * from * frequency, bend * frequency * frequency};
    return w;
  }
  const hyst_wave w = {speed * (falls      ? 0.5 - q
                                : q < 0.25 ? q
                                           : q - 1),
                       falls ? -speed * frequency : speed * frequency, 0};
  return w;
}

static hyst_wave decaying_sine(double t, double frequency, double phase, double decay) {
  const hyst_wave s = hyst_wave_sine(t, frequency, phase);
  const double e = hyst_exp(-decay * t);
  const hyst_wave w = {e * s.r, e * (s.dr - decay * s.r), e * (s.ddr - 2 * decay * s.dr + decay * decay * s.r)};
  return w;
}

static hyst_wave multisine(int m, double t, const double *f, const double *a, const double *ph) {
  hyst_wave w = {0, 0, 0};
  for (int i = 0; i < m; i++) {
    const hyst_wave s = hyst_wave_sine(t, f[i], ph[i]);
    w.r += a[i] * s.r, w.dr += a[i] * s.dr, w.ddr += a[i] * s.ddr;
  }
  return w;
}

/* index of the piece that contains a place, limited to 0..m - 1 (also a safe cast for any double) */
static int piece(double place, int m) { return place >= m ? m - 1 : place >= 1 ? (int)place : 0; }

static hyst_wave steps(int m, double t, const double *levels, double T) {
  const hyst_wave w = {levels[piece(t / T * (1 + 1e-9), m)], 0, 0}; /* as hyst_reached() */
  return w;
}

static hyst_wave random_reversals(int m, double t, double frequency, const double *extrema) {
  const double place = 2 * frequency * t;
  const int k = piece(place, m);
  if (!(place >= 0 && place < m)) {
    const hyst_wave rest = {extrema[place > 0 ? m : 0], 0, 0};
    return rest;
  }
  return hyst_wave_half_cosine(extrema[k], extrema[k + 1], place - k, frequency);
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  extrema[0] = 0;
  for (int k = 0; k < m; k++) {
    const double to = k % 2 ? -1 : 1;
    extrema[k + 1] = extrema[k] + (to - extrema[k]) * hyst_random_uniform((uint64_t)*seed, (uint64_t)k);
  }
  return NULL;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  for (int ahead = 0; ahead < 2; ahead++) {
    const double at = ahead ? *t + *lead : *t;
    hyst_wave w;
    switch ((int)*shape) {
      case TRIANGLE: w = triangle(at, *frequency, *phase, *turn); break;
      case DECAYING_SINE: w = decaying_sine(at, *frequency, *phase, *decay); break;
      case MULTISINE: w = multisine(m, at, f, a, ph); break;
      case STEPS: w = steps(m, at, levels, *T); break;
      case RANDOM_REVERSALS: w = random_reversals(m, at, *frequency, extrema); break;
      default: w = hyst_wave_sine(at, *frequency, *phase);
    }
    *(ahead ? r_lead : r) = *offset + *amplitude * w.r;
    *dr_lead = *amplitude * w.dr;
    *ddr_lead = *amplitude * w.ddr;
  }
}
HYST_BLOCK(reference,
           (.text = "Reference signal with derivatives and preview for a feed-forward",
            .equation = "r(t) = offset + amplitude w(t); r_lead, dr_lead, ddr_lead = r, r', r'' at t + lead",
            .source = "Zhao & Tan 2008, section IV (decaying sine); random reversals: SplitMix64, Steele et al. 2014",
            .family = "sources", .tolerance = "rounding"),
           .rate = HYST_FUNCTION, .prepare = prepare, .output = output)
