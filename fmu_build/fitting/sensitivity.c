/* sensitivity.c - the pass of sensitivity.h: every block advances with its columns, in the order of the file. */
#include "fitting/sensitivity.h"

#include "core/graph/pass.h"
#include "core/graph/run.h"

/* Differences over what prepare() and init() derive from the parameters, once a run: five points, or four on one side
 * where the other one is refused. */
#define APART 9.765625e-4 /* of a column: 2^-10, so that a parameter and its step add without rounding, mostly */
enum { POINTS = 4, FORMULAS = 3 };
static const struct {
  double at[POINTS], weight[POINTS];
} FORMULA[FORMULAS] = {
    {{1, -1, 2, -2}, {2. / 3, -2. / 3, -1. / 12, 1. / 12}},
    {{1, 2, 3, 0}, {3, -1.5, 1. / 3, -11. / 6}},
    {{-1, -2, -3, 0}, {-3, 1.5, -1. / 3, 11. / 6}},
};

/* a second run of a block, for a column */
typedef struct {
  double *x, *p;
  double step;
  int own; /* whether its parameters differ; else p is unused */
} lane;

typedef struct {
  const hyst_node *node;
  hyst_columns columns;
  double *du;
  int stated, reached; /* the block states its sensitivity; a column reaches it */
  int64_t n_own;
  unsigned char *reach;     /* by column */
  const hyst_change **rows; /* columns.changes */
  hyst_change *changes;
  double *derived; /* [columns][n_p] */
  lane *lanes;     /* by column */
} spot;

typedef struct {
  hyst_graph *g;
  const hyst_sensitivity *s;
  spot *spots;
  int64_t *first;        /* seeds of column c: from first[c] to first[c + 1] */
  double *p, *u, *x, *y; /* of one node */
} pass;

enum { BY_INPUT = 1, BY_OWN = 2, BY_DIFFERENCE = 4 };

/* ---- seeds ---------------------------------------------------------------------------------------------------------
 */
static int node_of(const hyst_graph *g, const hyst_seed *seed) { return hyst_graph_port(g, seed->reference)->block; }

static int64_t end_of_column(const hyst_sensitivity *s, int64_t k) {
  int64_t end = k;
  while (end < s->n_seeds && s->seeds[end].column == s->seeds[k].column) end++;
  return end;
}

static hyst_status check(hyst_graph *g, const hyst_sensitivity *s) {
  for (int i = 0; i < g->n_nodes; i++)
    if (g->nodes[i].block->trial) return hyst_fail(&g->error, HYST_E_IMPLICIT, g->nodes[i].name, NULL, "");
  for (int64_t k = 0; k < s->n_seeds; k++) {
    const hyst_port *p = hyst_graph_port(g, s->seeds[k].reference);
    if (!p || !hyst_is_parameter((hyst_kind)p->kind))
      return hyst_fail(&g->error, HYST_E_WIRING, NULL, p ? p->name : NULL, "not a parameter");
  }
  int64_t column = 0, before = 0, k = 0;
  for (; k < s->n_seeds && s->seeds[k].column == column; column++) {
    const int64_t end = end_of_column(s, k), order = 2 * (int64_t)node_of(g, s->seeds + k) + (end == k + 1);
    for (int64_t j = k + 1; j < end; j++)
      if (node_of(g, s->seeds + j) < node_of(g, s->seeds + j - 1)) return HYST_E_WIRING;
    if (order < before) return HYST_E_WIRING;
    before = order, k = end;
  }
  return k == s->n_seeds && column == s->n_columns ? HYST_E_OK : HYST_E_WIRING;
}

static int has_loop(const hyst_graph *g) {
  for (int i = 0; i < g->n_nodes; i++)
    for (const hyst_wire *w = g->wires + g->nodes[i].first_wire, *end = w + g->nodes[i].n_wires; w < end; w++)
      if (w->source >= i) return 1;
  return 0;
}

/* numbers of columns of node i: all, dense ones, those that change its own parameters; and of its seeds */
static void count(const hyst_graph *g, const hyst_sensitivity *s, int i, int loop, hyst_columns *columns,
                  int64_t *n_own, int64_t *n_seeds) {
  int64_t sparse = 0;
  columns->n = *n_own = *n_seeds = 0;
  for (int64_t k = 0, end; k < s->n_seeds; k = end) {
    end = end_of_column(s, k);
    columns->n += node_of(g, s->seeds + k) <= i;
    sparse += end == k + 1 && node_of(g, s->seeds + k) == i;
    int64_t here = 0;
    for (int64_t j = k; j < end; j++) here += node_of(g, s->seeds + j) == i;
    *n_own += here > 0;
    *n_seeds += here;
  }
  if (loop) columns->n = s->n_columns, sparse = 0;
  columns->dense = columns->n - sparse;
}

