/* life.c - life cycle of an FMU: instantiate, initialise, step, terminate. */
#include "fmi/life.h"

#include <stdlib.h>
#include <string.h>

#include "core/block_file/graph_open.h"
#include "core/elementary/elementary.h"
#include "core/graph/continuous.h"
#include "core/graph/message.h"
#include "core/graph/run.h"
#include "fmi/ahead.h"
#include "fmi/derivative.h"
#include "fmi/event.h"
#include "fmi/files/resource.h"
#include "fmi/messages.h"
#include "fmi/state.h"

static void fresh_run(instance *i) {
  memset(&i->run, 0, sizeof i->run);
  i->run.interface = i->kind.interface;
  i->run.event_mode = i->kind.event_mode;
  i->run.phase = INSTANTIATED;
  i->run.changed = i->graph->changed;
  i->run.dt = i->graph->dt;
  i->tried = 0;
  if (i->begin) memset(i->begin, 0, (size_t)fmi_n_memory(i) * sizeof(double));
  memset(i->broken, 0, (size_t)i->graph->n_external);
  i->n_broken = 0;
  if (i->slopes) memset(i->slopes, 0, (size_t)fmi_n_slopes(i) * sizeof(double));
}

/* opens the graph of the block file; 0 after a message */
static int open_graph(instance *i, const char *token, const unsigned char *file, size_t length) {
  hyst_error e;
  size_t bytes;
  if (hyst_graph_measure(file, length, &bytes, &e)) return fmi_refuse_graph(i, &e), 0;
  i->memory = malloc(bytes);
  if (!i->memory) return fmi_refuse(i, "out of memory"), 0;
  if (hyst_graph_open(file, length, i->memory, bytes, &i->graph, &e)) return fmi_refuse_graph(i, &e), 0;
  const hyst_graph *g = i->graph;
  if (!token || strcmp(token, g->token) != 0)
    return fmi_refuse(i, "The token '%s' of modelDescription.xml does not belong to this block.bin ('%s').",
                      token ? token : "", g->token),
           0;
  i->broken = (unsigned char *)malloc((size_t)g->n_external + 1);
  if (!i->broken) return fmi_refuse(i, "out of memory"), 0;
  if (!i->kind.by_element || i->kind.interface != CO_SIMULATION) return 1;
  i->slopes = (double *)calloc((size_t)g->n_external + 1, FMI_SLOPES * sizeof *i->slopes);
  if (!i->slopes) return fmi_refuse(i, "out of memory"), 0;
  return 1;
}

/* makes variables for states and derivatives, and room for trials of events; 0 after a message */
static int open_continuous(instance *i) {
  hyst_graph *g = i->graph;
  const int64_t n = i->n_continuous = hyst_graph_n_continuous(g);
  const int sampled = hyst_graph_is_sampled(g), repeats = i->kind.event_mode && hyst_graph_needs_step(g);
  if (sampled && i->kind.interface == MODEL_EXCHANGE && g->step == 0)
    return fmi_refuse(i, "Model Exchange needs the sample period of the model: export it with a step."), 0;
  i->continuous = (hyst_port *)calloc((size_t)n + 1, 2 * sizeof *i->continuous);
  i->derivatives = (double *)calloc((size_t)n + 1, sizeof *i->derivatives);
  i->work = (double *)calloc(fmi_derivative_work(g), sizeof *i->work);
  const int tries = repeats || (sampled && i->kind.interface == MODEL_EXCHANGE);
  if (hyst_graph_needs_step(g)) i->period = g->step;
  if (tries) i->before = (double *)malloc((size_t)g->n_state * sizeof(double));
  if (repeats) i->begin = (double *)malloc((size_t)g->n_state * sizeof(double));
  const int have = (i->before || !tries) && (i->begin || !repeats);
  if (!i->continuous || !i->derivatives || !i->work || !have) return fmi_refuse(i, "out of memory"), 0;
  for (int64_t k = 0; k < n; k++) {
    const hyst_node *node;
    const hyst_var *row = hyst_graph_continuous_row(g, k, &node);
    hyst_port *state = i->continuous + k;
    state->name = row->name, state->kind = HYST_CSTATE, state->row = row;
    state->block = (int)(node - g->nodes), state->var = (int)(row - node->block->vars);
    state->type = HYST_REAL, state->size = 1;
    state->reference = g->n_references + 1 + k;
    state->value = hyst_graph_continuous(g, k);
    i->continuous[n + k] = *state;
    i->continuous[n + k].reference += n;
    i->continuous[n + k].value = i->derivatives + k;
  }
  return 1;
}

