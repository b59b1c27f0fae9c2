/* implicit.h - blocks whose output the graph finds by trial (hyst_block.trial), such as implicit_inverse: values of u
 * are tried on other blocks until their output, the input h, equals the wanted value, the first input.
 *
 * The model of such a block consists of all blocks that h depends on. These blocks must depend only on u and on inputs
 * of the graph, which are constant during the search. They must be static (functions and hysteretic blocks) and follow
 * the inverse in the file in topological order; hyst_implicit_check() reports all other blocks. They may also read
 * blocks without direct feed-through that precede the inverse in the file, such as the lags of a creep: these lags have
 * made their step and are constant during the search. A wire into h is no algebraic loop. The inverse is a block, not a
 * flag of the file. Therefore a graph may contain several inverses, also in closed loops, and the parameters of the
 * model stay tunable.
 *
 * Equal requests give bit-identical results. A second search from the last root would change the last bits, so an
 * importer that updates a unit twice at the same time would get different outputs. Therefore the memory contains the
 * request of the root, and h - y at the root. If both are unchanged, the root stays; h - y changes if parameters of
 * the model change. The previous root and its output give the first slope of the next search. */
#ifndef HYST_IMPLICIT_FILE_H
#define HYST_IMPLICIT_FILE_H
#include "core/graph/graph.h"
#include "core/graph/node.h"

/* indices in the arrays of such a block */
enum { HYST_IMPLICIT_LO, HYST_IMPLICIT_HI };                                /* p */
enum { HYST_IMPLICIT_WANTED };                                              /* u; input k has index k - 1 */
enum { HYST_IMPLICIT_ROOT, HYST_IMPLICIT_ASKED, HYST_IMPLICIT_BEFORE = 5 }; /* x; request: y, lo, hi, h - y */

/* returns 1 if this wire carries the output of the model */
static inline int hyst_closes_implicit(const hyst_node *n, const hyst_wire *w) {
  return n->block->trial && w->to == n->u + n->block->trial - 1;
}
/* h - y for the gathered inputs */
static inline double hyst_implicit_off(const hyst_node *n) {
  return n->u[n->block->trial - 1] - n->u[HYST_IMPLICIT_WANTED];
}

hyst_status hyst_implicit_check(hyst_graph *g); /* fills tried_by of all nodes */
/* Sets n->y to the root for the current wanted value; no memory changes.  starting: tries the model in its initial
 * state and leaves it as init() does.  Returns h - y at the root. */
double hyst_implicit_solve(const hyst_graph *g, const hyst_node *n, double t, int starting);

/* stores the root in the memory; off: h - y there */
static inline void hyst_implicit_take(const hyst_node *n, double off) {
  double *last = n->x + HYST_IMPLICIT_ROOT;
  if (n->y[0] != *last) {
    n->x[HYST_IMPLICIT_BEFORE] = *last;
    n->x[HYST_IMPLICIT_BEFORE + 1] = n->x[HYST_IMPLICIT_ASKED] + n->x[HYST_IMPLICIT_ASKED + 3];
  }
  const double asked[] = {n->u[HYST_IMPLICIT_WANTED], n->p[HYST_IMPLICIT_LO], n->p[HYST_IMPLICIT_HI], off};
  *last = n->y[0];
  memcpy(n->x + HYST_IMPLICIT_ASKED, asked, sizeof asked);
}
#endif
