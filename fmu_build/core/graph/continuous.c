/* continuous.c - the passes of continuous.h.  All work on the same state: x and y of the nodes. */
#include "core/graph/continuous.h"

#include "core/graph/error.h"
#include "core/graph/node.h"
#include "core/graph/pass.h"
#include "core/graph/run.h"

int64_t hyst_graph_n_continuous(const hyst_graph *g) {
  int64_t sum = 0;
  for (int i = 0; i < g->n_nodes; i++) sum += g->nodes[i].n_c;
  return sum;
}

const hyst_var *hyst_graph_continuous_row(const hyst_graph *g, int64_t k, const hyst_node **node) {
  const hyst_node *n = g->nodes;
  for (; k >= n->n_c; n++) k -= n->n_c;
  *node = n;
  int v = 0;
  for (;; v++) {
    const int64_t size = n->block->vars[v].kind == HYST_CSTATE ? n->block->size(n->dim, v) : 0;
    if (k < size) break;
    k -= size;
  }
  return n->block->vars + v;
}

double *hyst_graph_continuous(hyst_graph *g, int64_t k) {
  const hyst_node *n = g->nodes;
  for (; k >= n->n_c; n++) k -= n->n_c;
  return n->x + k;
}

int hyst_graph_is_sampled(const hyst_graph *g) {
  for (int i = 0; i < g->n_nodes; i++)
    if (g->nodes[i].block->rate == HYST_SAMPLED) return 1;
  return 0;
}

int hyst_graph_needs_step(const hyst_graph *g) {
  int stepwise = 0, memory = 0;
  for (int i = 0; i < g->n_nodes; i++) {
    const hyst_node *n = g->nodes + i;
    memory |= n->block->rate != HYST_FUNCTION;
    stepwise |= n->time >= 0;
    for (const hyst_wire *w = g->wires + n->first_wire, *end = w + n->n_wires; w < end; w++)
      stepwise |= w->source >= i && !hyst_closes_implicit(n, w);
  }
  return hyst_graph_is_sampled(g) || (memory && stepwise);
}

void hyst_graph_evaluate(hyst_graph *g, double t) {
  for (int i = 0; i < g->n_nodes; i++) {
    const hyst_node *n = g->nodes + g->order[i];
    if (n->block->rate != HYST_SAMPLED) hyst_evaluate_node(g, n, t);
  }
}

void hyst_graph_derivatives(hyst_graph *g, double *dx) {
  for (int i = 0; i < g->n_nodes; i++) {
    const hyst_node *n = g->nodes + i;
    if (!n->block->deriv) continue;
    /* a block without feed-through may precede its sources in the order, so its inputs are complete only now.  Its
     * time is still that of evaluate */
    hyst_gather(g, n, n->time >= 0 ? n->u[n->time] : 0);
    n->block->deriv(n->dim, n->p, n->x, n->u, dx);
    dx += n->n_c;
  }
}

void hyst_graph_commit(hyst_graph *g, double t) {
  hyst_graph_evaluate(g, t);
  for (int i = 0; i < g->n_nodes; i++) {
    const hyst_node *n = g->nodes + i;
    if (n->block->rate == HYST_HYSTERETIC) hyst_commit_node(g, n, t);
  }
}

/* updates the derived values of sampled blocks that depend on the step; the others keep those of graph->dt */
static hyst_status prepare(hyst_graph *g, double dt) {
  const hyst_status s = g->changed ? hyst_graph_prepare(g, g->dt) : HYST_E_OK;
  for (int i = 0; i < g->n_nodes && !s; i++) {
    const hyst_node *n = g->nodes + i;
    if (n->block->rate != HYST_SAMPLED || !(n->block->flags & HYST_STEP)) continue;
    const char *wrong = n->block->prepare(n->dim, n->p, dt);
    if (wrong) return hyst_fail(&g->error, HYST_E_PREPARE, n->name, NULL, wrong);
  }
  return s;
}

hyst_status hyst_graph_sample(hyst_graph *g, double t, double dt) {
  const hyst_status s = prepare(g, dt);
  if (s) return s;
  hyst_graph_evaluate(g, t);
  for (int i = 0; i < g->n_nodes; i++) {
    const hyst_node *n = g->nodes + i;
    if (n->block->rate == HYST_SAMPLED) {
      hyst_gather_from(g, i, 0);
      if (n->time >= 0) n->u[n->time] = t;
      n->block->update(n->dim, n->p, n->x, n->u, dt);
      n->block->output(n->dim, n->p, n->x, n->u, n->y);
    } else {
      hyst_evaluate_node(g, n, t);
    }
  }
  hyst_graph_evaluate(g, t); /* blocks that precede a sampled block in the file */
  hyst_look_behind(g);
  return HYST_E_OK;
}
