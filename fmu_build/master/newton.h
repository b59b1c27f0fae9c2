/* newton.h - the matrix of Newton's method for the values that a loop has to agree on; small, dense, by rows.
 *
 * out(g) - g = 0 with J = d out / d g: the step is H r with H = (I - J)^-1 and r = out(g) - g.  J comes once from
 * directional derivatives; what they leave out (states that follow an input within the step, a bent curve) the sweeps
 * themselves tell: Broyden's update of the inverse (1965, "good"), the secant method for one value. */
#ifndef HYST_NEWTON_H
#define HYST_NEWTON_H
#include <stdint.h>

/* J (n x n, overwritten) -> H.  1: singular, as a loop gain of one is */
int newton_start(int64_t n, double *J, double *H);
void newton_step(int64_t n, const double *H, const double *residual, double *change);
/* after that change the residual is `now`, and was `before`; room for 2 n */
void newton_learn(int64_t n, double *H, const double *change, const double *before, const double *now, double *room);
#endif
