/* fmi3_me.c - FMI 3.0 for Model Exchange: names and types of the standard around event.c.
 * FMI Specification 3.0.1, sections 2.3 (common states), 3.2 (Model Exchange).  Functions shared with Co-Simulation in
 * Event Mode are in fmi3.c. */
#include "fmi/event.h"
#include "fmi3Functions.h"
#define FMI "fmi3"
#define REFUSED fmi3Error

#define READ (INITIALIZATION | EVENT | CONTINUOUS | TERMINATED)
#define CALLS(C)                                         \
  C(EnterContinuousTimeMode, MODEL_EXCHANGE, EVENT)      \
  C(CompletedIntegratorStep, MODEL_EXCHANGE, CONTINUOUS) \
  C(SetTime, MODEL_EXCHANGE, CONTINUOUS)                 \
  C(SetContinuousStates, MODEL_EXCHANGE, CONTINUOUS)     \
  C(GetContinuousStateDerivatives, MODEL_EXCHANGE, READ) \
  C(GetEventIndicators, MODEL_EXCHANGE, READ)            \
  C(GetContinuousStates, MODEL_EXCHANGE, READ)           \
  C(GetNominalsOfContinuousStates, MODEL_EXCHANGE, READ) \
  C(GetNumberOfEventIndicators, MODEL_EXCHANGE, ANY)     \
  C(GetNumberOfContinuousStates, MODEL_EXCHANGE, ANY)
#include "fmi/standards/calls.h"
#define STATUS fmi3Status
#define FLAG fmi3Boolean
#define NAME(name) fmi3##name
#include "fmi/standards/model_exchange.h"

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) {
  BEGIN(GetContinuousStateDerivatives)
  return (fmi3Status)fmi_get_derivatives(i, TABLE + CALL_GetContinuousStateDerivatives, dx, n);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
  BEGIN(GetNumberOfEventIndicators)
  NEED(GetNumberOfEventIndicators, n, 1, "number");
  *n = 0;
  return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
  BEGIN(GetNumberOfContinuousStates)
  NEED(GetNumberOfContinuousStates, n, 1, "number");
  *n = (size_t)i->n_continuous;
  return fmi3OK;
}
