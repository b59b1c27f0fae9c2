/* pass.h - operations of the passes on one node.  Only here, and for the tangent in tangent.c, the table decides
 * whether output() gives the output of a block or the graph finds it by trial. */
#ifndef HYST_PASS_H
#define HYST_PASS_H
#include "core/graph/implicit.h"
#include "core/graph/node.h"

/* gathers inputs at time t, then computes outputs; the memory stays unchanged */
static inline void hyst_evaluate_node(const hyst_graph *g, const hyst_node *n, double t) {
  hyst_gather(g, n, t);
  if (n->block->trial) hyst_implicit_solve(g, n, t, 0);
  else n->block->output(n->dim, n->p, n->x, n->u, n->y);
}

/* passes the inputs to the memory of a hysteretic block, after all nodes have been evaluated */
static inline void hyst_commit_node(const hyst_graph *g, const hyst_node *n, double t) {
  hyst_gather(g, n, t);
  if (n->block->trial) hyst_implicit_take(n, hyst_implicit_off(n));
  else n->block->update(n->dim, n->p, n->x, n->u, 1); /* such blocks ignore the length of the step */
}

/* makes a step of one node that ends at t: inputs, memory, outputs; dt = 0: start of a run */
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
