/* unit.h - a unit of the master: a graph, or an FMU called by the function types of its standard; and its time span. */
#ifndef HYST_MASTER_UNIT_H
#define HYST_MASTER_UNIT_H
#include <string.h>

#include "core/graph/continuous.h"
#include "core/graph/run.h"
#include "core/graph/tangent.h"
#include "master/system.h"

typedef int (*fmi2_set)(void *, const uint32_t *, size_t, const double *);
typedef int (*fmi2_get)(void *, const uint32_t *, size_t, double *);
typedef int (*fmi2_step)(void *, double, double, int);
typedef int (*fmi3_set)(void *, const uint32_t *, size_t, const double *, size_t);
typedef int (*fmi3_get)(void *, const uint32_t *, size_t, double *, size_t);
typedef int (*fmi3_step)(void *, double, double, unsigned char, unsigned char *, unsigned char *, unsigned char *,
                         double *);
typedef int (*fmi2_tangent)(void *, const uint32_t *, size_t, const uint32_t *, size_t, const double *, double *);
typedef int (*fmi3_tangent)(void *, const uint32_t *, size_t, const uint32_t *, size_t, const double *, size_t,
                            double *, size_t);
typedef int (*fmu_save)(void *, void **);
typedef int (*fmu_restore)(void *, void *);
enum { WARNING = 1 }; /* the worst status with which a run continues */

/* places of the inputs and outputs of a graph, looked up once */
static inline int bind(master_unit *u) {
  if (u->kind != MASTER_GRAPH) return 0;
  for (int64_t k = 0; k < u->n_in; k++)
    if (!(u->at[k] = (void *)hyst_graph_port(u->self, u->vr_in[k]))) return 1;
  for (int64_t k = 0; k < u->n_out; k++)
    if (!(u->at[u->n_in + k] = hyst_graph_value(u->self, u->vr_out[k]))) return 1;
  return 0;
}

/* The current span: the fine step n as a whole, or a piece of it. */
typedef struct {
  int64_t n;
  int cut, end;    /* cut: a piece; end: up to the fine step itself, not to a cut */
  int anew;        /* the last step or this one is a piece: straight lines of its units restart */
  double from, to; /* of the piece */
  double before;   /* time of fine step n - 1 */
} span;

/* of fine step n: the bits of System.time in Python */
static inline double time_of(const master *m, int64_t n) {
  if (m->ripple == 1) return (double)n * m->base; /* a division costs as much as a small unit */
  return (double)(n / m->ripple) * m->base + (double)(n % m->ripple) * m->h;
}

static inline int due(const master_unit *u, const span *s) {
  if (!s->end) return u->any_step != 0;
  return u->period == 1 || s->n % u->period == 0; /* a division costs as much as a small unit */
}
static inline int pieces(const master_unit *u, const span *s) { return s->cut && u->any_step; }
static inline double begins(const master *m, const master_unit *u, const span *s) {
  return pieces(u, s) ? s->from : u->period == 1 ? s->before : time_of(m, s->n - u->period);
}

/* input k is from[at[k]], or from[k] without at */
static inline int put(master_unit *u, const double *from, const int64_t *at) {
  if (u->kind == MASTER_GRAPH) {
    for (int64_t k = 0; k < u->n_in; k++) {
      const hyst_port *p = u->at[k];
      const double v = from[at ? at[k] : k];
      /* fast path for an ordinary real number in range; otherwise the function that checks all rules and logs */
      if (v > p->row->lo && v < p->row->hi && p->row->type[0] == 'r') p->value[u->vr_in[k] - p->reference] = v;
      else if (hyst_graph_set(u->self, u->vr_in[k], v)) return 1;
    }
    return 0;
  }
  if (u->n_in == 0) return 0;
  for (int64_t k = 0; k < u->n_in; k++)
    if (u->source[k] >= 0) u->u[k] = from[at ? at[k] : k];
  if (u->kind == MASTER_FMI2) return ((fmi2_set)u->set)(u->self, u->vr_in, (size_t)u->n_vr_in, u->u) > WARNING;
  return ((fmi3_set)u->set)(u->self, u->vr_in, (size_t)u->n_vr_in, u->u, (size_t)u->n_in) > WARNING;
}

static inline int copy(master_unit *u, const span *s, const double *values) {
  if (!u->ahead) return put(u, values, u->source);
  for (int64_t k = 0; k < u->n_in; k++) {
    u->line[u->n_in + k] = u->line[k];
    if (u->source[k] < 0) continue;
    u->line[k] = values[u->source[k]];
    if (s->anew && u->any_step) u->line[u->n_in + k] = u->line[k];
  }
  return 0;
}

