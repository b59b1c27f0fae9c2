/* fmi2_me.c - FMI 2.0 for Model Exchange: names and types of the standard around event.c.
 * FMI Specification 2.0.4, section 3.2 (table of allowed calls 3.2.3). */
#include "fmi/event.h"
#include "fmi2Functions.h"
#define FMI "fmi2"
#define REFUSED fmi2Error

/* fmi2SetTime in Event Mode ends the event: FMUs with discrete states only go from event to event */
#define READ (INITIALIZATION | EVENT | CONTINUOUS | TERMINATED)
#define CALLS(C)                                         \
  C(EnterEventMode, MODEL_EXCHANGE, EVENT | CONTINUOUS)  \
  C(NewDiscreteStates, MODEL_EXCHANGE, EVENT)            \
  C(EnterContinuousTimeMode, MODEL_EXCHANGE, EVENT)      \
  C(CompletedIntegratorStep, MODEL_EXCHANGE, CONTINUOUS) \
  C(SetTime, MODEL_EXCHANGE, EVENT | CONTINUOUS)         \
  C(SetContinuousStates, MODEL_EXCHANGE, CONTINUOUS)     \
  C(GetEventIndicators, MODEL_EXCHANGE, READ)            \
  C(GetContinuousStates, MODEL_EXCHANGE, READ)           \
  C(GetDerivatives, MODEL_EXCHANGE, READ)                \
  C(GetNominalsOfContinuousStates, MODEL_EXCHANGE, READ | INSTANTIATED)
#include "fmi/standards/calls.h"
#define STATUS fmi2Status
#define FLAG fmi2Boolean
#define NAME(name) fmi2##name
#include "fmi/standards/model_exchange.h"

fmi2Status fmi2EnterEventMode(fmi2Component c) {
  BEGIN(EnterEventMode)
  return (fmi2Status)fmi_enter_event(i);
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
  BEGIN(NewDiscreteStates)
  const fmi_status s = fmi_update_discrete(i);
  if (s || !info) return (fmi2Status)s;
  info->newDiscreteStatesNeeded = info->terminateSimulation = fmi2False;
  info->nominalsOfContinuousStatesChanged = info->valuesOfContinuousStatesChanged = fmi2False;
  info->nextEventTimeDefined = fmi_next_event(i, &info->nextEventTime);
  return fmi2OK;
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
  BEGIN(GetDerivatives)
  return (fmi2Status)fmi_get_derivatives(i, TABLE + CALL_GetDerivatives, dx, n);
}
