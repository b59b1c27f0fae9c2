/* ahead.h - inputs at the end of a step: from time derivatives (FMI 2.0) or from the importer (FMI 3.0).
 *
 * A step from t to t + h uses the inputs at its end.  An importer that sets them at t only is one step late.  With
 * derivatives the inputs are u + u' h + u'' h^2 / 2 + ... at the end: they belong to one step, after which the inputs
 * keep these values and the derivatives are 0.  In FMI 3.0 the step asks the importer for the inputs at t + h first. */
#ifndef FMI_AHEAD_H
#define FMI_AHEAD_H
#include "fmi/values.h"

enum { FMI_ORDERS = 3, FMI_SLOPES = FMI_ORDERS + 1 }; /* per input; the first is its value before the step */

/* Checks, or with `write` sets, the derivative of an input for the next step. */
fmi_status fmi_set_slope(instance *i, const fmi_call *call, uint32_t reference, int order, double value, int write);
/* Begins a step of n samples of h each, or of one step of h; on failure nothing has changed. */
fmi_status fmi_look_ahead(instance *i, double h, double n);
/* Moves the inputs to t_end, h after the beginning of the step.  fmi_arrive() ends the step. */
fmi_status fmi_go_ahead(instance *i, double t_end, double h);
void fmi_arrive(instance *i, int completed); /* otherwise the inputs go back */
static inline int64_t fmi_n_slopes(const instance *i) { return i->slopes ? FMI_SLOPES * i->graph->n_external : 0; }
#endif