/* ---- memory --------------------------------------------------------------------------------------------------------
 */
typedef struct {
  unsigned char *at; /* NULL: measures */
  size_t size;
} room;

static void *take(room *r, int64_t n, size_t size) {
  unsigned char *const found = r->at ? r->at + r->size : NULL;
  r->size += ((size_t)n * size + 15) / 16 * 16;
  return found;
}
static double *doubles(room *r, int64_t n) { return (double *)take(r, n, sizeof(double)); }

static void lay_out_node(const pass *w, int i, int loop, spot *q, room *r) {
  const hyst_node *n = w->g->nodes + i;
  int64_t n_seeds;
  count(w->g, w->s, i, loop, &q->columns, &q->n_own, &n_seeds);
  const int64_t c = q->columns.n;
  q->node = n;
  q->stated = n->block->told.sensitivity && !(q->n_own && hyst_says_first(n));
  q->reach = (unsigned char *)take(r, c, 1);
  q->du = doubles(r, n->n_u * c);
  q->columns.u = q->du;
  q->columns.y = doubles(r, n->n_y * c);
  if (q->stated) {
    const int derives = n->block->told.derives;
    q->columns.x = doubles(r, n->n_x * c);
    q->rows = (const hyst_change **)take(r, n->block->n_vars + 1, sizeof *q->rows);
    q->columns.changes = q->rows;
    q->changes = (hyst_change *)take(r, n_seeds + (derives ? q->n_own * n->n_p : 0), sizeof(hyst_change));
    q->derived = doubles(r, derives ? q->n_own * n->n_p : 0);
  }
  if (!q->stated || n->block->told.differences) {
    q->lanes = (lane *)take(r, c, sizeof(lane));
    double *x = doubles(r, c * n->n_x), *p = doubles(r, q->n_own * n->n_p);
    for (int64_t k = 0, own = 0; r->at && k < c; k++) {
      q->lanes[k].x = x + k * n->n_x;
      for (int64_t j = w->first[k]; j < w->first[k + 1]; j++)
        if (node_of(w->g, w->s->seeds + j) == i) {
          q->lanes[k].p = p + own++ * n->n_p;
          break;
        }
    }
  }
}

static size_t lay_out(pass *w, room *r) {
  const hyst_graph *g = w->g;
  const int loop = has_loop(g);
  int64_t n_p = 0, n_u = 0, n_x = 0, n_y = 0;
  for (const hyst_node *n = g->nodes, *end = n + g->n_nodes; n < end; n++) {
    if (n->n_p > n_p) n_p = n->n_p;
    if (n->n_u > n_u) n_u = n->n_u;
    if (n->n_x > n_x) n_x = n->n_x;
    if (n->n_y > n_y) n_y = n->n_y;
  }
  w->p = doubles(r, n_p), w->u = doubles(r, n_u), w->x = doubles(r, n_x), w->y = doubles(r, n_y);
  w->first = (int64_t *)take(r, w->s->n_columns + 1, sizeof(int64_t));
  for (int64_t k = 0; w->first && k < w->s->n_seeds; k++) w->first[w->s->seeds[k].column + 1] = k + 1;
  w->spots = (spot *)take(r, g->n_nodes, sizeof(spot));
  spot measured;
  for (int i = 0; i < g->n_nodes; i++) lay_out_node(w, i, loop, w->spots ? w->spots + i : &measured, r);
  return r->size;
}

size_t hyst_sensitivity_measure(const hyst_graph *g, const hyst_sensitivity *s) {
  pass w = {(hyst_graph *)g, s, NULL, NULL, NULL, NULL, NULL, NULL};
  room r = {NULL, 0};
  for (int64_t k = 0; k < s->n_seeds; k++)
    if (!hyst_graph_port(g, s->seeds[k].reference)) return 16; /* hyst_sensitivity_run() says so */
  return lay_out(&w, &r);
}

