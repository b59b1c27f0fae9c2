/* graph_file.h - the parts of a block file in their order, each read by one walker: without a graph it counts, with one
 * it fills.  A walker says where the file is wrong and returns the status. */
#ifndef HYST_GRAPH_FILE_H
#define HYST_GRAPH_FILE_H
#include "core/graph/graph.h"

typedef struct {
  const unsigned char *at, *end; /* it never passes the end */
  int bad;                       /* it would have */
} hyst_cursor;

typedef struct { /* numbers of things and of values; bytes of names */
  int64_t nodes, dims, values, external, p, x, y, u, kept, wires, ports, references;
  size_t names;
} hyst_totals;

hyst_status hyst_read_header(hyst_cursor *c, const unsigned char *file, size_t length, char *token, double *step,
                             hyst_error *e);
/* fills p and the numbers of values; the caller gives u, x, y, du, dy their places before the wires are read */
hyst_status hyst_read_nodes(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e);
hyst_status hyst_read_wires(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e);
hyst_status hyst_read_ports(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e);
hyst_status hyst_count_file(const unsigned char *file, size_t length, hyst_totals *n, hyst_error *e); /* all of it */
#endif
