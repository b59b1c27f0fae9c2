/* graph.h - a graph of blocks in memory: what graph_open.c lays out and run.c, continuous.c and tangent.c run.
 *
 * A step is a Gauss-Seidel pass in the order of the file: every block reads the current outputs of its sources (new
 * ones of earlier blocks, old ones of later blocks), calls update(dt), and writes its outputs.  The outputs after a
 * step to time t are those at t for the inputs held at its end.  A single block is a graph of one node.  The caller
 * owns the memory: hyst_graph_measure() returns its size, hyst_graph_open() lays it out.  File format:
 * fmu_build/README.md */
#ifndef HYST_GRAPH_H
#define HYST_GRAPH_H
#include "core/graph/error.h"

enum { HYST_TOKEN = 40 }; /* bytes of the token that links a block file to its modelDescription.xml, zero-terminated */
enum { HYST_MOST_NODES = 1000 };

/* A public variable.  Its elements have the value references reference, reference + 1, ... */
typedef struct {
  const char *name;
  int kind; /* HYST_PARAM, HYST_FIXED, HYST_INPUT, HYST_OUTPUT */
  int block, var, type;
  int64_t reference, size;
  const hyst_var *row;
  double *value; /* place in the memory of the graph */
} hyst_port;

typedef struct {
  const char *name; /* instance name */
  const hyst_block *block;
  const int *dim;
  double *p, *u, *y, *x;
  int64_t n_p, n_u, n_y, n_x;
  double *du, *dy; /* seeds and tangents of u and y, used by hyst_graph_tangent() only; not part of the state */
  int64_t n_c;     /* number of continuous states, the first elements of x */
  int64_t time;    /* index of the time in u, or -1 */
  int64_t first_wire, n_wires; /* wires, gathered into u before update() */
  int tried_by;                /* block with trials whose model contains this node, or -1 */
} hyst_node;

typedef struct {
  const double *from;
  double *to;
  int64_t size;
  int source; /* node, or -1 for an input of the graph */
} hyst_wire;

typedef struct {
  char token[HYST_TOKEN];
  int n_nodes, n_ports;
  int first_output, end_output; /* range of ports that contains all outputs */
  int64_t n_wires;
  hyst_node *nodes;
  hyst_wire *wires;
  hyst_port *ports;
  int64_t n_references;
  uint32_t *port_of; /* by value reference: set and get run in every step, where a search would be too slow */
  int *dims, *order; /* order: node numbers, every block after the sources of its direct feed-through */
  char *names;
  double *p, *p_file;               /* all parameters; their values in the file */
  double *external, *external_file; /* inputs of the graph; their start values */
  double *state; /* all values that a run changes: last step, all x, all y, u of sampled blocks, inputs of the graph */
  int64_t n_p, n_state, n_external;
  int changed; /* parameters were set since the last prepare() */
  double dt;   /* the step of the derived values of STEP blocks */
  double step; /* sample period of sampled blocks in continuous time; 0: none */
  hyst_error error;
} hyst_graph;

/* NULL: unknown value reference */
static inline const hyst_port *hyst_graph_port(const hyst_graph *g, int64_t reference) {
  return reference >= 0 && reference < g->n_references ? g->ports + g->port_of[reference] : NULL;
}
static inline hyst_status hyst_check_port(const hyst_port *p, double value) { /* same check, faster for a real */
  if (p->type == HYST_REAL && value > p->row->lo && value < p->row->hi) return HYST_E_OK; /* hence finite */
  return hyst_check(p->row, value);
}
#endif
