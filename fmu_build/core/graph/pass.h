/* pass.h - what the passes over a graph do with one node.  Here, and for its tangent in tangent.c, the table decides
 * whether a block has its output by output() or the graph finds it by trial; no pass asks. */
#ifndef HYST_PASS_H
#define HYST_PASS_H
#include "core/graph/implicit.h"
#include "core/graph/node.h"

/* inputs at time t, then outputs; no memory changes */
static inline void hyst_evaluate_node(const hyst_graph *g, const hyst_node *n, double t) {
  hyst_gather(g, n, t);
  if (n->block->trial) hyst_implicit_solve(g, n, t, 0);
  else n->block->output(n->dim, n->p, n->x, n->u, n->y);
}

/* the memory of a hysteretic block takes its inputs, after all nodes were evaluated */
static inline void hyst_commit_node(const hyst_graph *g, const hyst_node *n, double t) {
  hyst_gather(g, n, t);
  if (n->block->trial) hyst_implicit_take(n, hyst_implicit_off(n));
  else n->block->update(n->dim, n->p, n->x, n->u, 1); /* no such block looks at the length of a step */
}

/* one node of a step that ends at t: inputs, memory, outputs; dt = 0: the start of a run */
static inline void hyst_advance_node(const hyst_graph *g, const hyst_node *n, double t, double dt) {
  const hyst_block *const b = n->block;
  hyst_gather(g, n, t);
  if (b->trial) {
    hyst_implicit_take(n, hyst_implicit_solve(g, n, t, dt == 0));
    return;
  }
  if (b->update) b->update(n->dim, n->p, n->x, n->u, dt);
  b->output(n->dim, n->p, n->x, n->u, n->y);
}
#endif
