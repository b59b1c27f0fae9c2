/* waveform.h - signals of the time with their first two derivatives, for the source blocks. */
#ifndef HYST_WAVEFORM_H
#define HYST_WAVEFORM_H
#include "core/elementary/elementary_sine.h"
#include "core/hyst.h"

typedef struct {
  double r, dr, ddr;
} hyst_wave;

/* completed fraction of a cycle, in [0, 1); whole cycles are subtracted before the multiplication by 2 pi */
static inline double hyst_cycle(double turns) { return turns - hyst_floor(turns); }

static inline hyst_wave hyst_wave_sine(double t, double frequency, double phase) {
  const double omega = HYST_2PI * frequency, angle = HYST_2PI * hyst_cycle(frequency * t) + phase;
  const double s = hyst_sin(angle);
  const hyst_wave w = {s, omega * hyst_cos(angle), -omega * omega * s};
  return w;
}

/* from one level to the next along half a cosine of duration 1 / (2 frequency); part: completed fraction, in [0, 1) */
static inline hyst_wave hyst_wave_half_cosine(double from, double to, double part, double frequency) {
  const double omega = HYST_2PI * frequency, angle = 0.5 * HYST_2PI * part, half = 0.5 * (to - from);
  const double c = hyst_cos(angle);
  const hyst_wave w = {from + half * (1 - c), half * omega * hyst_sin(angle), half * omega * omega * c};
  return w;
}

/* 1 if t has reached the event, with a tolerance for the rounding of accumulated times */
static inline int hyst_reached(double t, double event) { return t >= event - 1e-9 * hyst_fabs(event); }
#endif
