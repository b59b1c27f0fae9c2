/* implicit.h - the one block whose output the graph has to find: implicit_inverse tries values of u on other blocks.
 *
 * Its model is every block that its input h depends on.  They must depend on its output u alone, be static (functions
 * and hysteretic blocks) and follow it in the file in topological order: hyst_implicit_check() refuses all else.
 * A wire into h is no algebraic loop.  Why a block in the graph and no flag of the file: so it stands anywhere, several
 * times, in closed loops and fused scenarios, and the parameters of the model stay visible and tunable.
 *
 * Asked the same again, it answers the same, to the last bit.  A search around the last root would end in another last
 * place than the one that led there, so that an importer which updates a unit twice at one time would see other outputs
 * than one which does it once.  So the memory holds what the root was found for, and h - y there: where those have not
 * changed (the parameters of the model may have) the root stays. */
#ifndef HYST_IMPLICIT_FILE_H
#define HYST_IMPLICIT_FILE_H
#include "core/graph/graph.h"
#include "core/graph/node.h"

/* places in the arrays of the block */
enum { HYST_IMPLICIT_LO, HYST_IMPLICIT_HI };        /* p */
enum { HYST_IMPLICIT_WANTED, HYST_IMPLICIT_MODEL }; /* u */
enum { HYST_IMPLICIT_ROOT, HYST_IMPLICIT_ASKED };   /* x; asked: y, lo, hi, h - y */

/* is this wire what the block tries its output for? */
static inline int hyst_closes_implicit(const hyst_node *n, const hyst_wire *w) {
  return n->block->flags & HYST_IMPLICIT && w->to == n->u + HYST_IMPLICIT_MODEL;
}

hyst_status hyst_implicit_check(hyst_graph *g); /* fills tried_by of all nodes */
/* n->y: the root for the present wanted value; no memory changes.  starting: the model is tried as at its start, and
 * left as init() leaves it.  Returns h - y there. */
double hyst_implicit_solve(const hyst_graph *g, const hyst_node *n, double t, int starting);

/* the memory takes the root; off: h - y there */
static inline void hyst_implicit_take(const hyst_node *n, double off) {
  const double asked[] = {n->u[HYST_IMPLICIT_WANTED], n->p[HYST_IMPLICIT_LO], n->p[HYST_IMPLICIT_HI], off};
  n->x[HYST_IMPLICIT_ROOT] = n->y[0];
  memcpy(n->x + HYST_IMPLICIT_ASKED, asked, sizeof asked);
}

/* one node of a step that ends at t: inputs, memory, outputs; dt = 0: the start of a run */
static inline void hyst_advance_node(const hyst_graph *g, const hyst_node *n, double t, double dt) {
  const hyst_block *const b = n->block;
  hyst_gather(g, n, t);
  if (b->flags & HYST_IMPLICIT) {
    hyst_implicit_take(n, hyst_implicit_solve(g, n, t, dt == 0));
    return;
  }
  if (b->update) b->update(n->dim, n->p, n->x, n->u, dt);
  b->output(n->dim, n->p, n->x, n->u, n->y);
}
#endif
