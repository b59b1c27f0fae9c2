/* tangent.h - directional derivatives of a graph in continuous time. */
#ifndef HYST_TANGENT_H
#define HYST_TANGENT_H
#include "core/graph/graph.h"

/* Directional derivatives at the point and time of the last evaluate.  Seeds: one per element of the graph inputs
 * (n_external) and per continuous state.  Results: one per element of the output ports, in order, and per derivative.
 * Exact; one-sided at kinks, in the direction of the seeds; memories and sampled outputs stay constant.  Infinite where
 * a branch has an infinite slope, at the start of a branch of zhao_tan_inverse. */
void hyst_graph_tangent(hyst_graph *g, const double *d_external, const double *d_continuous, double *d_outputs,
                        double *d_derivatives);
/* The same at time t for the current inputs, between two steps, without side effects.  memory: room for the state. */
void hyst_graph_tangent_between(hyst_graph *g, double t, const double *d_external, const double *d_continuous,
                                double *d_outputs, double *d_derivatives, double *memory);
#endif
