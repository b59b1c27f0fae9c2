/* graph_open.h - from a block file to a graph in the caller's memory: how much it needs, and laid out in it. */
#ifndef HYST_GRAPH_OPEN_H
#define HYST_GRAPH_OPEN_H
#include "core/graph/graph.h"

hyst_status hyst_graph_measure(const unsigned char *file, size_t length, size_t *bytes, hyst_error *e);
hyst_status hyst_graph_open(const unsigned char *file, size_t length, void *memory, size_t bytes, hyst_graph **g,
                            hyst_error *e);
#endif
