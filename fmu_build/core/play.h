/* play.h - one play (backlash) operator of half-width r >= 0 with state z at the input u.  Krejci & Kuhnen 2001, eq. 3.
 */
#ifndef HYST_PLAY_H
#define HYST_PLAY_H

static inline double hyst_play(double z, double u, double r) { return z < u - r ? u - r : z > u + r ? u + r : z; }

#endif
