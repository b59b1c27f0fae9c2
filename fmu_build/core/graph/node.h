/* node.h - what every pass over a graph needs: the class of a node in continuous time, its inputs, the step in use. */
#ifndef HYST_NODE_H
#define HYST_NODE_H
#include <string.h>

#include "core/graph/graph.h"
#include "core/graph/layout.h"

/* the start values of the table for its variables of the kinds from `first` on */
static inline void hyst_fill(const hyst_node *n, hyst_kind first) {
  for (int v = 0; v < n->block->n_vars; v++) {
    const hyst_kind k = n->block->vars[v].kind;
    if (k < first) continue;
    double *to = (k <= HYST_TIME ? n->u : k == HYST_OUTPUT ? n->y : n->x) + hyst_place(n->block, n->dim, v);
    for (int64_t m = n->block->size(n->dim, v); m > 0; m--) *to++ = n->block->vars[v].start;
  }
}

/* its states as they are before the first input */
static inline void hyst_rest(const hyst_node *n) {
  hyst_fill(n, HYST_CSTATE);
  if (n->block->init) n->block->init(n->dim, n->p, n->x);
}

/* n >= 1 numbers, mostly one or two: those without the set-up of a loop or a call */
static inline void hyst_copy(double *to, const double *from, int64_t n) {
  to[0] = from[0];
  if (n == 1) return;
  to[1] = from[1];
  if (n > 2) memcpy(to + 2, from + 2, (size_t)(n - 2) * sizeof *to);
}

/* A master that computes the step as a difference of times gets another rounding in every step.  It must not see
 * another discretisation: a step that differs from the last one by rounding alone is the last one. */
static inline double hyst_same_step(double dt, double last, double t_end) {
  const double off = dt > last ? dt - last : last - dt, t = t_end < 0 ? -t_end : t_end;
  return last > 0 && off <= 4.5e-16 * (t + last) ? last : dt; /* two units in the last place of the times */
}

/* inputs from the present outputs of its sources */
static inline void hyst_gather(const hyst_graph *g, const hyst_node *n, double t) {
  for (const hyst_wire *w = g->wires + n->first_wire, *end = w + n->n_wires; w < end; w++)
    hyst_copy(w->to, w->from, w->size);
  if (n->time >= 0) n->u[n->time] = t;
}

/* those from blocks behind node i in the file (and itself), or the others */
static inline void hyst_gather_from(const hyst_graph *g, int i, int behind) {
  const hyst_node *n = g->nodes + i;
  for (const hyst_wire *w = g->wires + n->first_wire, *end = w + n->n_wires; w < end; w++)
    if ((w->source >= i) == behind) hyst_copy(w->to, w->from, w->size);
}

/* In a step a block reads of those behind it what they had after the last step.  In continuous time they run on between
 * two samples, and would be seen a sample too early: a sampled block takes such inputs right after a sample and keeps
 * them, and the others when it advances. */
static inline void hyst_look_behind(const hyst_graph *g) {
  for (int i = 0; i < g->n_nodes; i++)
    if (g->nodes[i].block->rate == HYST_SAMPLED) hyst_gather_from(g, i, 1);
}
#endif
