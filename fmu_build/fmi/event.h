/* event.h - Event Mode and Continuous-Time Mode; outputs for the current values. */
#ifndef FMI_EVENT_H
#define FMI_EVENT_H
#include "fmi/values.h"

fmi_status fmi_enter_event(instance *i);
fmi_status fmi_update_discrete(instance *i); /* makes the event effective: takes samples, passes inputs to memories */
int fmi_next_event(const instance *i, double *t); /* 1: at *t */
fmi_status fmi_leave_event(instance *i);          /* to Step Mode or Continuous-Time Mode */
void fmi_undo_event(instance *i);                 /* discards a trial of the event */
fmi_status fmi_try_event(instance *i);            /* outputs as if the event happened now */
fmi_status fmi_evaluate(instance *i);             /* outputs for the current time, inputs and continuous states */
fmi_status fmi_set_time(instance *i, double t);
fmi_status fmi_completed_step(instance *i, int *event); /* event: the importer is to enter Event Mode */
fmi_status fmi_set_states(instance *i, const fmi_call *call, const double *x, size_t n);
fmi_status fmi_get_states(instance *i, const fmi_call *call, double *x, size_t n);
fmi_status fmi_get_derivatives(instance *i, const fmi_call *call, double *dx, size_t n);
fmi_status fmi_get_nominals(instance *i, const fmi_call *call, double *nominals, size_t n);
fmi_status fmi_get_indicators(instance *i, const fmi_call *call, size_t n);

/* before values are read: updates the outputs for the current inputs; in Step Mode those of the last step stay */
fmi_status fmi_refresh(instance *i);
static inline fmi_status fmi_fresh(instance *i) {
  return i->run.phase & (INITIALIZATION | EVENT | CONTINUOUS) && i->run.stale ? fmi_refresh(i) : FMI_OK;
}
double fmi_slack(double t, double h); /* tolerance for the times of an importer */
#endif