/* which columns reach which nodes: their own parameters, or those of a source */
static void mark(pass *w) {
  const hyst_graph *g = w->g;
  for (int64_t k = 0; k < w->s->n_seeds; k++) {
    spot *q = w->spots + node_of(g, w->s->seeds + k);
    q->reach[w->s->seeds[k].column] |= BY_OWN;
    q->reached = 1;
  }
  for (int more = 1; more;) {
    more = 0;
    for (spot *q = w->spots, *last = q + g->n_nodes; q < last; q++)
      for (const hyst_wire *a = g->wires + q->node->first_wire, *end = a + q->node->n_wires; a < end; a++) {
        const spot *from = a->source < 0 ? NULL : w->spots + a->source;
        for (int64_t c = 0; from && from->reached && c < from->columns.n; c++)
          if (from->reach[c] && !(q->reach[c] & BY_INPUT)) q->reach[c] |= BY_INPUT, q->reached = more = 1;
      }
  }
  for (int64_t k = 0; k < w->s->n_seeds; k++) {
    spot *q = w->spots + node_of(g, w->s->seeds + k);
    const char *left = q->node->block->told.differences;
    if (left && !strcmp(hyst_graph_port(g, w->s->seeds[k].reference)->row->name, left))
      q->reach[w->s->seeds[k].column] |= BY_DIFFERENCE;
  }
  for (spot *q = w->spots, *last = q + g->n_nodes; q < last; q++)
    for (int64_t c = 0; c < q->columns.n && !q->stated; c++)
      if (q->reach[c]) q->reach[c] |= BY_DIFFERENCE;
}

/* ---- moved parameters ----------------------------------------------------------------------------------------------
 */
/* Writes the parameters of a node, moved by a part of a column, to p; 0: they are out of range, or refused. */
static int move(const pass *w, const hyst_node *n, int64_t column, double part, int derives, double dt, double *p) {
  const hyst_seed *seed = w->s->seeds + w->first[column], *const end = w->s->seeds + w->first[column + 1];
  memcpy(p, n->p, (size_t)n->n_p * sizeof *p);
  for (; seed < end; seed++) {
    const hyst_port *port = hyst_graph_port(w->g, seed->reference);
    if (w->g->nodes + port->block != n) continue;
    double *to = p + (port->value - n->p) + (seed->reference - port->reference);
    *to += part * seed->size;
    if (hyst_check_port(port, *to)) return 0;
  }
  return !derives || !n->block->prepare || !n->block->prepare(n->dim, p, dt);
}

/* Whether a derived value leaps, as a scale that is a power of two does, that of transfer_function.  Then the formula
 * reaches across the leap, and one of a single side may not. */
static int leaps(const hyst_node *n, const double *p) {
  for (int64_t j = 0; j < n->n_p; j++)
    if (n->p[j] != 0 && (p[j] == 2 * n->p[j] || 2 * p[j] == n->p[j])) return 1;
  return 0;
}

/* derivatives of what prepare() makes of the parameters, and at the start of what init() makes of them */
static void derive(const pass *w, spot *q, int64_t column, double *derived, double dt, int starting) {
  const hyst_node *n = q->node;
  const int derives = n->block->told.derives;
  hyst_node moved = *n;
  moved.p = w->p, moved.x = w->x;
  int best = -1, smooth = 0;
  for (int f = 0; f < FORMULAS && !smooth; f++) {
    int possible = smooth = 1;
    for (int k = 0; k < POINTS && possible; k++) {
      possible = move(w, n, column, FORMULA[f].at[k] * APART, derives, dt, w->p);
      smooth = smooth && possible && !(derives && leaps(n, w->p));
    }
    if (possible && (best < 0 || smooth)) best = f;
  }
  for (int k = 0; k < POINTS && best >= 0; k++) {
    const double weight = FORMULA[best].weight[k] / APART;
    move(w, n, column, FORMULA[best].at[k] * APART, derives, dt, w->p);
    for (int64_t j = 0; derives && j < n->n_p; j++) derived[j] += weight * (w->p[j] - n->p[j]);
    if (!starting) continue;
    hyst_rest(&moved);
    for (int64_t j = 0; j < n->n_x; j++) q->columns.x[j * q->columns.n + column] += weight * (w->x[j] - n->x[j]);
  }
}

