/* graph.h - a graph of blocks, read from a block file and run in a stated order.
 *
 * One step is a Gauss-Seidel pass in the order of the file: every block reads the present outputs of its sources
 * (new ones of blocks before it, held ones of blocks after it), commits update(dt), and writes its outputs.  The
 * outputs after a step to time t are those at t for the inputs held at its end.  A single block is a graph of one. The
 * caller owns the memory: hyst_graph_measure() says how much, hyst_graph_open() lays it out.  Format of the file:
 * fmu_build/README.md */
#ifndef HYST_GRAPH_H
#define HYST_GRAPH_H
#include "core/hyst.h"

enum { HYST_TOKEN = 40 }; /* bytes of the token that ties a block file to its modelDescription.xml, ends with 0 */
enum { HYST_MOST_NODES = 1000 };

/* What went wrong, and where; hyst_message() makes the sentence. */
typedef struct {
  hyst_status status;
  char block[64], variable[64], text[192]; /* instance, name, rule; "" where it does not apply */
  const hyst_var *row;                     /* whose range was violated, or NULL */
  double value;
} hyst_error;
int hyst_message(const hyst_error *e, char *text, size_t size);
const char *hyst_number(char *to, size_t size, double v);         /* as a person writes it; never a decimal comma; to */
void hyst_interval(const hyst_var *row, char *text, size_t size); /* its legal values in words */

/* types of the table, as bits */
enum { HYST_REAL = 1, HYST_INT = 2, HYST_BOOL = 4, HYST_CHOICE = 8 };

/* A variable seen from outside.  Its elements have the value references reference, reference + 1, ... */
typedef struct {
  const char *name;
  int kind; /* HYST_PARAM, HYST_FIXED, HYST_INPUT, HYST_OUTPUT */
  int block, var, type;
  int64_t reference, size;
  const hyst_var *row;
  double *value; /* its place in the graph's memory */
} hyst_port;

typedef struct {
  const char *name; /* instance name */
  const hyst_block *block;
  const int *dim;
  double *p, *u, *y, *x;
  int64_t n_p, n_u, n_y, n_x;
  double *du, *dy;             /* seeds and tangents of u and y: of hyst_graph_tangent() alone, no state */
  int64_t n_c;                 /* its continuous states: the first of x */
  int64_t time;                /* place of the time among u, or -1 */
  int64_t first_wire, n_wires; /* its wires, gathered into u before update() */
  int tried_by;                /* the implicit_inverse whose model it belongs to, or -1 */
} hyst_node;

typedef struct {
  const double *from;
  double *to;
  int64_t size;
  int source; /* node, or -1: an input of the graph */
} hyst_wire;

typedef struct {
  char token[HYST_TOKEN];
  int n_nodes, n_ports;
  int first_output, end_output; /* the ports between hold all outputs */
  int64_t n_wires;
  hyst_node *nodes;
  hyst_wire *wires;
  hyst_port *ports;
  int64_t n_references;
  uint32_t *port_of; /* of every value reference: set and get are called in every step, a search would be seen */
  int *dims, *order; /* order: node numbers, every block after the sources that it passes on at once */
  char *names;
  double *p, *p_file;               /* all parameters; as they stand in the file */
  double *external, *external_file; /* inputs of the graph; their start values */
  double *state; /* all that a run changes: the last step, every x, every y, u of sampled blocks, inputs of the graph */
  int64_t n_p, n_state, n_external;
  int changed; /* parameters were set since prepare() ran */
  double dt;   /* the step that the derived values of STEP blocks belong to */
  double step; /* sample period of the model, for its sampled blocks in continuous time; 0: none is stated */
  hyst_error error;
} hyst_graph;

/* All return HYST_E_OK or the status; details are in *e or graph->error. */
hyst_status hyst_graph_measure(const unsigned char *file, size_t length, size_t *bytes, hyst_error *e);
hyst_status hyst_graph_open(const unsigned char *file, size_t length, void *memory, size_t bytes, hyst_graph **g,
                            hyst_error *e);
/* NULL: no such value reference */
static inline const hyst_port *hyst_graph_port(const hyst_graph *g, int64_t reference) {
  return reference >= 0 && reference < g->n_references ? g->ports + g->port_of[reference] : NULL;
}
int hyst_type(const hyst_var *row); /* one of the bits */
/* Is the value legal for this variable?  Refuses NaN, infinities, values out of range, fractions of an int. */
hyst_status hyst_check(const hyst_var *row, double value);
static inline hyst_status hyst_check_port(const hyst_port *p, double value) { /* the same, sooner for a real number */
  if (p->type == HYST_REAL && value > p->row->lo && value < p->row->hi) return HYST_E_OK; /* so it is finite */
  return hyst_check(p->row, value);
}
hyst_status hyst_graph_set(hyst_graph *g, int64_t reference, double value); /* checked; takes effect at the next step */
double *hyst_graph_value(hyst_graph *g, int64_t reference);                 /* or NULL */
double *hyst_graph_state(hyst_graph *g, int64_t *n);
const hyst_error *hyst_graph_error(const hyst_graph *g);
void hyst_graph_defaults(hyst_graph *g);                  /* all values as in the file and the tables */
hyst_status hyst_graph_order(hyst_graph *g);              /* fills order; refuses algebraic loops */
hyst_status hyst_graph_prepare(hyst_graph *g, double dt); /* after parameters changed */
hyst_status hyst_graph_start(hyst_graph *g, double t);    /* states from the parameters, then the first outputs */
hyst_status hyst_graph_step(hyst_graph *g, double t_end, double dt);
/* n rows, h apart, with n_external inputs each; row 0 is the start; outputs in the order of the ports. */
hyst_status hyst_graph_run(hyst_graph *g, int64_t n, double t0, double h, const double *u, double *y);
#endif
