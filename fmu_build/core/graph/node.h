/* node.h - shared by all passes over a graph: rate class of a node, its inputs, the current step. */
#ifndef HYST_NODE_H
#define HYST_NODE_H
#include <string.h>

#include "core/graph/graph.h"
#include "core/graph/layout.h"

/* copies the start values of the table for variables of the kinds from `first` on */
static inline void hyst_fill(const hyst_node *n, hyst_kind first) {
  for (int v = 0; v < n->block->n_vars; v++) {
    const hyst_kind k = n->block->vars[v].kind;
    if (k < first) continue;
    double *to = (k <= HYST_TIME ? n->u : k == HYST_OUTPUT ? n->y : n->x) + hyst_place(n->block, n->dim, v);
    for (int64_t m = n->block->size(n->dim, v); m > 0; m--) *to++ = n->block->vars[v].start;
  }
}

/* sets the states before the first input */
static inline void hyst_rest(const hyst_node *n) {
  hyst_fill(n, HYST_CSTATE);
  if (n->block->init) n->block->init(n->dim, n->p, n->x);
}

/* Returns 1 for a block such as a delay, whose output is known before its first input. Blocks that precede it in the
 * order read this output. */
static inline int hyst_says_first(const hyst_node *n) {
  const hyst_block *const b = n->block;
  return b->rate == HYST_SAMPLED && b->feedthrough && !b->feedthrough(n->dim, n->p);
}

/* copies n >= 1 numbers, mostly one or two, without the cost of a loop or a call for these */
static inline void hyst_copy(double *to, const double *from, int64_t n) {
  to[0] = from[0];
  if (n == 1) return;
  to[1] = from[1];
  if (n > 2) memcpy(to + 2, from + 2, (size_t)(n - 2) * sizeof *to);
}

/* If a master computes the step as a difference of times, each step has a different rounding error, which must not
 * change the discretisation. A step that differs from the last step only by rounding is replaced by the last step. */
static inline double hyst_same_step(double dt, double last, double t_end) {
  const double off = dt > last ? dt - last : last - dt, t = t_end < 0 ? -t_end : t_end;
  return last > 0 && off <= 4.5e-16 * (t + last) ? last : dt; /* two units in the last place of the times */
}

/* gathers the inputs from the current outputs of the sources */
static inline void hyst_gather(const hyst_graph *g, const hyst_node *n, double t) {
  for (const hyst_wire *w = g->wires + n->first_wire, *end = w + n->n_wires; w < end; w++)
    hyst_copy(w->to, w->from, w->size);
  if (n->time >= 0) n->u[n->time] = t;
}

/* gathers the inputs from node i and later nodes of the file, or those from earlier nodes */
static inline void hyst_gather_from(const hyst_graph *g, int i, int behind) {
  const hyst_node *n = g->nodes + i;
  for (const hyst_wire *w = g->wires + n->first_wire, *end = w + n->n_wires; w < end; w++)
    if ((w->source >= i) == behind) hyst_copy(w->to, w->from, w->size);
}

/* In a step, a block reads the outputs of later blocks after the last step. In continuous time, these outputs change
 * between two samples. So a sampled block stores such inputs right after a sample, and reads the other inputs when it
 * advances. */
static inline void hyst_look_behind(const hyst_graph *g) {
  for (int i = 0; i < g->n_nodes; i++)
    if (g->nodes[i].block->rate == HYST_SAMPLED) hyst_gather_from(g, i, 1);
}
#endif
