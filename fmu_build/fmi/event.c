/* event.c - Event Mode and Continuous-Time Mode of both standards, around core/graph/continuous.h.
 *
 * Hysteretic memories take their inputs at accepted steps (completed_step) and at events.  Sampled blocks advance in
 * Model Exchange at events, every hyst_graph.step seconds from the start time, in Co-Simulation in steps.  An event in
 * Co-Simulation repeats the step that ended at it, from the same memory: without new inputs it changes nothing, with
 * them no block is late by a step.  In Event Mode an importer may set inputs and read outputs in turn until they are
 * consistent.  So each trial of the event starts from the same memory, and only update_discrete makes it effective. */
#include "fmi/event.h"

#include <string.h>

#include "core/graph/continuous.h"
#include "core/graph/message.h"
#include "core/graph/run.h"

/* Importers compute t as i*h, as t += h, or in integer nanoseconds: a thousandth of a step and some rounding of t are
 * allowed.  A real mismatch is a step or more. */
double fmi_slack(double t, double h) { return 1e-3 * h + 16 * 2.220446049250313e-16 * (t < 0 ? -t : t); }

/* ---- Event Mode ------------------------------------------------------------------------------------------------- */
static size_t memory_size(const instance *i) { return (size_t)fmi_n_memory(i) * sizeof(double); }

/* Model Exchange: sample periods since the last sample, more than one for an importer that skips some */
static double periods_due(const instance *i) {
  const double h = i->graph->step, t = i->run.t - i->run.start;
  const double n = (t + fmi_slack(i->run.t, h)) / h - i->run.samples;
  return n < 1 ? 0 : n < 4503599627370496.0 ? (double)(int64_t)n : n;
}

static hyst_status repeat_step(instance *i) {
  if (i->run.redo == 0) return hyst_graph_start(i->graph, i->run.t);
  memcpy(i->graph->state, i->begin, memory_size(i));
  return hyst_graph_step(i->graph, i->run.t, i->run.redo);
}

static hyst_status take_samples(instance *i, double n) {
  hyst_graph *g = i->graph;
  hyst_status s = HYST_E_OK;
  for (double k = 1; k <= n && !s; k++)
    s = hyst_graph_sample(g, k < n ? i->run.start + (i->run.samples + k) * g->step : i->run.t, g->step);
  return s;
}

void fmi_undo_event(instance *i) {
  if (!i->tried) return;
  memcpy(i->graph->state, i->before, memory_size(i));
  i->tried = 0;
  i->run.stale = 1;
}

fmi_status fmi_try_event(instance *i) {
  hyst_graph *g = i->graph;
  const double n = i->before && !i->begin ? periods_due(i) : 0;
  if (n == 0 && !i->begin) return fmi_evaluate(i);
  if (n > FMI_MOST_SAMPLES) return fmi_refuse(i, "The time passed over more than 1e6 samples of the model.");
  fmi_undo_event(i);
  if (fmi_prepare(i)) return FMI_ERROR;
  memcpy(i->before, g->state, memory_size(i));
  i->tried = 1;
  if (i->begin ? repeat_step(i) : take_samples(i, n)) {
    fmi_undo_event(i);
    return fmi_refuse_graph(i, hyst_graph_error(g));
  }
  i->run.stale = 0;
  return FMI_OK;
}

fmi_status fmi_enter_event(instance *i) {
  i->run.phase = EVENT;
  i->run.stale = 1;
  return FMI_OK;
}

fmi_status fmi_update_discrete(instance *i) {
  if (i->n_broken) return FMI_DISCARD;
  const fmi_status s = fmi_fresh(i);
  if (s) return s;
  if (i->tried) {
    i->tried = 0;
    if (!i->begin) i->run.samples += periods_due(i);
  }
  if (!i->begin) hyst_graph_commit(i->graph, i->run.t); /* a step that is repeated has passed its inputs on */
  return FMI_OK;
}

int fmi_next_event(const instance *i, double *t) {
  *t = i->run.start + (i->run.samples + 1) * i->graph->step;
  return i->before && i->run.interface == MODEL_EXCHANGE;
}

fmi_status fmi_leave_event(instance *i) {
  fmi_undo_event(i);
  i->run.phase = i->run.interface == MODEL_EXCHANGE ? CONTINUOUS : STEPPING;
  i->run.jump = FMI_HELD;
  return FMI_OK;
}

static fmi_status initialize(instance *i) {
  if (hyst_graph_start(i->graph, i->run.t)) return fmi_refuse_graph(i, hyst_graph_error(i->graph));
  i->run.stale = 0;
  return FMI_OK;
}

