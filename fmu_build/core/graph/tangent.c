/* tangent.c - directional derivatives of a graph: chains the tangents of its blocks along the wires. */
#include "core/graph/tangent.h"

#include "core/graph/continuous.h"
#include "core/graph/implicit.h"
#include "core/graph/node.h"

/* gathers values and seeds of the inputs of a node; its time is that of the last evaluate */
static void gather(const hyst_graph *g, const hyst_node *n, const double *d_external) {
  hyst_gather(g, n, n->time >= 0 ? n->u[n->time] : 0);
  for (const hyst_wire *w = g->wires + n->first_wire, *end = w + n->n_wires; w < end; w++) {
    const hyst_node *s = w->source < 0 ? NULL : g->nodes + w->source;
    const double *from = s ? s->dy + (w->from - s->y) : d_external + (w->from - g->external);
    hyst_copy(n->du + (w->to - n->u), from, w->size);
  }
}

/* computes dy of a node, and ddx (n_c numbers) if it has continuous states */
static void tangent_of_block(const hyst_node *n, const double *dx, double *ddx) {
  if (n->block->tangent) {
    n->block->tangent(n->dim, n->p, n->x, n->u, n->du, dx, n->dy, ddx);
    return;
  }
  for (int64_t k = 0; k < n->n_y; k++) n->dy[k] = 0;
  for (int64_t k = 0; k < n->n_c; k++) ddx[k] = 0;
}

/* tangent of the model output h for the seed du of its input, those of the inputs of the graph, and the tangents of
 * blocks that hold during the search */
static double tried(const hyst_graph *g, const hyst_node *n, double du, const double *d_external) {
  n->dy[0] = du;
  for (const hyst_node *m = n + 1, *end = g->nodes + g->n_nodes; m < end; m++) {
    if (m->tried_by != (int)(n - g->nodes)) continue;
    gather(g, m, d_external);
    tangent_of_block(m, NULL, NULL);
  }
  double change = 0;
  for (const hyst_wire *w = g->wires + n->first_wire, *end = w + n->n_wires; w < end; w++)
    if (hyst_closes_implicit(n, w) && w->source >= 0) {
      const hyst_node *s = g->nodes + w->source;
      change = s->dy[w->from - s->y];
    }
  return change;
}

/* du / dy of a block with trials, in the direction of u for which h follows y; 0 at a limit */
static void tangent_by_trial(const hyst_graph *g, const hyst_node *n, const double *d_external) {
  const double held = tried(g, n, 0, d_external), wanted = n->du[HYST_IMPLICIT_WANTED] - held,
               off = hyst_implicit_off(n);
  const double size = n->u[HYST_IMPLICIT_WANTED] < 0 ? -n->u[HYST_IMPLICIT_WANTED] : n->u[HYST_IMPLICIT_WANTED];
  const int reached = (off < 0 ? -off : off) <= 1e-12 * (1 + size);
  double du = 0;
  for (int side = 1; side >= -1 && wanted != 0 && reached; side -= 2) {
    const double beyond = side > 0 ? n->p[HYST_IMPLICIT_HI] : n->p[HYST_IMPLICIT_LO];
    const double steps = wanted / (tried(g, n, side, d_external) - held); /* infinite if the output is stationary */
    if (n->y[0] == beyond || !(steps >= 0 && steps < HYST_INF)) continue;
    du = side * steps;
    break;
  }
  n->dy[0] = du;
}

static void tangent(const hyst_graph *g, const hyst_node *n, const double *d_external, const double *dx, double *ddx) {
  if (n->block->trial) tangent_by_trial(g, n, d_external);
  else tangent_of_block(n, dx, ddx);
}

void hyst_graph_tangent(hyst_graph *g, const double *d_external, const double *d_continuous, double *d_outputs,
                        double *d_derivatives) {
  /* two passes: a block without direct feed-through may precede its sources, which only its derivatives need */
  for (int pass = 0; pass < 2; pass++)
    for (int i = 0; i < g->n_nodes; i++) {
      const hyst_node *n = g->nodes + g->order[i];
      if (pass == 1 && n->n_c == 0) continue;
      if (n->block->rate == HYST_SAMPLED) { /* such a block holds its output and the inputs of the last sample */
        for (int64_t k = 0; k < n->n_y; k++) n->dy[k] = 0;
        continue;
      }
      int64_t first = 0;
      for (const hyst_node *m = g->nodes; n->n_c > 0 && m < n; m++) first += m->n_c;
      gather(g, n, d_external);
      tangent(g, n, d_external, d_continuous + first, d_derivatives + first);
    }
  for (const hyst_port *p = g->ports + g->first_output, *end = g->ports + g->end_output; p < end; p++)
    if (p->kind == HYST_OUTPUT) {
      const hyst_node *n = g->nodes + p->block;
      hyst_copy(d_outputs, n->dy + (p->value - n->y), p->size);
      d_outputs += p->size;
    }
}

void hyst_graph_tangent_between(hyst_graph *g, double t, const double *d_external, const double *d_continuous,
                                double *d_outputs, double *d_derivatives, double *memory) {
  memcpy(memory, g->state, (size_t)g->n_state * sizeof(double));
  hyst_graph_evaluate(g, t);
  hyst_graph_tangent(g, d_external, d_continuous, d_outputs, d_derivatives);
  memcpy(g->state, memory, (size_t)g->n_state * sizeof(double));
}
