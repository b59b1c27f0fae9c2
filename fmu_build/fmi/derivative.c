/* derivative.c - directional and adjoint derivatives: outputs and state derivatives by inputs and continuous states.
 *
 * They are exact for the current memory, and one-sided at kinks, in the direction of the seed (core/graph/tangent.c).
 * If the result includes an initialisation or a sample that is being tried, they are difference quotients of that
 * result. The adjoint is computed from one direction per known. */
#include "fmi/derivative.h"

#include <string.h>

#include "core/graph/continuous.h"
#include "core/graph/tangent.h"
#include "fmi/event.h"

/* the work space of the instance */
typedef struct {
  double *seeds;          /* of the inputs, then of the continuous states */
  double *answer;         /* or its tangent: outputs, derivatives, states (unknowns in Initialization Mode) */
  double *weights;        /* of the result: seeds of the adjoint */
  double *moved, *before; /* inputs and states; the result before they were changed */
  double *memory;         /* of the graph */
  int64_t n_knowns, n_unknowns;
} space;

static int64_t n_outputs(const hyst_graph *g) {
  int64_t n = 0;
  for (int k = g->first_output; k < g->end_output; k++)
    if (g->ports[k].kind == HYST_OUTPUT) n += g->ports[k].size;
  return n;
}

static space space_of(const instance *i) {
  const hyst_graph *g = i->graph;
  space s;
  s.seeds = i->work;
  s.n_knowns = g->n_external + i->n_continuous;
  s.n_unknowns = n_outputs(g) + 2 * i->n_continuous;
  s.moved = s.seeds + s.n_knowns;
  s.answer = s.moved + 2 * s.n_knowns;
  s.weights = s.answer + s.n_unknowns;
  s.before = s.weights + s.n_unknowns;
  s.memory = s.before + s.n_unknowns;
  return s;
}

size_t fmi_derivative_work(const hyst_graph *g) {
  const size_t c = (size_t)hyst_graph_n_continuous(g);
  return 3 * ((size_t)g->n_external + c) + 3 * ((size_t)n_outputs(g) + 2 * c) + (size_t)g->n_state;
}

/* ---- one direction ----------------------------------------------------------------------------------------------- */
static void read_answer(instance *i, double *to) {
  const hyst_graph *g = i->graph;
  for (int k = g->first_output; k < g->end_output; k++)
    for (int64_t e = 0; g->ports[k].kind == HYST_OUTPUT && e < g->ports[k].size; e++) *to++ = g->ports[k].value[e];
  hyst_graph_derivatives(i->graph, to);
  for (int64_t k = 0; k < i->n_continuous; k++) to[i->n_continuous + k] = *i->continuous[k].value;
}

/* the place of a known; in Initialization Mode the states follow from parameters and inputs */
static double *known(const instance *i, int64_t k) {
  if (k < i->graph->n_external) return i->graph->external + k;
  return i->run.phase == INITIALIZATION ? NULL : i->continuous[k - i->graph->n_external].value;
}

static fmi_status by_difference(instance *i, const space *s) {
  double *const kept = s->moved + s->n_knowns;
  double size = 1, seed = 0;
  read_answer(i, s->before);
  fmi_undo_event(i);
  for (int64_t k = 0; k < s->n_knowns; k++) {
    const double *own = known(i, k);
    kept[k] = own ? *own : 0;
    if (kept[k] > size || -kept[k] > size) size = kept[k] < 0 ? -kept[k] : kept[k];
    if (s->seeds[k] > seed || -s->seeds[k] > seed) seed = s->seeds[k] < 0 ? -s->seeds[k] : s->seeds[k];
  }
  const double e = seed > 0 ? 1e-7 * size / seed : 1;
  for (int64_t k = 0; k < s->n_knowns; k++)
    if (known(i, k)) *known(i, k) = kept[k] + e * s->seeds[k];
  const fmi_status status = fmi_refresh(i);
  read_answer(i, s->answer);
  for (int64_t k = 0; k < s->n_unknowns; k++) s->answer[k] = (s->answer[k] - s->before[k]) / e;
  fmi_undo_event(i);
  for (int64_t k = 0; k < s->n_knowns; k++)
    if (known(i, k)) *known(i, k) = kept[k];
  i->run.stale = 1;
  return status;
}

/* In Step Mode the outputs belong to the last step and stay; this computes the tangent of the current ones. */
static fmi_status between_steps(instance *i, const space *s) {
  hyst_graph *g = i->graph;
  if (fmi_prepare(i)) return FMI_ERROR;
  hyst_graph_tangent_between(g, i->run.t, s->seeds, s->seeds + g->n_external, s->answer,
                             s->answer + s->n_unknowns - 2 * i->n_continuous, s->memory);
  return FMI_OK;
}

static fmi_status respond(instance *i, const space *s) {
  const fmi_status status = fmi_fresh(i);
  if (status) return status;
  if (i->run.phase == INITIALIZATION || (i->tried && !i->begin)) return by_difference(i, s);
  return between_steps(i, s);
}

/* ---- both functions ---------------------------------------------------------------------------------------------- */
/* the elements of a reference: first index and number */
static int64_t elements(const instance *i, const hyst_port *p, uint32_t reference, int64_t *first) {
  *first = i->kind.by_element ? (int64_t)reference - p->reference : 0;
  return i->kind.by_element ? 1 : p->size;
}

/* the index of a real variable among the knowns, -1 if it is none */
static int64_t known_place(const instance *i, const hyst_port *p) {
  if (p->kind == HYST_INPUT) return p->value - i->graph->external;
  const int64_t k = p->kind == HYST_CSTATE && i->run.phase != INITIALIZATION ? p - i->continuous : -1;
  return k >= 0 && k < i->n_continuous ? i->graph->n_external + k : -1;
}

