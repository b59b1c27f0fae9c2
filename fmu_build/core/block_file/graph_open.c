/* graph_open.c - computes the memory that a graph needs and its layout in one allocation. */
#include "core/block_file/graph_open.h"

#include <string.h>

#include "core/block_file/graph_file.h"
#include "core/block_file/graph_order.h"
#include "core/graph/error.h"
#include "core/graph/implicit.h"
#include "core/graph/node.h"
#include "core/graph/run.h"

static size_t align(size_t n) { return (n + 15) / 16 * 16; }

/* parameters and their values in the file, seeds of tangents, inputs, and the state, which begins with the last step */
static size_t doubles(const hyst_totals *n) {
  return (size_t)(1 + 2 * n->p + 2 * n->u + n->x + 2 * n->y + 2 * n->external);
}

/* layout: graph, nodes, wires, ports, doubles, sizes, order, names, references */
static size_t measure(const hyst_totals *n) {
  return align(sizeof(hyst_graph)) + align((size_t)n->nodes * sizeof(hyst_node)) +
         align((size_t)n->wires * sizeof(hyst_wire)) + align((size_t)n->ports * sizeof(hyst_port)) +
         align(doubles(n) * sizeof(double)) + align((size_t)n->dims * sizeof(int)) +
         align((size_t)n->nodes * sizeof(int)) + align(n->names) + align((size_t)n->references * sizeof(uint32_t));
}

hyst_status hyst_graph_measure(const unsigned char *file, size_t length, size_t *bytes, hyst_error *e) {
  hyst_totals n;
  const hyst_status s = hyst_count_file(file, length, &n, e);
  *bytes = s ? 0 : measure(&n);
  return s;
}

static void *take(unsigned char **at, size_t bytes) {
  void *p = *at;
  *at += align(bytes);
  return p;
}

hyst_status hyst_graph_open(const unsigned char *file, size_t length, void *memory, size_t bytes, hyst_graph **out,
                            hyst_error *e) {
  hyst_totals n;
  *out = NULL;
  hyst_status s = hyst_count_file(file, length, &n, e);
  if (s) return s;
  if (bytes < measure(&n)) return hyst_fail(e, HYST_E_MEMORY, NULL, NULL, "");
  memset(memory, 0, measure(&n));
  unsigned char *at = (unsigned char *)memory;
  hyst_graph *g = (hyst_graph *)take(&at, sizeof *g);
  g->n_nodes = (int)n.nodes, g->n_ports = (int)n.ports, g->n_wires = n.wires;
  g->n_p = n.p, g->n_external = n.external, g->n_state = 1 + n.x + n.y + n.kept + n.external;
  g->nodes = (hyst_node *)take(&at, (size_t)n.nodes * sizeof(hyst_node));
  g->wires = (hyst_wire *)take(&at, (size_t)n.wires * sizeof(hyst_wire));
  g->ports = (hyst_port *)take(&at, (size_t)n.ports * sizeof(hyst_port));
  double *d = (double *)take(&at, doubles(&n) * sizeof(double));
  g->p = d, d += n.p;
  g->p_file = d, d += n.p;
  g->external_file = d, d += n.external;
  double *u = d;
  d += n.u - n.kept;
  /* step, states, outputs, stored inputs and inputs of the graph are contiguous: saved and restored at once */
  g->state = d;
  d++;
  double *x = d, *y = d + n.x, *kept = y + n.y;
  g->external = kept + n.kept;
  double *du = g->external + n.external, *dy = du + n.u;
  g->dims = (int *)take(&at, (size_t)n.dims * sizeof(int));
  g->order = (int *)take(&at, (size_t)n.nodes * sizeof(int));
  g->names = (char *)take(&at, n.names);
  g->n_references = n.references;
  g->port_of = (uint32_t *)take(&at, (size_t)n.references * sizeof(uint32_t));
  hyst_cursor c;
  memset(&n, 0, sizeof n);
  hyst_read_header(&c, file, length, g->token, &g->step, e); /* valid: hyst_count_file() has read it */
  s = hyst_read_nodes(&c, &n, g, e);
  if (s) return s;
  for (int i = 0; i < g->n_nodes; i++) {
    hyst_node *node = g->nodes + i;
    double **inputs = node->block->rate == HYST_SAMPLED ? &kept : &u; /* see hyst_look_behind() */
    node->u = *inputs, *inputs += node->n_u;
    node->x = x, x += node->n_x;
    node->y = y, y += node->n_y;
    node->du = du, du += node->n_u;
    node->dy = dy, dy += node->n_y;
  }
  s = hyst_read_wires(&c, &n, g, e);
  if (!s) s = hyst_read_ports(&c, &n, g, e);
  if (s) return s;
  memcpy(g->p_file, g->p, (size_t)g->n_p * sizeof(double));
  hyst_graph_defaults(g);
  s = hyst_graph_prepare(g, 0);
  if (!s) s = hyst_graph_order(g);
  if (!s) s = hyst_implicit_check(g);
  if (s) return *e = g->error, s;
  *out = g;
  return HYST_E_OK;
}