instance *fmi_instantiate(const char *name, const char *token, const char *location, int logging_on, fmi_kind kind,
                          const fmi_logger *logger) {
  char why[512];
  size_t length = 0;
  instance *i = (instance *)calloc(1, sizeof *i);
  if (!i) return NULL;
  i->logger = *logger;
  i->kind = kind;
  i->categories = 1u << FMI_LOG_WARNING | 1u << FMI_LOG_ERROR | (logging_on ? 1u << FMI_LOG_EVENTS : 0);
  i->name = (char *)malloc(name ? strlen(name) + 1 : 1);
  if (i->name) strcpy(i->name, name ? name : "");
  unsigned char *file = NULL;
  if (!i->name || strspn(i->name, " \t\r\n") == strlen(i->name)) fmi_refuse(i, "The instance needs a name.");
  else if (!(file = fmi_read_block_file(location, &length, why, sizeof why))) fmi_refuse(i, "%s", why);
  const int good = file && open_graph(i, token, file, length) && open_continuous(i);
  free(file);
  if (!good) return fmi_free(i), (instance *)NULL;
  fresh_run(i);
  fmi_log(i, FMI_OK, FMI_LOG_EVENTS, "Instantiated: %d blocks, %d variables.", i->graph->n_nodes, i->graph->n_ports);
  return i;
}

void fmi_free(instance *i) {
  if (!i) return;
  void *state;
  while ((state = i->saved)) fmi_forget(i, &state);
  free(i->memory);
  free(i->broken);
  free(i->slopes);
  free(i->continuous);
  free(i->derivatives);
  free(i->before);
  free(i->begin);
  free(i->work);
  free(i->name);
  free(i);
}

void fmi_reset(instance *i) {
  hyst_graph *g = i->graph;
  hyst_graph_defaults(g);
  hyst_graph_prepare(g, 0); /* cannot fail: it succeeded with these values when the instance was made */
  fresh_run(i);
}

/* ---- initialisation and steps ----------------------------------------------------------------------------------- */
fmi_status fmi_setup(instance *i, double start, int stop_defined, double stop) {
  if (!fmi_is_finite(start)) return fmi_refuse(i, "The start time must be finite.");
  if (stop_defined && !(fmi_is_finite(stop) && stop >= start))
    return fmi_refuse(i, "The stop time must be finite and not before the start time.");
  i->run.t = i->run.clock = i->run.start = start;
  i->run.stop_defined = stop_defined != 0;
  i->run.stop = stop_defined ? stop : 0;
  return FMI_OK;
}

fmi_status fmi_enter_initialization(instance *i) {
  i->run.phase = INITIALIZATION;
  i->run.stale = 1;
  return FMI_OK;
}

fmi_status fmi_exit_initialization(instance *i) {
  const fmi_status s = fmi_fresh(i);
  if (s) return s;
  if (i->run.interface == MODEL_EXCHANGE || i->run.event_mode) return fmi_enter_event(i);
  i->run.phase = STEPPING;
  return FMI_OK;
}

fmi_status fmi_terminate(instance *i) {
  i->run.phase = TERMINATED;
  return FMI_OK;
}

/* An importer that adds up its steps asks at the end for the rest to the stop time, which is rounding of its clock: a
 * few units in the last place of the times, or more after many steps.  Such a step is complete before it begins.  A
 * model with a sample time takes a thousandth of it for rounding as well. */
static double rounding(const instance *i, double t) {
  const double stop = i->run.stop < 0 ? -i->run.stop : i->run.stop;
  double least = fmi_slack(t, 0) < fmi_slack(stop, 0) ? fmi_slack(stop, 0) : fmi_slack(t, 0);
  if (least < 1e-12) least = 1e-12;
  return least < 1e-3 * i->period ? 1e-3 * i->period : least;
}

/* A model with a sample time has a clock of its own, whatever the steps of the importer: a step is n samples of *length
 * each.  Without a sample time it is one.  0 after a message. */
