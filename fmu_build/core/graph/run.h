/* run.h - values by reference, start, step, run.  All return a status, HYST_E_OK on success; graph->error says more. */
#ifndef HYST_RUN_H
#define HYST_RUN_H
#include "core/graph/graph.h"

hyst_status hyst_graph_set(hyst_graph *g, int64_t reference, double value); /* checked; takes effect at the next step */
double *hyst_graph_value(hyst_graph *g, int64_t reference);                 /* or NULL */
double *hyst_graph_state(hyst_graph *g, int64_t *n);
const hyst_error *hyst_graph_error(const hyst_graph *g);
void hyst_graph_defaults(hyst_graph *g);                  /* resets all values to those of the file and the tables */
hyst_status hyst_graph_prepare(hyst_graph *g, double dt); /* after parameters changed */
hyst_status hyst_graph_start(hyst_graph *g, double t);    /* states from the parameters, then the first outputs */
hyst_status hyst_graph_step(hyst_graph *g, double t_end, double dt);
/* First part of start and step, before the first block advances, for other passes over the blocks; dt: their step. */
hyst_status hyst_graph_rest(hyst_graph *g);
hyst_status hyst_graph_ready(hyst_graph *g, double t_end, double *dt);
/* t_end of a step of h at t for a caller with a clock of its own, which began at `start` */
double hyst_graph_end_of_step(const hyst_graph *g, double start, double t, double h);
/* Runs n rows with step h and n_external inputs each; row 0 is the start; outputs in the order of the ports. */
hyst_status hyst_graph_run(hyst_graph *g, int64_t n, double t0, double h, const double *u, double *y);
#endif
