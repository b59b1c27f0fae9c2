/* graph_order.h - the topological order of direct feed-through. */
#ifndef HYST_GRAPH_ORDER_H
#define HYST_GRAPH_ORDER_H
#include "core/graph/graph.h"

hyst_status hyst_graph_order(hyst_graph *g); /* fills order; refuses algebraic loops */
#endif
