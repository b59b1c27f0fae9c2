/* master.c - the three couplings of master.h. */
#include "master.h"

#include <string.h>

/* ---- one unit: a graph, or an FMU behind the function types of its standard -----------------------------------------
 */
typedef int (*fmi2_set)(void *, const uint32_t *, size_t, const double *);
typedef int (*fmi2_get)(void *, const uint32_t *, size_t, double *);
typedef int (*fmi2_step)(void *, double, double, int);
typedef int (*fmi3_set)(void *, const uint32_t *, size_t, const double *, size_t);
typedef int (*fmi3_get)(void *, const uint32_t *, size_t, double *, size_t);
typedef int (*fmi3_step)(void *, double, double, unsigned char, unsigned char *, unsigned char *, unsigned char *,
                         double *);
typedef int (*fmi_save)(void *, void **);
typedef int (*fmi_restore)(void *, void *);
enum { WARNING = 1 }; /* the worst status with which a run goes on */

/* where the inputs and outputs of a graph stand: looked up once */
static int bind(master_unit *u) {
  if (u->kind != MASTER_GRAPH) return 0;
  for (int64_t k = 0; k < u->n_in; k++)
    if (!(u->at[k] = (void *)hyst_graph_port(u->self, u->vr_in[k]))) return 1;
  for (int64_t k = 0; k < u->n_out; k++)
    if (!(u->at[u->n_in + k] = hyst_graph_value(u->self, u->vr_out[k]))) return 1;
  return 0;
}

/* What is being stepped: the fine step n as a whole, or a piece of it. */
typedef struct {
  int64_t n;
  int cut, end;    /* cut: a piece; end: up to the fine step itself, not to a cut */
  int anew;        /* the last step or this one is a piece: straight lines begin anew for who takes it */
  double from, to; /* of the piece */
} span;

/* of fine step n: the bits of System.time in Python */
static double time_of(const master *m, int64_t n) {
  if (m->ripple == 1) return (double)n * m->base; /* a division costs as much as a small unit */
  return (double)(n / m->ripple) * m->base + (double)(n % m->ripple) * m->h;
}

static int due(const master_unit *u, const span *s) { return s->end ? s->n % u->period == 0 : u->any_step != 0; }
static int pieces(const master_unit *u, const span *s) { return s->cut && u->any_step; }
static double begins(const master *m, const master_unit *u, const span *s) {
  return pieces(u, s) ? s->from : time_of(m, s->n - u->period);
}

