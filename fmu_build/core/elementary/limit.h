/* limit.h - a signal between two bounds. */
#ifndef HYST_LIMIT_H
#define HYST_LIMIT_H

#define HYST_NO_LIMIT 1e300 /* a parameter is finite: this is "no limit" */

/* lo <= hi.  One bound after the other: a minimum and a maximum without a jump, which a nested condition is not. */
static inline double hyst_clamp(double u, double lo, double hi) {
  const double above = u < lo ? lo : u;
  return above > hi ? hi : above;
}

/* the change of hyst_clamp() for a change `seed` of u */
static inline double hyst_clamp_tangent(double u, double lo, double hi, double seed) {
  return u < lo || u > hi || (u == lo && seed < 0) || (u == hi && seed > 0) ? 0 : seed;
}
#endif
