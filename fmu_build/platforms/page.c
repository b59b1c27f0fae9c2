/* page.c - the core for a page: a WebAssembly module without imports, whose functions take numbers and addresses only.
 *
 * Memory is never freed: a page opens its models once.  A page reads names, value references and places of states in
 * what Python writes beside the block files, so no table needs to be read here. */
#include <string.h>

#include "core/block_file/graph_open.h"
#include "core/graph/node.h"
#include "core/graph/run.h"

#define EXPORT(name) __attribute__((export_name(#name)))

enum { MEMORY_PAGE = 65536 };
extern unsigned char __heap_base;
static unsigned char *page_free = &__heap_base;
static hyst_error page_error;

/* room for so many bytes, zeroed by the engine; 0 if there is none */
EXPORT(room) void *page_room(uint32_t bytes) {
  const uintptr_t start = ((uintptr_t)page_free + 15) & ~(uintptr_t)15, size = __builtin_wasm_memory_size(0);
  const uint64_t end = (uint64_t)start + bytes, have = (uint64_t)size * MEMORY_PAGE;
  if (end > have && __builtin_wasm_memory_grow(0, (end - have + MEMORY_PAGE - 1) / MEMORY_PAGE) == (size_t)-1)
    return NULL;
  page_free = (unsigned char *)(uintptr_t)end;
  return (void *)start;
}

/* a graph from a block file; 0: refused, see hyst_error below */
EXPORT(open) hyst_graph *page_open(const unsigned char *file, uint32_t length) {
  size_t bytes = 0;
  hyst_graph *g = NULL;
  if (hyst_graph_measure(file, length, &bytes, &page_error)) return NULL;
  void *const memory = page_room((uint32_t)bytes);
  if (!memory) return hyst_fail(&page_error, HYST_E_MEMORY, NULL, NULL, NULL), NULL;
  return hyst_graph_open(file, length, memory, bytes, &g, &page_error) ? NULL : g;
}

EXPORT(set) int page_set(hyst_graph *g, int reference, double value) {
  return (int)hyst_graph_set(g, reference, value);
}
EXPORT(value) double *page_value(hyst_graph *g, int reference) { return hyst_graph_value(g, reference); }
EXPORT(state) double *page_state(hyst_graph *g, int node) { return g->nodes[node].x; }
EXPORT(defaults) void page_defaults(hyst_graph *g) { hyst_graph_defaults(g); }
EXPORT(start) int page_start(hyst_graph *g, double t) { return (int)hyst_graph_start(g, t); }
EXPORT(step) int page_step(hyst_graph *g, double t, double dt) { return (int)hyst_graph_step(g, t, dt); }
EXPORT(run) int page_run(hyst_graph *g, int n, double t0, double h, const double *u, double *y) {
  return (int)hyst_graph_run(g, n, t0, h, u, y);
}

/* the memory as it is before the first input */
EXPORT(rest) int page_rest(hyst_graph *g) {
  const hyst_status s = hyst_graph_prepare(g, 0);
  for (const hyst_node *n = g->nodes, *end = n + g->n_nodes; !s && n < end; n++) hyst_rest(n);
  return (int)s;
}

/* place and rule of the last error of a graph, or of page_open(); the status is a number of HYST_ERRORS */
EXPORT(place) const char *page_place(const hyst_graph *g) { return g ? g->error.block : page_error.block; }
EXPORT(variable) const char *page_variable(const hyst_graph *g) { return g ? g->error.variable : page_error.variable; }
EXPORT(rule) const char *page_rule(const hyst_graph *g) { return g ? g->error.text : page_error.text; }
