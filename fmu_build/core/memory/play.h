/* play.h - one play (backlash) operator of half-width r >= 0 with state z at the input u.  Krejci & Kuhnen 2001, eq. 3.
 */
#ifndef HYST_PLAY_H
#define HYST_PLAY_H

/* one bound after the other: without a jump, see hyst_clamp() */
static inline double hyst_play(double z, double u, double r) {
  const double up = u - r, down = u + r, above = z < up ? up : z;
  return above > down ? down : above;
}

/* its change for a change `seed` of u: all of it where the play is taken along, else none */
static inline double hyst_play_tangent(double z, double u, double r, double seed) {
  const double up = u - r, down = u + r;
  return z < up || z > down || (z == up && seed > 0) || (z == down && seed < 0) ? seed : 0;
}

#endif