static inline int step_unit(master_unit *u, double t, double h) {
  unsigned char event = 0, end = 0, early = 0; /* end, early: an FMU that ends the simulation is not stepped on */
  double reached;
  u->t = t + h;
  if (u->kind == MASTER_GRAPH) return hyst_graph_step(u->self, u->t, h) != HYST_E_OK;
  if (u->kind == MASTER_FMI2) return ((fmi2_step)u->step)(u->self, t, h, !u->rollback) > WARNING;
  return ((fmi3_step)u->step)(u->self, t, h, !u->rollback, &event, &end, &early, &reached) > WARNING || end || early;
}

static inline int advance_unit(const master *m, master_unit *u, const span *s) {
  const double t = begins(m, u, s), h = pieces(u, s) ? (s->to - s->from) / (double)u->substeps : u->h;
  for (int64_t i = 0; i < u->substeps; i++) {
    if (u->ahead) {
      const double end = (double)(i + 1) / (double)u->substeps, *now = u->line, *before = now + u->n_in;
      double *at = u->line + 2 * u->n_in;
      for (int64_t k = 0; k < u->n_in; k++) at[k] = now[k] + (now[k] - before[k]) * (end - u->ahead[k]);
      if (put(u, at, NULL)) return 1;
    }
    if (step_unit(u, t + (double)i * h, h)) return 1;
  }
  return 0;
}

static inline int take(master_unit *u, double *values) {
  double *to = values + u->first;
  if (u->kind == MASTER_GRAPH) {
    for (int64_t k = 0; k < u->n_out; k++) to[k] = *(const double *)u->at[u->n_in + k];
    return 0;
  }
  if (u->n_out == 0) return 0;
  if (u->kind == MASTER_FMI2) return ((fmi2_get)u->get)(u->self, u->vr_out, (size_t)u->n_vr_out, to) > WARNING;
  return ((fmi3_get)u->get)(u->self, u->vr_out, (size_t)u->n_vr_out, to, (size_t)u->n_out) > WARNING;
}

static inline int save(master_unit *u) {
  if (u->ahead) memcpy(u->line + 3 * u->n_in, u->line, (size_t)(2 * u->n_in) * sizeof *u->line);
  if (u->kind != MASTER_GRAPH) return ((fmu_save)u->save)(u->self, &u->state) > WARNING;
  int64_t n;
  const double *state = hyst_graph_state(u->self, &n);
  memcpy(u->saved, state, (size_t)n * sizeof *state);
  return 0;
}

static inline int restore(master_unit *u) {
  if (u->ahead) memcpy(u->line, u->line + 3 * u->n_in, (size_t)(2 * u->n_in) * sizeof *u->line);
  if (u->kind != MASTER_GRAPH) return ((fmu_restore)u->restore)(u->self, u->state) > WARNING;
  int64_t n;
  double *state = hyst_graph_state(u->self, &n);
  memcpy(state, u->saved, (size_t)n * sizeof *state);
  return 0;
}

/* tangent of its outputs for seeds of its inputs, after a step; fails if it is not finite */
static inline int unit_tangent(master_unit *u, const double *du, double *dy) {
  if (u->kind == MASTER_FMI2)
    return ((fmi2_tangent)u->tangent)(u->self, u->vr_out, (size_t)u->n_vr_out, u->vr_in, (size_t)u->n_vr_in, du, dy) >
           WARNING;
  if (u->kind == MASTER_FMI3)
    return ((fmi3_tangent)u->tangent)(u->self, u->vr_out, (size_t)u->n_vr_out, u->vr_in, (size_t)u->n_vr_in, du,
                                      (size_t)u->n_in, dy, (size_t)u->n_out) > WARNING;
  hyst_graph *g = u->self;
  const int64_t n_c = hyst_graph_n_continuous(g);
  double *seeds = u->seeds, *states = seeds + g->n_external, *ddx = states + n_c, *memory = ddx + n_c;
  memset(seeds, 0, (size_t)(g->n_external + n_c) * sizeof *seeds);
  for (int64_t k = 0; k < u->n_in; k++) {
    const hyst_port *p = u->at[k];
    seeds[p->value - g->external + (u->vr_in[k] - p->reference)] = du[k];
  }
  hyst_graph_tangent_between(g, u->t, seeds, states, dy, ddx, memory);
  for (int64_t k = 0; k < u->n_out; k++)
    if (!(dy[k] - dy[k] == 0)) return 1;
  return 0;
}
#endif
