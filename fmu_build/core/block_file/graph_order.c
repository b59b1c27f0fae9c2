/* graph_order.c - finds the topological order of direct feed-through; refuses algebraic loops with their names. */
#include "core/block_file/graph_order.h"

#include "core/graph/error.h"
#include "core/graph/implicit.h"

static int feeds_through(const hyst_node *n) { return !n->block->feedthrough || n->block->feedthrough(n->dim, n->p); }

/* returns a source that must precede node i and is not ordered yet, or -1 */
static int blocked(const hyst_graph *g, const char *done, int i) {
  const hyst_node *n = g->nodes + i;
  if (!feeds_through(n)) return -1;
  for (const hyst_wire *w = g->wires + n->first_wire, *end = w + n->n_wires; w < end; w++)
    if (w->source >= 0 && !done[w->source] && !hyst_closes_implicit(n, w)) return w->source;
  return -1;
}

/* Orders the nodes.  A loop of blocks with direct feed-through has no order of evaluation: it is refused with its
 * names. */
hyst_status hyst_graph_order(hyst_graph *g) {
  char done[HYST_MOST_NODES] = {0};
  int n_done = 0;
  for (int found = 1; found;) {
    found = 0;
    for (int i = 0; i < g->n_nodes; i++)
      if (!done[i] && blocked(g, done, i) < 0) done[i] = found = 1, g->order[n_done++] = i;
  }
  int i = 0;
  while (i < g->n_nodes && done[i]) i++;
  if (i == g->n_nodes) return HYST_E_OK;
  for (int k = 0; k < g->n_nodes; k++) i = blocked(g, done, i); /* goes back along the sources until a node repeats */
  const int first = i;
  hyst_error *e = &g->error;
  hyst_fail(e, HYST_E_LOOP, NULL, NULL, g->nodes[first].name);
  do {
    i = blocked(g, done, i);
    hyst_append(e->text, sizeof e->text, " <- ");
    hyst_append(e->text, sizeof e->text, g->nodes[i].name);
  } while (i != first);
  return HYST_E_LOOP;
}
