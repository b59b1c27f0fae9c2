/* run.c - the executor of a graph. */
#include "core/graph/run.h"

#include <string.h>

#include "core/elementary/elementary.h"
#include "core/graph/error.h"
#include "core/graph/node.h"
#include "core/graph/pass.h"

double *hyst_graph_value(hyst_graph *g, int64_t reference) {
  const hyst_port *p = hyst_graph_port(g, reference);
  return p ? p->value + (reference - p->reference) : NULL;
}

hyst_status hyst_graph_set(hyst_graph *g, int64_t reference, double value) {
  const hyst_port *p = hyst_graph_port(g, reference);
  if (!p || p->kind == HYST_OUTPUT)
    return hyst_fail(&g->error, HYST_E_WIRING, NULL, p ? p->name : NULL, "not a parameter or input");
  if (hyst_check_port(p, value)) return hyst_fail_value(&g->error, g->nodes[p->block].name, p->row, value);
  p->value[reference - p->reference] = value;
  if (p->kind != HYST_INPUT) g->changed = 1;
  return HYST_E_OK;
}

double *hyst_graph_state(hyst_graph *g, int64_t *n) {
  *n = g->n_state;
  return g->state;
}

const hyst_error *hyst_graph_error(const hyst_graph *g) { return &g->error; }

/* ---- running ----------------------------------------------------------------------------------------------------- */
/* values before the first step: inputs (unconnected inputs keep them), outputs and states of the table */
static void start_values(hyst_graph *g) {
  g->state[0] = 0;
  for (const hyst_node *n = g->nodes, *end = n + g->n_nodes; n < end; n++) hyst_fill(n, HYST_INPUT);
}

void hyst_graph_defaults(hyst_graph *g) {
  start_values(g);
  memcpy(g->p, g->p_file, (size_t)g->n_p * sizeof(double));
  memcpy(g->external, g->external_file, (size_t)g->n_external * sizeof(double));
  g->changed = 1;
}

static hyst_status prepare(hyst_graph *g, double dt, unsigned flags) {
  const int fits = !g->changed; /* the derived values are those of the last dt, to which a refusal returns */
  const double before = g->dt;
  g->dt = dt;
  g->changed = 0;
  for (int i = 0; i < g->n_nodes; i++) {
    const hyst_node *n = g->nodes + i;
    if (!n->block->prepare || (n->block->flags & flags) != flags) continue;
    const char *wrong = n->block->prepare(n->dim, n->p, dt);
    if (!wrong) continue;
    g->dt = before;
    g->changed = 1;
    if (fits) prepare(g, before, 0);
    return hyst_fail(&g->error, HYST_E_PREPARE, n->name, NULL, wrong);
  }
  return HYST_E_OK;
}

hyst_status hyst_graph_prepare(hyst_graph *g, double dt) { return prepare(g, dt, 0); }

static inline void advance(const hyst_graph *g, double t, double dt) {
  for (const hyst_node *n = g->nodes, *end = n + g->n_nodes; n < end; n++) hyst_advance_node(g, n, t, dt);
}

hyst_status hyst_graph_rest(hyst_graph *g) {
  const hyst_status s = prepare(g, 0, 0);
  if (s) return s;
  start_values(g);
  for (const hyst_node *n = g->nodes, *end = n + g->n_nodes; n < end; n++) hyst_rest(n);
  for (const hyst_node *n = g->nodes, *end = n + g->n_nodes; n < end; n++)
    if (hyst_says_first(n)) n->block->output(n->dim, n->p, n->x, n->u, n->y);
  return HYST_E_OK;
}

hyst_status hyst_graph_start(hyst_graph *g, double t) {
  const hyst_status s = hyst_graph_rest(g);
  if (s) return s;
  advance(g, t, 0);
  hyst_look_behind(g);
  return HYST_E_OK;
}

static inline hyst_status ready(hyst_graph *g, double t_end, double *dt) {
  double *last = g->state; /* is part of the state, so that a restored run is bit-identical */
  if (*dt != *last) *dt = hyst_same_step(*dt, *last, t_end);
  if (*dt != g->dt || g->changed) {
    const hyst_status s = prepare(g, *dt, g->changed ? 0 : HYST_STEP);
    if (s) return s;
  }
  *last = *dt;
  return HYST_E_OK;
}

hyst_status hyst_graph_ready(hyst_graph *g, double t_end, double *dt) { return ready(g, t_end, dt); }

static inline hyst_status step(hyst_graph *g, double t_end, double dt) {
  const hyst_status s = ready(g, t_end, &dt);
  if (!s) advance(g, t_end, dt);
  return s;
}

hyst_status hyst_graph_step(hyst_graph *g, double t_end, double dt) { return step(g, t_end, dt); }

/* The times of callers that add up their steps contain rounding errors. Sources would depend on them, and a quantiser
 * would amplify them to whole levels. Therefore a step ends at the exact multiple of the step of the model if the
 * difference is at most the rounding error of k additions (half a unit in the last place each). Other steps end at t +
 * h. */
double hyst_graph_end_of_step(const hyst_graph *g, double start, double t, double h) {
  const double step = g->step, end = t + h;
  if (!(step > 0) || hyst_same_step(h, step, end) != step) return end;
  const double steps = (end - start) / step + 0.5;
  if (!(steps >= 1 && steps < 4503599627370496.0)) return end;
  const double k = (double)(int64_t)steps, off = hyst_fabs(end - (start + k * step));
  const double rounding = 1.2e-16 * (k + 3) * (hyst_fabs(end) + hyst_fabs(start));
  return off <= rounding && off <= 1e-3 * step ? start + (k - 1) * step + step : end;
}

hyst_status hyst_graph_run(hyst_graph *g, int64_t n, double t0, double h, const double *u, double *y) {
  const hyst_port *const first = g->ports + g->first_output, *const end = g->ports + g->end_output;
  const int64_t n_external = g->n_external;
  for (int64_t i = 0; i < n; i++) {
    if (n_external > 0) hyst_copy(g->external, u, n_external), u += n_external;
    /* t + h, not t0 + i h, so that the result is bit-identical to that of a master that calls doStep(t, h) */
    const hyst_status s = i == 0 ? hyst_graph_start(g, t0) : step(g, t0 + (double)(i - 1) * h + h, h);
    if (s) return s;
    for (const hyst_port *p = first; p < end; p++)
      if (p->kind == HYST_OUTPUT) hyst_copy(y, p->value, p->size), y += p->size;
  }
  return HYST_E_OK;
}
