/* continuous.h - a graph in continuous time: what Model Exchange, Event Mode and the implicit inverse need.
 *
 * Rate classes of blocks:
 *   continuous   has deriv(): the solver owns its CSTATEs; update() is called at the start only
 *   hysteretic   output() at a trial input is pure; hyst_graph_commit() passes the input to the memory
 *   sampled      any other block with update(): holds its output between samples, hyst_graph_sample()
 *   function     no memory
 * A run calls hyst_graph_start() once.  Then, for the current inputs, time and continuous states, it calls evaluate()
 * and derivatives() as often as the solver needs, commit() after each accepted step, and sample() followed by commit()
 * every graph->step seconds if the graph is sampled.  The continuous states are part of hyst_graph_state().
 * New parameter values (graph->changed) take effect by hyst_graph_prepare(g, g->dt), which may refuse them. */
#ifndef HYST_CONTINUOUS_H
#define HYST_CONTINUOUS_H
#include "core/graph/graph.h"

int64_t hyst_graph_n_continuous(const hyst_graph *g);
/* The place of state k, in the order of nodes, rows and elements.  Its name is <node name>_<row name>, without the node
 * name in a graph of one block, and with _<element> (from 1) if the row has several; see Graph.continuous_states in
 * Python. */
double *hyst_graph_continuous(hyst_graph *g, int64_t k);
const hyst_var *hyst_graph_continuous_row(const hyst_graph *g, int64_t k, const hyst_node **node);
int hyst_graph_is_sampled(const hyst_graph *g); /* returns 1 if Model Exchange needs a sample period */
/* Returns 1 if the length of the step changes the model: for a sampled block, and for a memory whose source is known
 * only at the steps, because the graph depends on the time or reads outputs of the last step in a loop. */
int hyst_graph_needs_step(const hyst_graph *g);
/* outputs at time t for the current inputs and continuous states, in topological order; the memory stays unchanged */
void hyst_graph_evaluate(hyst_graph *g, double t);
void hyst_graph_derivatives(hyst_graph *g, double *dx); /* after evaluate, at the same time */
void hyst_graph_commit(hyst_graph *g, double t);        /* evaluate, then pass the inputs to hysteretic memories */
/* Evaluates, advances sampled blocks by dt in the order of the file, and updates all outputs.  dt = graph->step,
 * whatever the actual time since the last sample; hyst_graph_start() is the sample at the start time. */
hyst_status hyst_graph_sample(hyst_graph *g, double t, double dt);
#endif