static int64_t unknown_place(const instance *i, const hyst_port *p) {
  const hyst_graph *g = i->graph;
  const int64_t n = n_outputs(g), c = i->n_continuous;
  if (p->kind == HYST_CSTATE) { /* states precede derivatives among the variables, but follow them in the result */
    const int64_t k = p - i->continuous;
    return k >= c ? n + k - c : i->run.phase == INITIALIZATION ? n + c + k : -1;
  }
  if (p->kind != HYST_OUTPUT) return -1;
  int64_t at = 0;
  for (const hyst_port *q = g->ports + g->first_output; q < p; q++)
    if (q->kind == HYST_OUTPUT) at += q->size;
  return at;
}

/* checks that all variables of a list are of this sort and have `count` elements in total */
static fmi_status check_list(const instance *i, const fmi_call *call, const fmi_references *list,
                             int64_t (*place)(const instance *, const hyst_port *), const char *sort) {
  size_t have = 0;
  for (size_t k = 0; k < list->n; k++) {
    const hyst_port *p = fmi_port(i, call, list->references[k], REAL);
    int64_t first;
    if (!p) return FMI_ERROR;
    if (place(i, p) < 0) return fmi_refuse(i, "%s: '%s' is not %s here.", call->name, p->name, sort);
    have += (size_t)elements(i, p, list->references[k], &first);
  }
  if (have == list->count) return FMI_OK;
  return fmi_refuse(i, "%s: the variables have %lu values. Got room for %lu.", call->name, (unsigned long)have,
                    (unsigned long)list->count);
}

/* copies between values of a list and an array of all knowns or unknowns; repeated entries add up */
static void add_values(const instance *i, const fmi_references *list, const double *values, double *to,
                       int64_t (*place)(const instance *, const hyst_port *)) {
  for (size_t k = 0; k < list->n; k++) {
    const hyst_port *p = fmi_find(i, list->references[k]);
    int64_t first, n = elements(i, p, list->references[k], &first);
    for (double *at = to + place(i, p) + first; n > 0; n--) *at++ += *values++;
  }
}

/* seed: of the knowns (directional) or of the unknowns (adjoint); the sensitivity has the elements of the others */
static fmi_status check(instance *i, const fmi_call *call, const fmi_references *unknowns, const fmi_references *knowns,
                        const double *seed, size_t n_seed, const double *sensitivity, size_t n_sensitivity) {
  if (!fmi_given(i, call, unknowns->references, unknowns->n, "unknowns") ||
      !fmi_given(i, call, knowns->references, knowns->n, "knowns") || !fmi_given(i, call, seed, n_seed, "seeds") ||
      !fmi_given(i, call, sensitivity, n_sensitivity, "sensitivities"))
    return FMI_ERROR;
  if (i->run.interface == CO_SIMULATION && hyst_graph_is_sampled(i->graph))
    return fmi_absent(i, call->name, "sampled blocks respond in steps and have no derivatives");
  const fmi_status s = check_list(i, call, unknowns, unknown_place, "an output or derivative");
  return s ? s : check_list(i, call, knowns, known_place, "an input or continuous state");
}

static fmi_status check_finite(const instance *i, const fmi_call *call, const double *v, size_t n) {
  for (size_t k = 0; k < n; k++)
    if (!fmi_is_finite(v[k])) {
      fmi_log(i, FMI_WARNING, FMI_LOG_WARNING, "%s: the derivative is not finite here.", call->name);
      return FMI_DISCARD;
    }
  return FMI_OK;
}

fmi_status fmi_directional(instance *i, const fmi_call *call, const fmi_references *unknowns,
                           const fmi_references *knowns, const double *seed, double *sensitivity) {
  const space s = space_of(i);
  fmi_status status = check(i, call, unknowns, knowns, seed, knowns->count, sensitivity, unknowns->count);
  if (status) return status;
  memset(s.seeds, 0, (size_t)s.n_knowns * sizeof(double));
  add_values(i, knowns, seed, s.seeds, known_place);
  status = respond(i, &s);
  double *to = sensitivity;
  for (size_t k = 0; k < unknowns->n && !status; k++) {
    const hyst_port *p = fmi_find(i, unknowns->references[k]);
    int64_t first, n = elements(i, p, unknowns->references[k], &first);
    for (const double *from = s.answer + unknown_place(i, p) + first; n > 0; n--) *to++ = *from++;
  }
  return status ? status : check_finite(i, call, sensitivity, unknowns->count);
}

fmi_status fmi_adjoint(instance *i, const fmi_call *call, const fmi_references *unknowns, const fmi_references *knowns,
                       const double *seed, double *sensitivity) {
  const space s = space_of(i);
  fmi_status status = check(i, call, unknowns, knowns, seed, unknowns->count, sensitivity, knowns->count);
  if (status) return status;
  memset(s.weights, 0, (size_t)s.n_unknowns * sizeof(double));
  add_values(i, unknowns, seed, s.weights, unknown_place);
  double *to = sensitivity;
  for (size_t k = 0; k < knowns->n; k++) {
    const hyst_port *p = fmi_find(i, knowns->references[k]);
    int64_t first, n = elements(i, p, knowns->references[k], &first);
    for (int64_t at = known_place(i, p) + first; n > 0; n--, at++) {
      memset(s.seeds, 0, (size_t)s.n_knowns * sizeof(double));
      s.seeds[at] = 1;
      if ((status = respond(i, &s))) return status;
      double sum = 0;
      for (int64_t j = 0; j < s.n_unknowns; j++)
        if (s.weights[j] != 0) sum += s.weights[j] * s.answer[j]; /* avoids 0 times infinity */
      *to++ = sum;
    }
  }
  return check_finite(i, call, sensitivity, knowns->count);
}
