/* play.h - one play (backlash) operator of half-width r >= 0 with state z at the input u.  Krejci & Kuhnen 2001, eq. 3.
 */
#ifndef HYST_PLAY_H
#define HYST_PLAY_H

static inline double hyst_play(double z, double u, double r) { return z < u - r ? u - r : z > u + r ? u + r : z; }

/* its change for a change `seed` of u: all of it where the play is taken along, else none */
static inline double hyst_play_tangent(double z, double u, double r, double seed) {
  const double up = u - r, down = u + r;
  return z < up || z > down || (z == up && seed > 0) || (z == down && seed < 0) ? seed : 0;
}

#endif
