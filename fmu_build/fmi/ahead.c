/* ahead.c - ahead.h: Taylor polynomials of the inputs, and the callback of FMI 3.0. */
#include "fmi/ahead.h"

#include <string.h>

#include "core/graph/message.h"

static double *slopes_of(const instance *i, const hyst_port *p, int64_t element) {
  return i->slopes + FMI_SLOPES * (p->value - i->graph->external + element);
}

fmi_status fmi_set_slope(instance *i, const fmi_call *call, uint32_t reference, int order, double value, int write) {
  const hyst_port *p = fmi_port(i, call, reference, REAL);
  if (!p) return FMI_ERROR;
  if (p->kind != HYST_INPUT) return fmi_refuse(i, "%s: '%s' is not an input.", call->name, p->name);
  if (order < 1 || order > FMI_ORDERS)
    return fmi_refuse(i, "%s: the order must be in 1..%d. Got %d instead.", call->name, FMI_ORDERS, order);
  if (!fmi_is_finite(value)) return fmi_refuse(i, "%s: a derivative of '%s' is not finite.", call->name, p->name);
  if (write) {
    slopes_of(i, p, reference - p->reference)[order] = value;
    i->run.moving |= value != 0;
  }
  return FMI_OK;
}

/* an input at the end of a step of h */
static double at_end(double u, const double *slopes, double h) {
  double sum = 0;
  for (int k = FMI_ORDERS; k > 0; k--) sum = (sum + slopes[k]) * h / k;
  return u + sum;
}

fmi_status fmi_look_ahead(instance *i, double h, double n) {
  for (int write = 0; i->run.moving && write < 2; write++) /* checks all before the first changes */
    for (int k = 0; k < i->graph->n_ports; k++) {
      const hyst_port *p = i->graph->ports + k;
      for (int64_t e = 0; p->kind == HYST_INPUT && p->type == REAL && e < p->size; e++) {
        double *slopes = slopes_of(i, p, e);
        if (write) slopes[0] = p->value[e];
        for (double m = 1; m <= n && !write; m++) {
          const double v = at_end(p->value[e], slopes, m * h);
          char a[32];
          if (!fmi_is_finite(v) || hyst_check(p->row, v))
            return fmi_refuse(i, "The derivatives of '%s' lead to %s at the end of the step, out of its range.",
                              p->name, hyst_number(a, sizeof a, v));
        }
      }
    }
  return FMI_OK;
}

static void move_inputs(instance *i, double h) {
  for (int k = 0; k < i->graph->n_ports; k++) {
    const hyst_port *p = i->graph->ports + k;
    for (int64_t e = 0; p->kind == HYST_INPUT && p->type == REAL && e < p->size; e++)
      p->value[e] = at_end(slopes_of(i, p, e)[0], slopes_of(i, p, e), h);
  }
}

fmi_status fmi_go_ahead(instance *i, double t_end, double h) {
  if (i->run.moving) move_inputs(i, h);
  if (i->run.moving || !i->ask) return FMI_OK;
  i->run.phase = INTERMEDIATE;
  i->ask(i, t_end);
  i->run.phase = STEPPING;
  return i->n_broken ? FMI_DISCARD : FMI_OK;
}

void fmi_arrive(instance *i, int completed) {
  if (!i->run.moving) return;
  for (int k = 0; !completed && k < i->graph->n_ports; k++) {
    const hyst_port *p = i->graph->ports + k;
    for (int64_t e = 0; p->kind == HYST_INPUT && p->type == REAL && e < p->size; e++)
      p->value[e] = slopes_of(i, p, e)[0];
  }
  memset(i->slopes, 0, (size_t)fmi_n_slopes(i) * sizeof(double));
  i->run.moving = 0;
}