/* input k is from[at[k]], or from[k] without at */
static int put(master_unit *u, const double *from, const int64_t *at) {
  if (u->kind == MASTER_GRAPH) {
    for (int64_t k = 0; k < u->n_in; k++) {
      const hyst_port *p = u->at[k];
      const double v = from[at ? at[k] : k];
      /* an ordinary real number in range; all else is for the function that knows every rule and makes the message */
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

static int copy(master_unit *u, const span *s, const double *values) {
  if (!u->ahead) return put(u, values, u->source);
  for (int64_t k = 0; k < u->n_in; k++) {
    u->line[u->n_in + k] = u->line[k];
    if (u->source[k] < 0) continue;
    u->line[k] = values[u->source[k]];
    if (s->anew && u->any_step) u->line[u->n_in + k] = u->line[k];
  }
  return 0;
}

static int step(master_unit *u, double t, double h) {
  unsigned char event, end, early;
  double reached;
  if (u->kind == MASTER_GRAPH) return hyst_graph_step(u->self, t + h, h) != HYST_E_OK;
  if (u->kind == MASTER_FMI2) return ((fmi2_step)u->step)(u->self, t, h, !u->rollback) > WARNING;
  return ((fmi3_step)u->step)(u->self, t, h, !u->rollback, &event, &end, &early, &reached) > WARNING;
}

static int advance(const master *m, master_unit *u, const span *s) {
  const double t = begins(m, u, s), h = pieces(u, s) ? (s->to - s->from) / (double)u->substeps : u->h;
  for (int64_t i = 0; i < u->substeps; i++) {
    if (u->ahead) {
      const double end = (double)(i + 1) / (double)u->substeps, *now = u->line, *before = now + u->n_in;
      double *at = u->line + 2 * u->n_in;
      for (int64_t k = 0; k < u->n_in; k++) at[k] = now[k] + (now[k] - before[k]) * (end - u->ahead[k]);
      if (put(u, at, NULL)) return 1;
    }
    if (step(u, t + (double)i * h, h)) return 1;
  }
  return 0;
}

static int take(master_unit *u, double *values) {
  double *to = values + u->first;
  if (u->kind == MASTER_GRAPH) {
    for (int64_t k = 0; k < u->n_out; k++) to[k] = *(const double *)u->at[u->n_in + k];
    return 0;
  }
  if (u->n_out == 0) return 0;
  if (u->kind == MASTER_FMI2) return ((fmi2_get)u->get)(u->self, u->vr_out, (size_t)u->n_vr_out, to) > WARNING;
  return ((fmi3_get)u->get)(u->self, u->vr_out, (size_t)u->n_vr_out, to, (size_t)u->n_out) > WARNING;
}

static int save(master_unit *u) {
  if (u->kind != MASTER_GRAPH) return ((fmi_save)u->save)(u->self, &u->state) > WARNING;
  int64_t n;
  const double *state = hyst_graph_state(u->self, &n);
  memcpy(u->saved, state, (size_t)n * sizeof *state);
  return 0;
}

static int restore(master_unit *u) {
  if (u->kind != MASTER_GRAPH) return ((fmi_restore)u->restore)(u->self, u->state) > WARNING;
  int64_t n;
  double *state = hyst_graph_state(u->self, &n);
  memcpy(state, u->saved, (size_t)n * sizeof *state);
  return 0;
}

/* ---- couplings: a step of the units that are due ------------------------------------------------------------------
 */
#define EACH(call)                                                          \
  for (int64_t k = 0; k < m->n_units; k++) {                                \
    master_unit *u = m->units + k;                                          \
    if (due(u, s) && (call)) return m->unit = k, m->t = begins(m, u, s), 1; \
  }

static int gauss_seidel(master *m, const span *s) {
  EACH(copy(u, s, m->values) || advance(m, u, s) || take(u, m->values))
  return 0;
}

static int jacobi(master *m, const span *s) {
  EACH(copy(u, s, m->values))
  EACH(advance(m, u, s))
  EACH(take(u, m->values))
  return 0;
}

/* How much of the residual to add to the guess: Aitken's relaxation of a vector, after Irons & Tuck.  For one value
 * it is the secant method, so that a loop gain of any size but one converges; starts with a whole step. */
static double relaxation(double last, int64_t n, const double *before, const double *now) {
  double along = 0, square = 0;
  for (int64_t k = 0; k < n; k++) {
    const double change = now[k] - before[k];
    along += before[k] * change;
    square += change * change;
  }
  return square > 0 ? -last * along / square : last;
}

static int iterative(master *m, const span *s) {
  double *guess = m->guess, *residual = m->residual, *now = m->residual + m->n_early, relax = 1;
  EACH(save(u))
  memcpy(m->begin, m->values, (size_t)m->n_values * sizeof *m->values);
  for (int64_t k = 0; k < m->n_early; k++) guess[k] = m->values[m->early[k]];
  for (int sweep = 0; sweep < m->most_sweeps; sweep++) {
    if (sweep > 0) {
      EACH(restore(u))
      memcpy(m->values, m->begin, (size_t)m->n_values * sizeof *m->values);
      for (int64_t k = 0; k < m->n_early; k++) m->values[m->early[k]] = guess[k];
    }
    if (gauss_seidel(m, s)) return 1;
    m->sweeps++;
    int agree = 1;
    for (int64_t k = 0; k < m->n_early; k++) {
      const double out = m->values[m->early[k]], size = out < 0 ? -out : out;
      now[k] = out - guess[k];
      if (!(now[k] <= m->tolerance * (1 + size) && -now[k] <= m->tolerance * (1 + size))) agree = 0;
    }
    if (agree) return 0;
    if (sweep > 0) relax = relaxation(relax, m->n_early, residual, now);
    for (int64_t k = 0; k < m->n_early; k++) guess[k] += relax * now[k], residual[k] = now[k];
  }
  return m->unit = -2, m->t = s->to, 1;
}

static int couple(master *m, const span *s) {
  return m->scheme == MASTER_JACOBI      ? jacobi(m, s)
         : m->scheme == MASTER_ITERATIVE ? iterative(m, s)
                                         : gauss_seidel(m, s);
}

/* the fine step m->row: its pieces, or the whole */
static int fine_step(master *m) {
  const int64_t n = m->row;
  span s = {.n = n, .from = time_of(m, n - 1), .to = time_of(m, n)};
  s.anew = m->cut > 0 && m->cut_rows[m->cut - 1] == n - 1;
  for (; m->cut < m->n_cuts && m->cut_rows[m->cut] == n; m->cut++) {
    s.cut = s.anew = 1, s.to = m->cuts[m->cut];
    if (couple(m, &s)) return 1;
    s.from = s.to, s.to = time_of(m, n);
  }
  s.end = 1;
  return couple(m, &s);
}

int master_run(master *m, int64_t n, double *record) {
  if (m->row == 0)
    for (int64_t k = 0; k < m->n_units; k++)
      if (bind(m->units + k)) return m->unit = k, m->t = 0, 1;
  for (const int64_t end = m->row + n; m->row < end; m->row++) {
    if (m->row > 0 && fine_step(m)) return 1;
    for (int64_t k = 0; k < m->n_values; k++)
      if (!(m->values[k] - m->values[k] == 0)) return m->unit = -1, m->t = time_of(m, m->row), 1;
    for (int64_t k = 0; k < m->n_columns; k++) *record++ = m->values[m->columns[k]];
  }
  return 0;
}
