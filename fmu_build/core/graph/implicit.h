/* implicit.h - blocks whose output the graph finds by trial (hyst_block.trial), such as implicit_inverse: values of u
 * are tried on other blocks until their output, the input h, equals the wanted value, the first input.
 *
 * The model of such a block consists of all blocks that h depends on.  They must depend on u and on inputs of the graph
 * alone, which hold during the search, be static (functions and hysteretic blocks) and follow the block in the file in
 * topological order; hyst_implicit_check() refuses all else.  They may also read blocks without direct feed-through
 * that precede it in the file, such as the lags of a creep: these have made their step from the last root and are
 * constant during the search.  A wire into h is no algebraic loop.  Because the inverse is a block and not a flag of
 * the file, it can occur anywhere and several times, in closed loops and fused scenarios, and the parameters of the
 * model stay visible and tunable.
 *
 * Equal requests get equal results, to the last bit.  A search from the last root would end with other last bits, so an
 * importer that updates a unit twice at one time would see other outputs than one that updates once.  Hence the memory
 * holds the request of the root and h - y there: if they are unchanged (the parameters of the model may have changed),
 * the root stays.  The root before it and the output there give the next search its first slope. */
#ifndef HYST_IMPLICIT_FILE_H
#define HYST_IMPLICIT_FILE_H
#include "core/graph/graph.h"
#include "core/graph/node.h"

/* indices in the arrays of such a block */
enum { HYST_IMPLICIT_LO, HYST_IMPLICIT_HI };                                /* p */
enum { HYST_IMPLICIT_WANTED };                                              /* u; input k has index k - 1 */
enum { HYST_IMPLICIT_ROOT, HYST_IMPLICIT_ASKED, HYST_IMPLICIT_BEFORE = 5 }; /* x; request: y, lo, hi, h - y */

/* whether this wire carries the output of the model */
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
