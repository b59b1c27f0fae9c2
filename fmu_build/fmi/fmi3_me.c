/* fmi3_me.c - FMI 3.0 for Model Exchange: the standard's names and types around event.c.
 * FMI Specification 3.0.1, sections 2.3 (common states), 3.2 (Model Exchange).  What it shares with Co-Simulation in
 * Event Mode is in fmi3.c. */
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
#include "calls.h"

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) {
  BEGIN(EnterContinuousTimeMode)
  return (fmi3Status)fmi_leave_event(i);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set_state, fmi3Boolean *event,
                                       fmi3Boolean *terminate) {
  BEGIN(CompletedIntegratorStep)
  (void)no_set_state;
  if (event) *event = fmi3False;
  if (terminate) *terminate = fmi3False;
  return (fmi3Status)fmi_completed_step(i);
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) {
  BEGIN(SetTime)
  return (fmi3Status)fmi_set_time(i, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
  BEGIN(SetContinuousStates)
  return (fmi3Status)fmi_set_states(i, TABLE + CALL_SetContinuousStates, x, n);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) {
  BEGIN(GetContinuousStateDerivatives)
  return (fmi3Status)fmi_get_derivatives(i, TABLE + CALL_GetContinuousStateDerivatives, dx, n);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) {
  BEGIN(GetEventIndicators)
  (void)z;
  return (fmi3Status)fmi_get_indicators(i, TABLE + CALL_GetEventIndicators, n);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
  BEGIN(GetContinuousStates)
  return (fmi3Status)fmi_get_states(i, TABLE + CALL_GetContinuousStates, x, n);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t n) {
  BEGIN(GetNominalsOfContinuousStates)
  return (fmi3Status)fmi_get_nominals(i, TABLE + CALL_GetNominalsOfContinuousStates, nominals, n);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
  BEGIN(GetNumberOfEventIndicators)
  *n = 0;
  return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
  BEGIN(GetNumberOfContinuousStates)
  *n = (size_t)i->n_continuous;
  return fmi3OK;
}
