/* node.h - what every pass over a graph does with one node: its class in continuous time, its inputs. */
#ifndef HYST_NODE_H
#define HYST_NODE_H
#include "graph.h"

typedef enum { HYST_FUNCTION, HYST_CONTINUOUS, HYST_HYSTERETIC, HYST_SAMPLED } hyst_class; /* see continuous.h */

static inline hyst_class hyst_class_of(const hyst_block *b) {
  if (b->deriv) return HYST_CONTINUOUS;
  if (!b->update) return HYST_FUNCTION;
  return b->flags & HYST_RATE_INDEPENDENT ? HYST_HYSTERETIC : HYST_SAMPLED;
}

/* n >= 1 numbers, mostly one: the first alone, so that nothing is set up for a loop that does not run */
static inline void hyst_copy(double *to, const double *from, int64_t n) {
  *to = *from;
  for (int64_t k = 1; k < n; k++) to[k] = from[k];
}

/* inputs from the present outputs of its sources */
static inline void hyst_gather(const hyst_graph *g, const hyst_node *n, double t) {
  for (const hyst_wire *w = g->wires + n->first_wire, *end = w + n->n_wires; w < end; w++)
    hyst_copy(w->to, w->from, w->size);
  if (n->time >= 0) n->u[n->time] = t;
}
#endif
