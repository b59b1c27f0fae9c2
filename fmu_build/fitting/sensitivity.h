/* sensitivity.h - derivatives of the outputs of a run by parameters and start states, beside the run, in one pass.
 *
 * A column is a direction in the space of parameters: a fit wants one for each thing that it searches.  Blocks that
 * state `sensitivity` are exact.  The others are run once more for each column that reaches them, with their parameters
 * and inputs moved by the amounts of the column times `step`; functions take their tangent instead where only inputs
 * change.  At a kink the derivative is that of one side. */
#ifndef HYST_SENSITIVITY_FILE_H
#define HYST_SENSITIVITY_FILE_H
#include "core/graph/graph.h"

/* by how much a parameter changes for 1 of a column */
typedef struct {
  int64_t reference, column;
  double size;
} hyst_seed;

/* Seeds stand in the order of columns, and within a column in that of nodes.  Columns stand in the order of the first
 * node that they change; among those of one node the ones with several seeds come first. */
typedef struct {
  int64_t n_columns, n_seeds, n_picked;
  const hyst_seed *seeds;
  const int64_t *picked; /* the rows to return, rising */
  double step;           /* part of a column that a difference moves */
  double *y;             /* [n_picked][outputs] */
  double *dy;            /* [n_picked][outputs][n_columns] */
} hyst_sensitivity;

size_t hyst_sensitivity_measure(const hyst_graph *g, const hyst_sensitivity *s); /* bytes of memory */
/* Runs as hyst_graph_run() does.  Refuses a graph with an implicit inverse, and seeds that are out of order. */
hyst_status hyst_sensitivity_run(hyst_graph *g, int64_t n, double t0, double h, const double *u,
                                 const hyst_sensitivity *s, void *memory);
#endif
