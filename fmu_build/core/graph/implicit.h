/* implicit.h - blocks whose output the graph has to find (hyst_block.trial), as implicit_inverse: it tries values of u
 * on other blocks, until their output, its input h, is the wanted one, its first input.
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

/* places in the arrays of such a block */
enum { HYST_IMPLICIT_LO, HYST_IMPLICIT_HI };      /* p */
enum { HYST_IMPLICIT_WANTED };                    /* u; input k stands at k - 1 */
enum { HYST_IMPLICIT_ROOT, HYST_IMPLICIT_ASKED }; /* x; asked: y, lo, hi, h - y */

/* is this wire what the block tries its output for? */
static inline int hyst_closes_implicit(const hyst_node *n, const hyst_wire *w) {
  return n->block->trial && w->to == n->u + n->block->trial - 1;
}
/* h - y for the inputs that were gathered */
static inline double hyst_implicit_off(const hyst_node *n) {
  return n->u[n->block->trial - 1] - n->u[HYST_IMPLICIT_WANTED];
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
#endif
