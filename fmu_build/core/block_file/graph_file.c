/* graph_file.c - reads a block file. The file is untrusted: invalid content is an error. */
#include "core/block_file/graph_file.h"

#include <string.h>

#include "core/blocks.h"
#include "core/elementary/crc.h"
#include "core/graph/error.h"
#include "core/graph/layout.h"
#include "core/graph/node.h"

/* ---- reading: a cursor that never passes the end -------------------------------------------------------------- */
enum { HEADER = 8 + 4 + 4 + 4 + HYST_TOKEN + 8 }; /* magic, version, length, checksum, token, step */
static const char MAGIC[8] = {'H', 'Y', 'S', 'T', 'F', 'M', 'U', '\n'};
enum { VERSION = 2 };
static const int64_t MOST_VALUES = 1 << 24; /* doubles in one graph: 128 MiB, the limit for an untrusted file */
enum { MOST_NODES = HYST_MOST_NODES, MOST_WIRES = 100000, MOST_NAME = 255 };

static uint32_t get_u32(hyst_cursor *c) {
  if (c->end - c->at < 4) return c->bad = 1, 0;
  const unsigned char *b = c->at;
  c->at += 4;
  return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static double get_f64(hyst_cursor *c) {
  const uint64_t lo = get_u32(c), hi = get_u32(c), bits = hi << 32 | lo;
  double v;
  memcpy(&v, &bits, sizeof v);
  return v;
}

/* reads a name (length, bytes) and copies it zero-terminated to `to`, unless `to` is NULL. Returns the bytes needed. */
static size_t get_name(hyst_cursor *c, char *to) {
  const uint32_t n = get_u32(c);
  if (c->bad || n == 0 || n > MOST_NAME || (size_t)(c->end - c->at) < n || memchr(c->at, 0, n)) return c->bad = 1, 0;
  if (to) memcpy(to, c->at, n), to[n] = 0;
  c->at += n;
  return n + 1;
}

hyst_status hyst_read_header(hyst_cursor *c, const unsigned char *file, size_t length, char *token, double *step,
                             hyst_error *e) {
  const hyst_cursor made = {file, file + length, 0};
  *c = made;
  if (length < HEADER || memcmp(file, MAGIC, sizeof MAGIC) != 0) return hyst_fail(e, HYST_E_FILE, NULL, NULL, "header");
  c->at += sizeof MAGIC;
  if (get_u32(c) != VERSION) return hyst_fail(e, HYST_E_VERSION, NULL, NULL, "");
  if (get_u32(c) != length) return hyst_fail(e, HYST_E_FILE, NULL, NULL, "length");
  if (get_u32(c) != hyst_crc32(c->at, (size_t)(c->end - c->at))) return hyst_fail(e, HYST_E_CRC, NULL, NULL, "");
  memcpy(token, c->at, HYST_TOKEN);
  if (token[HYST_TOKEN - 1] != 0) return hyst_fail(e, HYST_E_FILE, NULL, NULL, "token");
  c->at += HYST_TOKEN;
  *step = get_f64(c);
  if (!(*step >= 0 && *step < HYST_INF)) return hyst_fail(e, HYST_E_FILE, NULL, NULL, "step");
  return HYST_E_OK;
}

/* ---- sizes of a block ------------------------------------------------------------------------------------------ */
typedef struct {
  int64_t p, p_file, u, y, x, c, time;
} counts;

static counts count(const hyst_block *b, const int *dim) {
  counts n = {0, 0, 0, 0, 0, 0, -1};
  for (int v = 0; v < b->n_vars; v++) {
    const int64_t size = b->size(dim, v);
    switch (b->vars[v].kind) {
      case HYST_PARAM:
      case HYST_FIXED: n.p += size, n.p_file += size; break;
      case HYST_DERIVED: n.p += size; break;
      case HYST_TIME:
        n.time = n.u;
        n.u += size;
        break;
      case HYST_INPUT: n.u += size; break;
      case HYST_OUTPUT: n.y += size; break;
      case HYST_CSTATE: n.x += size, n.c += size; break;
      case HYST_STATE: n.x += size; break;
    }
  }
  return n;
}

hyst_status hyst_read_nodes(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e) {
  const uint32_t n_nodes = get_u32(c);
  if (c->bad || n_nodes == 0 || n_nodes > MOST_NODES) return hyst_fail(e, HYST_E_FILE, NULL, NULL, "number of blocks");
  n->nodes = n_nodes;
  for (uint32_t i = 0; i < n_nodes; i++) {
    char type[MOST_NAME + 1], *name = g ? g->names + n->names : NULL;
    n->names += get_name(c, name);
    get_name(c, type);
    if (c->bad) return hyst_fail(e, HYST_E_FILE, NULL, NULL, "name of a block");
    const hyst_block *b = hyst_find(type);
    if (!b) return hyst_fail(e, HYST_E_BLOCK, NULL, NULL, type);
    int dim[16], *dims = g ? g->dims + n->dims : dim;
    if (get_u32(c) != (uint32_t)b->n_dims || c->bad) return hyst_fail(e, HYST_E_DIM, b->name, NULL, "number of sizes");
    for (int d = 0; d < b->n_dims; d++) {
      const uint32_t v = get_u32(c);
      if (c->bad || v > (uint32_t)b->dims[d].hi || v < (uint32_t)b->dims[d].lo)
        return hyst_fail(e, HYST_E_DIM, b->name, b->dims[d].name, "");
      dims[d] = (int)v;
    }
    const counts k = count(b, dims);
    if (k.p + k.u + k.y + k.x > MOST_VALUES ||
        (n->p += k.p) + (n->u += k.u) + (n->y += k.y) + (n->x += k.x) > MOST_VALUES)
      return hyst_fail(e, HYST_E_DIM, b->name, NULL, "too many values");
    n->values += k.p_file;
    if (b->rate == HYST_SAMPLED) n->kept += k.u;
    n->dims += b->n_dims;
    if (get_u32(c) != (uint64_t)k.p_file || (c->end - c->at) / 8 < k.p_file) /* 0 past the end, marked as bad */
      return hyst_fail(e, HYST_E_FILE, b->name, NULL, "number of values");
    if (!g) {
      c->at += 8 * k.p_file;
      continue;
    }
    hyst_node *node = g->nodes + i;
    node->name = name;
    node->block = b;
    node->dim = dims;
    node->n_p = k.p, node->n_u = k.u, node->n_y = k.y, node->n_x = k.x, node->n_c = k.c, node->time = k.time;
    node->p = g->p + n->p - k.p;
    for (int v = 0; v < b->n_vars; v++) {
      if (!hyst_is_parameter(b->vars[v].kind)) continue;
      double *to = node->p + hyst_place(b, dims, v);
      for (int64_t m = b->size(dims, v); m > 0; m--, to++) {
        *to = get_f64(c);
        if (hyst_check(b->vars + v, *to)) return hyst_fail_value(e, name, b->vars + v, *to);
      }
    }
  }
  return HYST_E_OK;
}

/* inputs of the graph: number, start values.
 * wires, sorted by node: node, index in its u, source (-1: inputs of the graph), index in its y, number of elements */
hyst_status hyst_read_wires(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e) {
  const uint32_t n_external = get_u32(c);
  if (c->bad || (size_t)(c->end - c->at) / 8 < n_external)
    return hyst_fail(e, HYST_E_FILE, NULL, NULL, "number of inputs");
  n->external = n_external;
  for (uint32_t i = 0; i < n_external; i++) {
    const double start = get_f64(c);
    if (!(start - start == 0)) return hyst_fail(e, HYST_E_FILE, NULL, NULL, "start value of an input");
    if (g) g->external_file[i] = start;
  }
  const uint32_t n_wires = get_u32(c);
  if (c->bad || n_wires > MOST_WIRES || (size_t)(c->end - c->at) / 20 < n_wires)
    return hyst_fail(e, HYST_E_FILE, NULL, NULL, "number of connections");
  n->wires = n_wires;
  int32_t before = 0;
  for (uint32_t i = 0; i < n_wires; i++) {
    int32_t w[5];
    for (int k = 0; k < 5; k++) w[k] = (int32_t)get_u32(c);
    if (!g) continue;
    const int32_t to = w[0], to_place = w[1], source = w[2], from_place = w[3], size = w[4];
    if (to < before || to >= g->n_nodes || source < -1 || source >= g->n_nodes || to_place < 0 || from_place < 0 ||
        size < 1)
      return hyst_fail(e, HYST_E_WIRING, NULL, NULL, "");
    before = to;
    hyst_node *node = g->nodes + to;
    const int64_t have = source < 0 ? g->n_external : g->nodes[source].n_y;
    if ((int64_t)to_place + size > node->n_u || (int64_t)from_place + size > have)
      return hyst_fail(e, HYST_E_WIRING, node->name, NULL, "");
    if (node->n_wires++ == 0) node->first_wire = i;
    const hyst_wire made = {(source < 0 ? g->external : g->nodes[source].y) + from_place, node->u + to_place, size,
                            source};
    g->wires[i] = made;
  }
  return HYST_E_OK;
}

/* ports: name, kind, node (-1 for an input of the graph), variable, place, first value reference, number, start */
hyst_status hyst_read_ports(hyst_cursor *c, hyst_totals *n, hyst_graph *g, hyst_error *e) {
  const uint32_t n_ports = get_u32(c);
  if (c->bad || n_ports > 1000000) return hyst_fail(e, HYST_E_FILE, NULL, NULL, "number of variables");
  n->ports = n_ports;
  for (uint32_t i = 0; i < n_ports; i++) {
    char *name = g ? g->names + n->names : NULL;
    n->names += get_name(c, name);
    const uint32_t kind = get_u32(c);
    const uint32_t block = get_u32(c), var = get_u32(c), at = get_u32(c);
    const int64_t size = get_u32(c);
    const int64_t reference = n->references;
    if (c->bad || size < 1 || (n->references += size) > MOST_VALUES)
      return hyst_fail(e, HYST_E_FILE, NULL, NULL, "a variable");
    if (!g) continue;
    if (block >= (uint32_t)g->n_nodes || var >= (uint32_t)g->nodes[block].block->n_vars)
      return hyst_fail(e, HYST_E_WIRING, name, NULL, "");
    const hyst_node *node = g->nodes + block;
    const hyst_var *row = node->block->vars + var;
    const int64_t own = node->block->size(node->dim, (int)var);
    hyst_port *p = g->ports + i;
    p->name = name, p->kind = (int)kind, p->block = (int)block, p->var = (int)var, p->row = row;
    p->type = hyst_type(row), p->reference = reference, p->size = size;
    for (int64_t k = 0; k < size; k++) g->port_of[reference + k] = i;
    if (row->kind != (hyst_kind)kind) return hyst_fail(e, HYST_E_WIRING, name, NULL, "");
    if (kind == HYST_INPUT) { /* row: input of the first reader; at: index among the inputs of the graph */
      if ((int64_t)at + size > g->n_external) return hyst_fail(e, HYST_E_WIRING, name, NULL, "");
      p->value = g->external + at;
    } else if ((hyst_is_parameter((hyst_kind)kind) || kind == HYST_OUTPUT) && (int64_t)at + size <= own) {
      if (kind == HYST_OUTPUT && g->end_output == 0) g->first_output = (int)i;
      if (kind == HYST_OUTPUT) g->end_output = (int)i + 1;
      p->value = (kind == HYST_OUTPUT ? node->y : node->p) + hyst_place(node->block, node->dim, (int)var) + at;
    } else {
      return hyst_fail(e, HYST_E_WIRING, name, NULL, "");
    }
  }
  return HYST_E_OK;
}

hyst_status hyst_count_file(const unsigned char *file, size_t length, hyst_totals *n, hyst_error *e) {
  hyst_cursor c;
  char token[HYST_TOKEN];
  double step;
  memset(n, 0, sizeof *n);
  hyst_status s = hyst_read_header(&c, file, length, token, &step, e);
  if (!s) s = hyst_read_nodes(&c, n, NULL, e);
  if (!s) s = hyst_read_wires(&c, n, NULL, e);
  if (!s) s = hyst_read_ports(&c, n, NULL, e);
  if (!s && c.at != c.end) s = hyst_fail(e, HYST_E_FILE, NULL, NULL, "bytes after the end");
  return s;
}
