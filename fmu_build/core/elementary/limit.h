/* limit.h - limits of a signal. */
#ifndef HYST_LIMIT_H
#define HYST_LIMIT_H

#define HYST_NO_LIMIT 1e300 /* means "no limit", because parameters must be finite */

/* lo <= hi.  One bound after the other compiles to minimum and maximum without branches, unlike nested conditions. */
static inline double hyst_clamp(double u, double lo, double hi) {
  const double above = u < lo ? lo : u;
  return above > hi ? hi : above;
}

/* tangent of hyst_clamp() for the seed of u */
static inline double hyst_clamp_tangent(double u, double lo, double hi, double seed) {
  return u < lo || u > hi || (u == lo && seed < 0) || (u == hi && seed > 0) ? 0 : seed;
}
#endif