/* lists the changes of the parameters, row by row of the table, element by element */
static void list(const pass *w, spot *q) {
  const hyst_node *n = q->node;
  hyst_change *to = q->changes;
  int row = 0;
  int64_t at = 0; /* in p */
  for (int v = 0; v < n->block->n_vars; v++) {
    if (n->block->vars[v].kind > HYST_DERIVED) continue;
    const int64_t size = n->block->size(n->dim, v);
    hyst_change *const begin = to;
    q->rows[row++] = begin;
    for (int64_t k = 0; hyst_is_parameter(n->block->vars[v].kind) && k < w->s->n_seeds; k++) {
      const hyst_seed *seed = w->s->seeds + k;
      const hyst_port *port = hyst_graph_port(w->g, seed->reference);
      const int64_t element = port->value - n->p + (seed->reference - port->reference) - at;
      if (w->g->nodes + port->block != n || element < 0 || element >= size) continue;
      hyst_change *here = to++;
      for (; here > begin && here[-1].element > element; here--) *here = here[-1];
      here->element = (int)element, here->column = (int)seed->column, here->size = seed->size;
    }
    for (int64_t j = 0; n->block->told.derives && n->block->vars[v].kind == HYST_DERIVED && j < size; j++) {
      const double *derived = q->derived + at + j;
      for (int64_t c = 0; c < q->columns.n; c++) {
        if (!(q->reach[c] & BY_OWN)) continue;
        const hyst_change change = {(int)j, (int)c, *derived};
        if (*derived != 0 && *derived - *derived == 0) *to++ = change;
        derived += n->n_p;
      }
    }
    at += size;
  }
  q->rows[row] = to;
}

/* what follows from the parameters, for a step of dt */
static void derive_all(const pass *w, spot *q, double dt, int starting) {
  const hyst_node *n = q->node;
  if (n->block->told.derives) memset(q->derived, 0, (size_t)(q->n_own * n->n_p) * sizeof(double));
  double *derived = q->derived;
  for (int64_t c = 0; c < q->columns.n; c++)
    if (q->reach[c] & BY_OWN) {
      derive(w, q, c, derived, dt, starting);
      if (n->block->told.derives) derived += n->n_p;
    }
  list(w, q);
}

/* ---- second runs ---------------------------------------------------------------------------------------------------
 */
static const double *moved_by(const spot *q, int64_t c) { return q->lanes[c].own ? q->lanes[c].p : q->node->p; }

static void write_difference(const pass *w, spot *q, int64_t c) {
  for (int64_t k = 0; k < q->node->n_y; k++)
    q->columns.y[k * q->columns.n + c] = (w->y[k] - q->node->y[k]) / q->lanes[c].step;
}

static void open_lanes(const pass *w, spot *q) {
  const hyst_node *n = q->node;
  hyst_node moved = *n;
  for (int64_t c = 0; c < q->columns.n; c++) {
    lane *l = q->lanes + c;
    if (!(q->reach[c] & BY_DIFFERENCE)) continue;
    l->step = w->s->step;
    l->own = (q->reach[c] & BY_OWN) && move(w, n, c, l->step, 1, 0, l->p);
    if ((q->reach[c] & BY_OWN) && !l->own) {
      l->own = move(w, n, c, -l->step, 1, 0, l->p);
      if (l->own) l->step = -l->step;
    }
    moved.p = l->own ? l->p : n->p, moved.x = l->x;
    hyst_rest(&moved);
    if (!hyst_says_first(n)) continue;
    n->block->output(n->dim, moved.p, l->x, n->u, w->y);
    write_difference(w, q, c);
  }
}

/* advances the copies, after the block itself */
static void advance_lanes(const pass *w, spot *q, double dt) {
  const hyst_node *n = q->node;
  const hyst_block *b = n->block;
  const int64_t columns = q->columns.n;
  const int direct = b->rate == HYST_FUNCTION && b->tangent;
  for (int64_t c = 0; c < columns; c++) {
    if (!(q->reach[c] & BY_DIFFERENCE)) continue;
    if (direct && !(q->reach[c] & BY_OWN)) {
      for (int64_t k = 0; k < n->n_u; k++) n->du[k] = q->du[k * columns + c];
      b->tangent(n->dim, n->p, n->x, n->u, n->du, NULL, n->dy, NULL);
      for (int64_t k = 0; k < n->n_y; k++) q->columns.y[k * columns + c] = n->dy[k];
      continue;
    }
    const lane *l = q->lanes + c;
    for (int64_t k = 0; k < n->n_u; k++) w->u[k] = n->u[k] + l->step * q->du[k * columns + c];
    if (b->update) b->update(n->dim, moved_by(q, c), l->x, w->u, dt);
    b->output(n->dim, moved_by(q, c), l->x, w->u, w->y);
    write_difference(w, q, c);
  }
}

/* ---- the pass ------------------------------------------------------------------------------------------------------
 */
