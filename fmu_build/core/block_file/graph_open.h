/* graph_open.h - opens a block file as a graph in memory of the caller. */
#ifndef HYST_GRAPH_OPEN_H
#define HYST_GRAPH_OPEN_H
#include "core/graph/graph.h"

hyst_status hyst_graph_measure(const unsigned char *file, size_t length, size_t *bytes, hyst_error *e);
hyst_status hyst_graph_open(const unsigned char *file, size_t length, void *memory, size_t bytes, hyst_graph **g,
                            hyst_error *e);
#endif
