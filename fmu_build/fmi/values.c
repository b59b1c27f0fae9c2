/* values.c - variables by value reference: lookup, type, and whether a value may be set now. */
#include "fmi/values.h"

#include "core/graph/continuous.h"
#include "core/graph/error.h"
#include "core/graph/message.h"
#include "core/graph/run.h"

/* of the variables after those of the graph */
static int is_derivative(const instance *i, const hyst_port *p) { return p >= i->continuous + i->n_continuous; }

static const char *type_words(int type) {
  return type == REAL ? "real" : type == BOOLEAN ? "boolean" : type == INTEGER ? "integer" : "enumeration";
}

const hyst_port *fmi_find_continuous(const instance *i, uint32_t reference) {
  const int64_t k = (int64_t)reference - i->graph->n_references - 1;
  return k >= 0 && k < 2 * i->n_continuous ? i->continuous + k : NULL;
}

const hyst_port *fmi_seek_port(const instance *i, const fmi_call *call, uint32_t reference, unsigned types) {
  const hyst_port *p = fmi_find(i, reference);
  if (!p) fmi_refuse(i, "%s: no variable has the value reference %lu.", call->name, (unsigned long)reference);
  else if (!((unsigned)p->type & types))
    fmi_refuse(i, "%s: '%s' is of type %s.", call->name, p->name, type_words(p->type)), p = NULL;
  else if (is_derivative(i, p)) /* fmi_port() finds all others */ hyst_graph_derivatives(i->graph, i->derivatives);
  return p;
}

fmi_status fmi_prepare(instance *i) {
  hyst_graph *g = i->graph;
  return g->changed && hyst_graph_prepare(g, g->dt) ? fmi_refuse_graph(i, hyst_graph_error(g)) : FMI_OK;
}

static fmi_status refuse_value(const instance *i, const hyst_port *p, double value) {
  hyst_error e;
  hyst_fail_value(&e, i->graph->nodes[p->block].name, p->row, value);
  return fmi_refuse_graph(i, &e);
}

static fmi_status wait_for_input(instance *i, const hyst_port *p, int64_t element, double value) {
  const int64_t at = p->value - i->graph->external + element;
  if (i->n_broken == 0)
    fmi_log(i, FMI_WARNING, FMI_LOG_WARNING, "The input '%s' is %s: no step is made until it has a finite value again.",
            p->name, value != value ? "NaN" : "infinite");
  i->n_broken += !i->broken[at];
  i->broken[at] = 1;
  return FMI_DISCARD;
}

fmi_status fmi_overflowed(const instance *i, const hyst_port *p, double value, fmi_status status) {
  const int error = status == FMI_ERROR;
  char t[32];
  fmi_log(i, error ? FMI_ERROR : FMI_WARNING, error ? FMI_LOG_ERROR : FMI_LOG_WARNING, "'%s' is %s at t = %s s.",
          p->name, value != value ? "NaN" : "infinite", hyst_number(t, sizeof t, i->run.t));
  return status;
}

fmi_status fmi_examine_state(const instance *i, const hyst_port *p, double value) {
  if (fmi_is_finite(value)) return FMI_OK;
  fmi_log(i, FMI_WARNING, FMI_LOG_WARNING, "The continuous state '%s' is %s: it is not set.", p->name,
          value != value ? "NaN" : "infinite");
  return FMI_DISCARD;
}

static fmi_status examine_continuous(const instance *i, const hyst_port *p, double value) {
  if (is_derivative(i, p)) return fmi_refuse(i, "The derivative of '%s' cannot be set.", p->name);
  if (i->run.phase != CONTINUOUS)
    return fmi_refuse(i, "'%s' is a continuous state: it is set in Continuous-Time Mode only.", p->name);
  return fmi_examine_state(i, p, value);
}

fmi_status fmi_examine(instance *i, const hyst_port *p, int64_t element, double value) {
  const int phase = i->run.phase;
  if (p->kind == HYST_CSTATE) return examine_continuous(i, p, value);
  if (phase == INTERMEDIATE && p->kind != HYST_INPUT)
    return fmi_refuse(i, "'%s' is not an input: only inputs are set in an intermediate update.", p->name);
  if (p->kind == HYST_OUTPUT) return fmi_refuse(i, "'%s' is an output and cannot be set.", p->name);
  /* OpenModelica before August 2026 sets the parameters once more after the initialisation */
  if (p->kind != HYST_INPUT && value == p->value[element]) return FMI_OK;
  if (p->kind == HYST_FIXED && phase != INSTANTIATED && phase != INITIALIZATION)
    return fmi_refuse(i, "'%s' is a fixed parameter: set it before the initialisation ends.", p->name);
  if (p->kind == HYST_PARAM && phase == CONTINUOUS)
    return fmi_refuse(i, "'%s' is a parameter: set it in Event Mode.", p->name);
  if (p->kind == HYST_INPUT && !fmi_is_finite(value)) return wait_for_input(i, p, element, value);
  return hyst_check(p->row, value) ? refuse_value(i, p, value) : FMI_OK;
}