static void gather(const pass *w, const spot *q) {
  const hyst_node *n = q->node;
  for (const hyst_wire *a = w->g->wires + n->first_wire, *end = a + n->n_wires; a < end; a++) {
    const spot *from = a->source < 0 ? NULL : w->spots + a->source;
    if (!from || !from->reached) continue;
    const double *dy = from->columns.y + (a->from - from->node->y) * from->columns.n;
    double *du = q->du + (a->to - n->u) * q->columns.n;
    for (int64_t k = 0; k < a->size; k++, dy += from->columns.n, du += q->columns.n)
      memcpy(du, dy, (size_t)from->columns.n * sizeof *du);
  }
}

static void advance(const pass *w, double t, double dt) {
  for (spot *q = w->spots, *end = q + w->g->n_nodes; q < end; q++) {
    const hyst_node *n = q->node;
    if (!q->reached) {
      hyst_advance_node(w->g, n, t, dt);
      continue;
    }
    gather(w, q);
    if (q->stated) {
      hyst_gather(w->g, n, t);
      n->block->told.sensitivity(n->dim, n->p, n->x, n->u, dt, &q->columns);
      n->block->output(n->dim, n->p, n->x, n->u, n->y);
    } else {
      hyst_advance_node(w->g, n, t, dt);
    }
    if (q->lanes) advance_lanes(w, q, dt);
  }
}

static hyst_status start(const pass *w, double t) {
  const hyst_status s = hyst_graph_rest(w->g);
  if (s) return s;
  for (spot *q = w->spots, *end = q + w->g->n_nodes; q < end; q++) {
    if (q->reached && q->stated) derive_all(w, q, 0, 1);
    if (q->reached && q->lanes) open_lanes(w, q);
  }
  advance(w, t, 0);
  return HYST_E_OK;
}

static hyst_status step(const pass *w, double t_end, double dt) {
  const double before = w->g->dt;
  const hyst_status s = hyst_graph_ready(w->g, t_end, &dt);
  if (s) return s;
  for (spot *q = w->spots, *end = q + w->g->n_nodes; w->g->dt != before && q < end; q++) {
    if (!q->n_own || !(q->node->block->flags & HYST_STEP) || !q->node->block->prepare) continue;
    if (q->stated && q->node->block->told.derives) derive_all(w, q, dt, 0);
    for (int64_t c = 0; q->lanes && c < q->columns.n; c++)
      if (q->lanes[c].own && q->node->block->prepare(q->node->dim, q->lanes[c].p, dt)) q->lanes[c].own = 0;
  }
  advance(w, t_end, dt);
  return HYST_E_OK;
}

static void write(const pass *w, double **y, double **dy) {
  const int64_t columns = w->s->n_columns;
  for (const hyst_port *p = w->g->ports + w->g->first_output, *end = w->g->ports + w->g->end_output; p < end; p++) {
    if (p->kind != HYST_OUTPUT) continue;
    const spot *q = w->spots + p->block;
    const double *from = q->columns.y + (p->value - q->node->y) * q->columns.n;
    hyst_copy(*y, p->value, p->size), *y += p->size;
    for (int64_t k = 0; k < p->size; k++, from += q->columns.n, *dy += columns) {
      memcpy(*dy, from, (size_t)q->columns.n * sizeof(double));
      for (int64_t c = q->columns.n; c < columns; c++) (*dy)[c] = 0;
    }
  }
}

hyst_status hyst_sensitivity_run(hyst_graph *g, int64_t n, double t0, double h, const double *u,
                                 const hyst_sensitivity *s, void *memory) {
  hyst_status wrong = check(g, s);
  if (wrong) return g->error.status == wrong ? wrong : hyst_fail(&g->error, wrong, NULL, NULL, "seeds out of order");
  pass w = {g, s, NULL, NULL, NULL, NULL, NULL, NULL};
  room measured = {NULL, 0}, r = {(unsigned char *)memory, 0};
  memset(memory, 0, lay_out(&w, &measured));
  lay_out(&w, &r);
  mark(&w);
  double *y = s->y, *dy = s->dy;
  for (int64_t i = 0, at = 0; i < n && at < s->n_picked && !wrong; i++) {
    if (g->n_external > 0) hyst_copy(g->external, u, g->n_external), u += g->n_external;
    wrong = i == 0 ? start(&w, t0) : step(&w, t0 + (double)(i - 1) * h + h, h);
    for (; !wrong && at < s->n_picked && s->picked[at] == i; at++) write(&w, &y, &dy);
  }
  return wrong;
}