fmi_status fmi_refresh(instance *i) {
  if (i->run.phase == INITIALIZATION) return initialize(i);
  return i->run.phase == EVENT ? fmi_try_event(i) : fmi_evaluate(i);
}

/* ---- Continuous-Time Mode ---------------------------------------------------------------------------------------- */
fmi_status fmi_evaluate(instance *i) {
  const fmi_status s = fmi_prepare(i);
  if (s) return s;
  hyst_graph_evaluate(i->graph, i->run.t);
  i->run.stale = 0;
  return FMI_OK;
}

/* A time after the stop time is accepted: solvers such as CVode in fmpy compute derivatives beyond the end of the last
 * step, and interpolate. */
fmi_status fmi_set_time(instance *i, double t) {
  if (!fmi_is_finite(t)) return fmi_refuse(i, "The time must be finite.");
  fmi_undo_event(i);
  i->run.t = i->run.clock = t;
  i->run.stale = 1;
  return FMI_OK;
}

/* An importer that sets inputs at accepted steps only, and not where it reads derivatives, makes them jump for its
 * solver.  Across a jump the error test of a solver of higher order fails at every length of the step.  So the unit
 * asks for an event, after which solvers begin anew. */
fmi_status fmi_completed_step(instance *i, int *event) {
  *event = i->n_continuous > 0 && i->run.jump == FMI_JUMPED;
  if (i->n_broken) return FMI_DISCARD;
  const fmi_status s = fmi_prepare(i);
  if (s) return s;
  hyst_graph_commit(i->graph, i->run.t);
  i->run.stale = 0;
  i->run.jump = FMI_HELD;
  return FMI_OK;
}

static fmi_status check_count(const instance *i, const fmi_call *call, size_t n, int64_t have) {
  return n == (size_t)have ? FMI_OK
                           : fmi_refuse(i, "%s: the unit has %ld of them. Got room for %lu.", call->name, (long)have,
                                        (unsigned long)n);
}

/* of an array with one value per continuous state */
static fmi_status check_array(const instance *i, const fmi_call *call, const double *at, size_t n, const char *values) {
  return fmi_given(i, call, at, n, values) ? check_count(i, call, n, i->n_continuous) : FMI_ERROR;
}

fmi_status fmi_set_states(instance *i, const fmi_call *call, const double *x, size_t n) {
  if (check_array(i, call, x, n, "continuous states")) return FMI_ERROR;
  for (size_t k = 0; k < n; k++)
    if (fmi_examine_state(i, i->continuous + k, x[k])) return FMI_DISCARD;
  for (size_t k = 0; k < n; k++) *i->continuous[k].value = x[k];
  i->run.stale = 1;
  return FMI_OK;
}

fmi_status fmi_get_states(instance *i, const fmi_call *call, double *x, size_t n) {
  fmi_status s = check_array(i, call, x, n, "continuous states");
  if (!s) s = fmi_fresh(i);
  for (size_t k = 0; k < n && !s; k++) x[k] = *i->continuous[k].value;
  return s;
}

fmi_status fmi_get_derivatives(instance *i, const fmi_call *call, double *dx, size_t n) {
  fmi_status s = check_array(i, call, dx, n, "derivatives");
  if (!s) s = i->n_broken ? FMI_DISCARD : fmi_fresh(i);
  if (s) return s;
  hyst_graph_derivatives(i->graph, dx);
  if (i->run.jump == FMI_JUMPED) i->run.jump = FMI_KNOWN;
  for (size_t k = 0; k < n; k++)
    if (!fmi_is_finite(dx[k])) {
      char t[32];
      fmi_log(i, FMI_WARNING, FMI_LOG_WARNING, "The derivative of '%s' is not finite at t = %s s.",
              i->continuous[k].name, hyst_number(t, sizeof t, i->run.t));
      return FMI_DISCARD;
    }
  return FMI_OK;
}

/* Nominal values are 1, because the states have the unknown scale of the inputs.  Those of bouc_wen_oscillator would
 * follow from its stiffness, but its force has the scale of the input and keeps a solver similarly accurate: the error
 * of CVode at 1e-5 is 2e-4 instead of 6e-5. */
fmi_status fmi_get_nominals(instance *i, const fmi_call *call, double *nominals, size_t n) {
  if (check_array(i, call, nominals, n, "nominal values")) return FMI_ERROR;
  for (size_t k = 0; k < n; k++) nominals[k] = 1;
  return FMI_OK;
}

/* none: a reversal of the input needs no event, because the memory takes it at the accepted step */
fmi_status fmi_get_indicators(instance *i, const fmi_call *call, size_t n) { return check_count(i, call, n, 0); }
