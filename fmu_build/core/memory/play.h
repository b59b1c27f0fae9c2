/* play.h - a play (backlash) operator of half-width r >= 0 with state z at input u.  Krejci & Kuhnen 2001, eq. 3. */
#ifndef HYST_PLAY_H
#define HYST_PLAY_H

/* one bound after the other, without branches: see hyst_clamp() */
static inline double hyst_play(double z, double u, double r) {
  const double up = u - r, down = u + r, above = z < up ? up : z;
  return above > down ? down : above;
}

/* tangent for the seed of u: the seed where the play moves, else 0 */
static inline double hyst_play_tangent(double z, double u, double r, double seed) {
  const double up = u - r, down = u + r;
  return z < up || z > down || (z == up && seed > 0) || (z == down && seed < 0) ? seed : 0;
}

/* -1: z = u - r; 1: z = u + r; 0: the play rests. If both are possible, the play moves. */
static inline int hyst_play_side(double z, double u, double r) { return z <= u - r ? -1 : z >= u + r ? 1 : 0; }

#endif
