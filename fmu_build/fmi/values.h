/* values.h - variables by value reference.  In both standards those of the graph come first, then the time (a variable
 * in FMI 3.0 only), the continuous states and their derivatives. */
#ifndef FMI_VALUES_H
#define FMI_VALUES_H
#include "fmi/messages.h"

/* The variable of a reference; NULL if there is none. */
const hyst_port *fmi_find_continuous(const instance *i, uint32_t reference);
static inline const hyst_port *fmi_find(const instance *i, uint32_t reference) {
  const hyst_port *p = hyst_graph_port(i->graph, reference);
  if (!p) return fmi_find_continuous(i, reference);
  return i->kind.by_element || p->reference == reference ? p : NULL;
}
/* The same if it has one of the types, a derivative with its current value; NULL after a message. */
const hyst_port *fmi_seek_port(const instance *i, const fmi_call *call, uint32_t reference, unsigned types);
static inline const hyst_port *fmi_port(const instance *i, const fmi_call *call, uint32_t reference, unsigned types) {
  const hyst_port *p = hyst_graph_port(i->graph, reference);
  const int good = p && (unsigned)p->type & types && (i->kind.by_element || p->reference == reference);
  return good ? p : fmi_seek_port(i, call, reference, types);
}
/* The same without checks, for a reference that fmi_port() has found. */
static inline const hyst_port *fmi_found(const instance *i, uint32_t reference) {
  const hyst_graph *g = i->graph;
  return reference < g->n_references ? g->ports + g->port_of[reference] : fmi_find_continuous(i, reference);
}
/* makes new parameter values effective, for the current step */
fmi_status fmi_prepare(instance *i);
/* reports a value that is not finite, as an error or as a warning, and returns the status Error or Discard */
fmi_status fmi_overflowed(const instance *i, const hyst_port *p, double value, fmi_status status);
/* Reads an element.  *status becomes Discard after a warning if the value is not finite, which only outputs, states and
 * derivatives can be. */
static inline double fmi_read(const instance *i, const hyst_port *p, int64_t element, fmi_status *status) {
  const double value = p->value[element];
  if (!fmi_is_finite(value)) *status = fmi_overflowed(i, p, value, FMI_DISCARD);
  return value;
}
/* Checks whether an element may be set to a value now; fmi_set() sets it.  A call sets all its values or none. */
fmi_status fmi_examine_state(const instance *i, const hyst_port *p, double value); /* of a continuous state */
fmi_status fmi_examine(instance *i, const hyst_port *p, int64_t element, double value);
static inline fmi_status fmi_accept(instance *i, const hyst_port *p, int64_t element, double value) {
  return p->kind == HYST_INPUT && !hyst_check_port(p, value) ? FMI_OK : fmi_examine(i, p, element, value);
}
/* what a solver knows of inputs that were set since the last accepted step: nothing was set, derivatives have not been
 * read since, or they have */
enum { FMI_HELD, FMI_JUMPED, FMI_KNOWN };
static inline void fmi_set(instance *i, const hyst_port *p, int64_t element, double value) {
  if (i->run.phase == CONTINUOUS && p->kind == HYST_INPUT && i->run.jump == FMI_HELD && p->value[element] != value)
    i->run.jump = FMI_JUMPED;
  const int same = p->value[element] == value;
  p->value[element] = value;
  i->run.stale = 1;
  if (p->kind == HYST_PARAM || p->kind == HYST_FIXED) {
    i->graph->changed |= !same;
  } else if (p->kind == HYST_INPUT && i->n_broken) {
    const int64_t at = p->value - i->graph->external + element;
    i->n_broken -= i->broken[at];
    i->broken[at] = 0;
  }
}
#endif
