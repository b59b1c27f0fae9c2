/* implicit.c - the inverse of a model inside a graph: it varies u until the model has the output that is asked for. */
#include "core/graph/implicit.h"

#include "core/elementary/root.h"
#include "core/graph/error.h"
#include "core/graph/node.h"

/* reason why a block cannot be part of a model, or NULL */
static const char *unfit(const hyst_node *n) {
  if (n->block->trial) return "an implicit inverse must not be between u and h of another one";
  if (n->block->deriv) return "a block between u and h of an implicit inverse must not have dynamics";
  if (n->time >= 0) return "a block between u and h of an implicit inverse must not depend on the time";
  if (n->block->rate == HYST_SAMPLED)
    return "a block between u and h of an implicit inverse must not depend on the sample time";
  return NULL;
}

/* returns 1 if the output of a block depends only on its states */
static int holds(const hyst_node *n) { return n->block->feedthrough && !n->block->feedthrough(n->dim, n->p); }

/* marks the sources of node k as the model of node i; if k is i, only the sources of input h */
static hyst_status mark(hyst_graph *g, int i, int k) {
  const hyst_node *n = g->nodes + k;
  for (const hyst_wire *w = g->wires + n->first_wire, *end = w + n->n_wires; w < end; w++) {
    if (w->source < 0 || w->source == i || (k == i && !hyst_closes_implicit(n, w))) continue; /* constant inputs */
    hyst_node *source = g->nodes + w->source;
    if (w->source < i && holds(source)) continue; /* this source is known before the search */
    const char *wrong = unfit(source);
    if (!wrong && (w->source < i || (k > i && w->source > k)))
      wrong = "the model of an implicit inverse must follow it in the order of the file";
    if (!wrong && source->tried_by >= 0 && source->tried_by != i)
      wrong = "it belongs to the models of two implicit inverses";
    if (wrong) return hyst_fail(&g->error, HYST_E_IMPLICIT, source->name, NULL, wrong);
    source->tried_by = i;
  }
  return HYST_E_OK;
}

hyst_status hyst_implicit_check(hyst_graph *g) {
  for (int i = 0; i < g->n_nodes; i++) g->nodes[i].tried_by = -1;
  for (int i = 0; i < g->n_nodes; i++)
    if (g->nodes[i].block->trial) {
      hyst_status s = mark(g, i, i);
      for (int k = g->n_nodes - 1; k > i && !s; k--) /* sources precede readers: one backward pass suffices */
        if (g->nodes[k].tried_by == i) s = mark(g, i, k);
      if (s) return s;
    }
  return HYST_E_OK;
}

typedef struct {
  const hyst_graph *g;
  const hyst_node *n;
  double t;
  int starting;
} trial;

static double residual(void *ctx, double u) {
  const trial *c = (const trial *)ctx;
  const int i = (int)(c->n - c->g->nodes);
  c->n->y[0] = u;
  for (const hyst_node *m = c->n + 1, *end = c->g->nodes + c->g->n_nodes; m < end; m++) {
    if (m->tried_by != i) continue;
    hyst_gather(c->g, m, c->t);
    if (c->starting && m->block->update) {
      hyst_rest(m);
      m->block->update(m->dim, m->p, m->x, m->u, 0);
    }
    m->block->output(m->dim, m->p, m->x, m->u, m->y);
  }
  hyst_gather(c->g, c->n, c->t);
  return hyst_implicit_off(c->n);
}

double hyst_implicit_solve(const hyst_graph *g, const hyst_node *n, double t, int starting) {
  trial c = {g, n, t, starting};
  const double lo = n->p[HYST_IMPLICIT_LO], hi = n->p[HYST_IMPLICIT_HI], wanted = n->u[HYST_IMPLICIT_WANTED];
  const double *asked = n->x + HYST_IMPLICIT_ASKED, *before = n->x + HYST_IMPLICIT_BEFORE;
  /* uses the stored output at the last root, because parameters may have changed */
  hyst_tried last = {hyst_clamp(n->x[HYST_IMPLICIT_ROOT], lo, hi), asked[0] + asked[3] - wanted};
  const hyst_tried older = {before[0], before[1] - wanted};
  const int again = wanted == asked[0] && lo == asked[1] && hi == asked[2];
  double off = again || starting ? residual(&c, last.u) : 0;
  if (again && off == asked[3]) n->y[0] = last.u;
  else {
    if (again || starting) last.off = off;
    n->y[0] = hyst_root(residual, &c, lo, hi, older, last, &off);
  }
  for (const hyst_node *m = n + 1, *end = g->nodes + g->n_nodes; starting && m < end; m++)
    if (m->tried_by == (int)(n - g->nodes)) hyst_rest(m);
  return off;
}
