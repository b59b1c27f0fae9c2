/* graph_file.h - readers of the parts of a block file, in their order.  Without a graph a reader counts, with a graph
 * it fills it.  It reports the place of an error and returns the status. */
#ifndef HYST_GRAPH_FILE_H
#define HYST_GRAPH_FILE_H
#include "core/graph/graph.h"

typedef struct {
  const unsigned char *at, *end; /* reading never passes the end */
  int bad;                       /* a read would have passed the end */
} hyst_cursor;

typedef struct { /* numbers of objects and values; bytes of names */
  int64_t nodes, dims, values, external, p, x, y, u, kept, wires, ports, references;
  size_t names;
} hyst_totals;

hyst_status hyst_read_header(hyst_cursor *c, const unsigned char *file, size_t length, char *token, double *step,
                             hyst_error *e);
/* fills p and the numbers of values; the caller places u, x, y, du, dy before the wires are read */
hyst_status hyst_read_nodes(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e);
hyst_status hyst_read_wires(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e);
hyst_status hyst_read_ports(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e);
hyst_status hyst_count_file(const unsigned char *file, size_t length, hyst_totals *n, hyst_error *e); /* whole file */
#endif
