/* continuous.h - a graph in continuous time: what Model Exchange, Event Mode and the implicit inverse need.
 *
 * Every block is one of
 *   continuous   has deriv(): its CSTATEs belong to the solver; its update() is called at the start only
 *   hysteretic   output() at a trial input is pure; the memory takes it in hyst_graph_commit()
 *   sampled      any other block with update(): holds its output from sample to sample, hyst_graph_sample()
 *   function     no memory
 * A run: hyst_graph_start() once, then for the present inputs, time and continuous states evaluate() and derivatives()
 * as often as a solver likes, commit() where it accepts a step, and sample() followed by commit() every graph->step
 * seconds if the graph is sampled.  The continuous states are part of hyst_graph_state().
 * Parameters that were set (graph->changed) take effect by hyst_graph_prepare(g, g->dt), which can refuse them. */
#ifndef HYST_CONTINUOUS_H
#define HYST_CONTINUOUS_H
#include "core/graph/graph.h"

int64_t hyst_graph_n_continuous(const hyst_graph *g);
/* The place of the k-th, in the order of the nodes, their rows and elements.  A name for it: <node name>_<row name>,
 * without the node's where the graph is a single block, and _<element> (from 1) where the row has several: see
 * Graph.continuous_states in Python. */
double *hyst_graph_continuous(hyst_graph *g, int64_t k);
const hyst_var *hyst_graph_continuous_row(const hyst_graph *g, int64_t k, const hyst_node **node, int64_t *element);
int hyst_graph_is_sampled(const hyst_graph *g); /* does it need a sample period? */
/* outputs at time t for the present inputs and continuous states, in topological order; no memory changes */
void hyst_graph_evaluate(hyst_graph *g, double t);
void hyst_graph_derivatives(hyst_graph *g, double *dx); /* after evaluate, at its time */
void hyst_graph_commit(hyst_graph *g, double t);        /* evaluate, then hysteretic memories take their inputs */
/* Evaluate, then sampled blocks advance by dt in the order of the file, then all outputs follow.  dt = graph->step,
 * whatever the time since the last sample really was: hyst_graph_start() is the sample at the start time. */
hyst_status hyst_graph_sample(hyst_graph *g, double t, double dt);
/* hyst_graph_step() without its samples: sampled blocks hold, so that hyst_graph_sample() can follow at t_end. */
hyst_status hyst_graph_hold(hyst_graph *g, double t_end, double dt);
#endif
