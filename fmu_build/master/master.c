/* master.c - the three coupling schemes of system.h. */
#include "master/master.h"

#include <string.h>

#include "master/newton.h"
#include "master/unit.h"

/* ---- couplings: a step of the units that are due ----------------------------------------------------------------- */
#define EACH(call)                                                          \
  for (int64_t k = 0; k < m->n_units; k++) {                                \
    master_unit *u = m->units + k;                                          \
    if (due(u, s) && (call)) return m->unit = k, m->t = begins(m, u, s), 1; \
  }

static int gauss_seidel(master *m, const span *s) {
  EACH(copy(u, s, m->values) || advance_unit(m, u, s) || take(u, m->values))
  return 0;
}

static int jacobi(master *m, const span *s) {
  EACH(copy(u, s, m->values))
  EACH(advance_unit(m, u, s))
  EACH(take(u, m->values))
  return 0;
}

/* Relaxation factor of the residual: Aitken's method for vectors (Irons & Tuck).  For one value it is the secant
 * method, which converges for any loop gain but one; it starts with a full step. */
static double relaxation(double last, int64_t n, const double *before, const double *now) {
  double along = 0, square = 0;
  for (int64_t k = 0; k < n; k++) {
    const double change = now[k] - before[k];
    along += before[k] * change;
    square += change * change;
  }
  return square > 0 ? -last * along / square : last;
}

/* Tangent of the outputs of a unit for the seeds `d` of the values that it has read; units outside of loops have none.
 * The memory has taken the inputs of this step, and the next sweep starts before it, so the tangent is that of the
 * branch on which the inputs moved. */
static int follow(master_unit *u, const double *begin, const double *read, double *d, double *du) {
  double along = 0;
  int moves = 0;
  for (int64_t k = 0; k < u->n_in; k++) {
    const int64_t j = u->source[k];
    du[k] = j < 0 ? 0 : d[j];
    if (du[k] == 0) continue;
    moves = 1, along += du[k] * (read[j] - begin[j]);
  }
  double *dy = d + u->first;
  if (u->n_out == 0) return 0;
  memset(dy, 0, (size_t)u->n_out * sizeof *dy);
  if (!moves || !(u->tangent || u->seeds)) return 0;
  for (int64_t k = 0; along < 0 && k < u->n_in; k++) du[k] = -du[k];
  if (unit_tangent(u, du, dy)) return 1;
  for (int64_t k = 0; along < 0 && k < u->n_out; k++) dy[k] = -dy[k];
  return 0;
}

/* computes H from d out / d guess at the last sweep, one early value at a time through all units */
static int newton(master *m, const span *s, double *J, double *H) {
  const int64_t n = m->n_early, width = m->n_values;
  double *d = m->newton, *read = d + width, *du = H + n * n + 3 * n;
  for (int64_t c = 0; c < n; c++) {
    memset(d, 0, (size_t)width * sizeof *d);
    memcpy(read, m->begin, (size_t)width * sizeof *d);
    for (int64_t k = 0; k < n; k++) read[m->early[k]] = m->guess[k];
    if (due(m->units + m->makers[c], s)) d[m->early[c]] = 1; /* units that are not due hold their outputs */
    for (int64_t k = 0; k < m->n_units; k++) {
      master_unit *u = m->units + k;
      if (!due(u, s)) continue;
      if (follow(u, m->begin, read, d, du)) return 1;
      if (u->n_out > 0) memcpy(read + u->first, m->values + u->first, (size_t)u->n_out * sizeof *read);
    }
    for (int64_t k = 0; k < n; k++) J[k * n + c] = d[m->early[k]];
  }
  return newton_start(n, J, H);
}

static int iterative(master *m, const span *s) {
  const int64_t n = m->n_early;
  double *guess = m->guess, *residual = m->residual, *now = m->residual + n, relax = 1;
  double *J = NULL, *H = NULL, *change = NULL;
  if (m->newton) J = m->newton + 2 * m->n_values, H = J + n * n, change = H + n * n;
  int steep = 0;
  m->steps++;
  EACH(save(u))
  memcpy(m->begin, m->values, (size_t)m->n_values * sizeof *m->values);
  for (int64_t k = 0; k < n; k++) guess[k] = m->values[m->early[k]];
  for (int sweep = 0; sweep < m->most_sweeps; sweep++) {
    if (sweep > 0) {
      EACH(restore(u))
      memcpy(m->values, m->begin, (size_t)m->n_values * sizeof *m->values);
      for (int64_t k = 0; k < n; k++) m->values[m->early[k]] = guess[k];
    }
    if (gauss_seidel(m, s)) return 1;
    m->sweeps++;
    if (sweep + 1 > m->most_in_step) m->most_in_step = sweep + 1;
    int agree = 1;
    for (int64_t k = 0; k < n; k++) {
      const double out = m->values[m->early[k]], size = out < 0 ? -out : out;
      now[k] = out - guess[k];
      if (!(now[k] <= m->tolerance * (1 + size) && -now[k] <= m->tolerance * (1 + size))) agree = 0;
    }
    if (agree) return 0;
    if (sweep == 0) steep = J && !newton(m, s, J, H);
    else if (steep) newton_learn(n, H, change, residual, now, change + n);
    else relax = relaxation(relax, n, residual, now);
    if (steep) newton_step(n, H, now, change);
    for (int64_t k = 0; k < n; k++) guess[k] += steep ? change[k] : relax * now[k], residual[k] = now[k];
  }
  return m->unit = -2, m->t = s->to, 1;
}

static int couple(master *m, const span *s) {
  return m->scheme == MASTER_JACOBI      ? jacobi(m, s)
         : m->scheme == MASTER_ITERATIVE ? iterative(m, s)
                                         : gauss_seidel(m, s);
}

/* makes the fine step m->row, whole or in pieces */
static int fine_step(master *m) {
  const int64_t n = m->row;
  span s = {.n = n, .from = m->now, .to = time_of(m, n), .before = m->now};
  m->now = s.to;
  s.anew = m->cut > 0 && m->cut_rows[m->cut - 1] == n - 1;
  for (; m->cut < m->n_cuts && m->cut_rows[m->cut] == n; m->cut++) {
    s.cut = s.anew = 1, s.to = m->cuts[m->cut];
    if (couple(m, &s)) return 1;
    s.from = s.to, s.to = m->now;
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
