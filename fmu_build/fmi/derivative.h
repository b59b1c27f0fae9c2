/* derivative.h - directional and adjoint derivatives. */
#ifndef FMI_DERIVATIVE_H
#define FMI_DERIVATIVE_H
#include "fmi/instance.h"

/* value references and the number of their elements */
typedef struct {
  const uint32_t *references;
  size_t n, count;
} fmi_references;
size_t fmi_derivative_work(const hyst_graph *g); /* doubles */
fmi_status fmi_directional(instance *i, const fmi_call *call, const fmi_references *unknowns,
                           const fmi_references *knowns, const double *seed, double *sensitivity);
fmi_status fmi_adjoint(instance *i, const fmi_call *call, const fmi_references *unknowns, const fmi_references *knowns,
                       const double *seed, double *sensitivity);
#endif
