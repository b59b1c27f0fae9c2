/* newton.h - the matrix of Newton's method for the values of an algebraic loop; small, dense, by rows.
 *
 * For out(g) - g = 0 with J = d out / d g the step is H r with H = (I - J)^-1 and r = out(g) - g.  J is computed once
 * from tangents.  Broyden's update of the inverse (1965, "good"; the secant method for one value) adds what tangents
 * omit: states that follow an input within the step, and curvature. */
#ifndef HYST_NEWTON_H
#define HYST_NEWTON_H
#include <stdint.h>

/* J (n x n, overwritten) -> H.  1 if singular, as for a loop gain of one */
int newton_start(int64_t n, double *J, double *H);
void newton_step(int64_t n, const double *H, const double *residual, double *change);
/* the change turned the residual `before` into `now`; room for 2 n */
void newton_learn(int64_t n, double *H, const double *change, const double *before, const double *now, double *room);
#endif