static double samples_of(const instance *i, double t_end, double h, double *length) {
  char a[32], b[32];
  *length = h;
  if (!(i->period > 0)) return 1;
  const double most = FMI_MOST_SAMPLES + 0.5, n = h / i->period < most ? (double)(int64_t)(h / i->period + 0.5) : 0;
  const double off = hyst_fabs(h - n * i->period);
  *length = i->period;
  if (n >= 1 && off <= fmi_slack(t_end, i->period) && off < 0.5 * i->period) return n;
  fmi_refuse(i, "The step must be a multiple (1 to 1000000) of the sample time %s s of the model. Got %s s instead.",
             hyst_number(a, sizeof a, i->period), hyst_number(b, sizeof b, h));
  return 0;
}

/* one step of the graph from t to t + h, `length` without the rounding of the times */
static fmi_status advance(instance *i, double t, double h, double length) {
  hyst_graph *g = i->graph;
  const double reached = hyst_graph_end_of_step(g, i->run.start, t, h);
  if (i->begin) {
    /* refuses parameters before the memory of the last step is lost */
    if ((g->changed || g->dt != length) && hyst_graph_prepare(g, length))
      return fmi_refuse_graph(i, hyst_graph_error(g));
    memcpy(i->begin, g->state, (size_t)fmi_n_memory(i) * sizeof(double));
    i->run.redo = length;
  }
  if (hyst_graph_step(g, reached, length)) return fmi_refuse_graph(i, hyst_graph_error(g));
  i->run.t = reached;
  i->run.clock = t + h;
  return FMI_OK;
}

/* After an overflow the memory is not finite either.  Its copy before every step would cost more than most steps. */
static fmi_status examine_step(const instance *i) {
  const hyst_graph *g = i->graph;
  for (const hyst_port *p = g->ports + g->first_output; p < g->ports + g->end_output; p++)
    for (int64_t e = 0; p->kind == HYST_OUTPUT && e < p->size; e++)
      if (!fmi_is_finite(p->value[e])) return fmi_overflowed(i, p, p->value[e], FMI_ERROR);
  for (const hyst_port *p = i->continuous; p < i->continuous + i->n_continuous; p++)
    if (!fmi_is_finite(*p->value)) return fmi_overflowed(i, p, *p->value, FMI_ERROR);
  return FMI_OK;
}

fmi_status fmi_step(instance *i, double t, double h) {
  char a[32], b[32];
  if (!(h > 0 && h <= FMI_MOST_STEP))
    return fmi_refuse(i, "The step size must be in (0, 1e9] s. Got %s instead.", hyst_number(a, sizeof a, h));
  const double now = i->run.clock;
  if (t != now && (!fmi_is_finite(t) || !(t - now <= fmi_slack(t, h)) || !(now - t <= fmi_slack(t, h))))
    return fmi_refuse(i, "The step starts at t = %s s, but the unit is at t = %s s.", hyst_number(a, sizeof a, t),
                      hyst_number(b, sizeof b, now));
  if (h < rounding(i, t)) return FMI_OK;
  const double t_end = t + h;
  if (i->run.stop_defined && t_end - i->run.stop > fmi_slack(t_end, h))
    return fmi_refuse(i, "The step ends at t = %s s, after the stop time %s s.", hyst_number(a, sizeof a, t_end),
                      hyst_number(b, sizeof b, i->run.stop));
  double length;
  const double n = samples_of(i, t_end, h, &length);
  if (n == 0) return FMI_ERROR;
  if (i->n_broken) return FMI_DISCARD; /* the message was sent when the value was set */
  const int ahead = i->run.moving || i->ask;
  fmi_status s = ahead ? fmi_look_ahead(i, length, n) : FMI_OK;
  if (s) return s;
  for (double k = 0; k < n && !s; k++) {
    const double begin = t + k * length, rest = k + 1 < n ? length : h - k * length;
    if (ahead) s = fmi_go_ahead(i, k + 1 < n ? begin + rest : t_end, k * length + rest);
    if (!s) s = advance(i, begin, rest, length);
  }
  if (ahead) fmi_arrive(i, !s);
  if (s) return s;
  i->run.clock = t_end;
  return examine_step(i);
}
