/* graph_file.h - readers of the parts of a block file, in their order. Without a graph, a reader only counts; with a
 * graph, it fills the graph.  It reports the place of an error and returns the status. */
#ifndef HYST_GRAPH_FILE_H
#define HYST_GRAPH_FILE_H
#include "core/graph/graph.h"

typedef struct {
  const unsigned char *at, *end; /* cursor that never reads past the end */
  int bad;                       /* 1 if a read would have passed the end */
} hyst_cursor;

typedef struct { /* numbers of objects and values; bytes of names */
  int64_t nodes, dims, values, external, p, x, y, u, kept, wires, ports, references;
  size_t names;
} hyst_totals;

hyst_status hyst_read_header(hyst_cursor *c, const unsigned char *file, size_t length, char *token, double *step,
                             hyst_error *e);
/* fills p and the numbers of values; then the caller places u, x, y, du, dy, and the wires are read */
hyst_status hyst_read_nodes(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e);
hyst_status hyst_read_wires(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e);
hyst_status hyst_read_ports(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e);
hyst_status hyst_count_file(const unsigned char *file, size_t length, hyst_totals *n, hyst_error *e); /* whole file */
#endif
