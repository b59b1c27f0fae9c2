/* fmi2.c - FMI 2.0: common functions and Co-Simulation, as names and types around the layers below.
 * FMI Specification 2.0.4, sections 2.1 (common functions), 3.2.3 and 4.2.4 (tables of allowed calls). */
#include "fmi/ahead.h"
#include "fmi/derivative.h"
#include "fmi/event.h"
#include "fmi/life.h"
#include "fmi/state.h"
#include "fmi2Functions.h"
#define FMI "fmi2"
#define REFUSED fmi2Error

/* the states in which a call is allowed; stepInProgress and stepCanceled do not occur, because a step is complete when
 * it returns.  A discarded step (an input is NaN) leaves the instance as before the step, so Step Mode covers
 * stepFailed. */
#define READ (INITIALIZATION | EVENT | CONTINUOUS | STEPPING | TERMINATED)
#define WRITE (INSTANTIATED | INITIALIZATION | EVENT | STEPPING)
#define CALLS(C)                                            \
  C(SetDebugLogging, BOTH, ANY)                             \
  C(SetupExperiment, BOTH, INSTANTIATED)                    \
  C(EnterInitializationMode, BOTH, INSTANTIATED)            \
  C(ExitInitializationMode, BOTH, INITIALIZATION)           \
  C(Terminate, BOTH, EVENT | CONTINUOUS | STEPPING)         \
  C(Reset, BOTH, ANY)                                       \
  C(GetReal, BOTH, READ)                                    \
  C(GetInteger, BOTH, READ)                                 \
  C(GetBoolean, BOTH, READ)                                 \
  C(GetString, BOTH, READ)                                  \
  C(SetReal, BOTH, WRITE | CONTINUOUS)                      \
  C(SetInteger, BOTH, WRITE)                                \
  C(SetBoolean, BOTH, WRITE)                                \
  C(SetString, BOTH, WRITE)                                 \
  C(GetDirectionalDerivative, BOTH, READ)                   \
  C(GetFMUstate, BOTH, ANY)                                 \
  C(SetFMUstate, BOTH, ANY)                                 \
  C(FreeFMUstate, BOTH, ANY)                                \
  C(SerializedFMUstateSize, BOTH, ANY)                      \
  C(SerializeFMUstate, BOTH, ANY)                           \
  C(DeSerializeFMUstate, BOTH, ANY)                         \
  C(SetRealInputDerivatives, CO_SIMULATION, WRITE)          \
  C(DoStep, CO_SIMULATION, STEPPING)                        \
  C(GetStatus, CO_SIMULATION, STEPPING | TERMINATED)        \
  C(GetRealStatus, CO_SIMULATION, STEPPING | TERMINATED)    \
  C(GetIntegerStatus, CO_SIMULATION, STEPPING | TERMINATED) \
  C(GetBooleanStatus, CO_SIMULATION, STEPPING | TERMINATED) \
  C(GetStringStatus, CO_SIMULATION, STEPPING | TERMINATED)
#include "fmi/standards/calls.h"

/* The message is a printf format without arguments, so "%" is doubled. */
static void send(const fmi_logger *to, const char *name, fmi_status status, const char *category, const char *text) {
  char format[1024];
  size_t n = 0;
  for (; *text && n + 2 < sizeof format; text++) {
    if (*text == '%' || *text == '#') format[n++] = *text; /* "#" would begin a value reference */
    format[n++] = *text;
  }
  format[n] = 0;
  ((fmi2CallbackLogger)to->callback)(to->environment, name, (fmi2Status)status, category, format);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
  BEGIN(SetDebugLogging)
  return (fmi2Status)fmi_set_logging(i, TABLE + CALL_SetDebugLogging, on, n, categories);
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging_on) {
  (void)visible;
  fmi_logger logger = {send, 0, 0};
  if (functions) {
    logger.callback = (void (*)(void))functions->logger;
    logger.environment = functions->componentEnvironment;
  }
  const fmi_kind kind = {type == fmi2CoSimulation ? CO_SIMULATION : MODEL_EXCHANGE, 1, 0};
  return fmi_instantiate(name, guid, location, logging_on, kind, &logger);
}

void fmi2FreeInstance(fmi2Component c) { fmi_free((instance *)c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop) {
  BEGIN(SetupExperiment)
  (void)tolerance_defined, (void)tolerance; /* the tolerance is ignored: steps are exact */
  return (fmi2Status)fmi_setup(i, start, stop_defined, stop);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  BEGIN(EnterInitializationMode)
  return (fmi2Status)fmi_enter_initialization(i);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  BEGIN(ExitInitializationMode)
  return (fmi2Status)fmi_exit_initialization(i);
}

fmi2Status fmi2Terminate(fmi2Component c) {
  BEGIN(Terminate)
  return (fmi2Status)fmi_terminate(i);
}

fmi2Status fmi2Reset(fmi2Component c) {
  BEGIN(Reset)
  fmi_reset(i);
  return fmi2OK;
}

/* ---- values ----------------------------------------------------------------------------------------------------- */
#define GET(name, T, types)                                                                       \
  fmi2Status fmi2Get##name(fmi2Component c, const fmi2ValueReference vr[], size_t n, T value[]) { \
    BEGIN(Get##name)                                                                              \
    NEED(Get##name, vr, n, "value references");                                                   \
    NEED(Get##name, value, n, "values");                                                          \
    if (fmi_fresh(i)) return fmi2Error;                                                           \
    fmi_status s = FMI_OK;                                                                        \
    for (size_t k = 0; k < n; k++) {                                                              \
      const hyst_port *p = fmi_port(i, TABLE + CALL_Get##name, vr[k], types);                     \
      if (!p) return fmi2Error;                                                                   \
      value[k] = (T)fmi_read(i, p, vr[k] - p->reference, &s);                                     \
    }                                                                                             \
    return (fmi2Status)s;                                                                         \
  }
#define SET(name, T, types)                                                                             \
  fmi2Status fmi2Set##name(fmi2Component c, const fmi2ValueReference vr[], size_t n, const T value[]) { \
    BEGIN(Set##name)                                                                                    \
    NEED(Set##name, vr, n, "value references");                                                         \
    NEED(Set##name, value, n, "values");                                                                \
    for (size_t k = 0; k < n; k++) {                                                                    \
      const hyst_port *p = fmi_port(i, TABLE + CALL_Set##name, vr[k], types);                           \
      const fmi_status s = p ? fmi_accept(i, p, vr[k] - p->reference, (double)value[k]) : FMI_ERROR;    \
      if (s) return (fmi2Status)s;                                                                      \
    }                                                                                                   \
    for (size_t k = 0; k < n; k++) {                                                                    \
      const hyst_port *p = fmi_found(i, vr[k]);                                                         \
      fmi_set(i, p, vr[k] - p->reference, (double)value[k]);                                            \
    }                                                                                                   \
    return fmi2OK;                                                                                      \
  }
GET(Real, fmi2Real, REAL)
GET(Integer, fmi2Integer, INTEGER | ENUMERATION)
GET(Boolean, fmi2Boolean, BOOLEAN)
SET(Real, fmi2Real, REAL)
SET(Integer, fmi2Integer, INTEGER | ENUMERATION)
SET(Boolean, fmi2Boolean, BOOLEAN)

static fmi2Status no_string(const instance *i, const fmi_call *call, fmi2ValueReference vr) {
  fmi_port(i, call, vr, 0); /* logs the type */
  return fmi2Error;
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[]) {
  BEGIN(GetString)
  NEED(GetString, vr, n, "value references");
  (void)value;
  return n == 0 ? fmi2OK : no_string(i, TABLE + CALL_GetString, vr[0]);
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[]) {
  BEGIN(SetString)
  NEED(SetString, vr, n, "value references");
  (void)value;
  return n == 0 ? fmi2OK : no_string(i, TABLE + CALL_SetString, vr[0]);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real seed[],
                                        fmi2Real sensitivity[]) {
  BEGIN(GetDirectionalDerivative)
  const fmi_references unknowns = {unknown, n_unknown, n_unknown}, knowns = {known, n_known, n_known};
  return (fmi2Status)fmi_directional(i, TABLE + CALL_GetDirectionalDerivative, &unknowns, &knowns, seed, sensitivity);
}

/* ---- saved states ----------------------------------------------------------------------------------------------- */
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
  BEGIN(GetFMUstate)
  return (fmi2Status)fmi_save(i, state);
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  BEGIN(SetFMUstate)
  return (fmi2Status)fmi_restore(i, state);
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
  BEGIN(FreeFMUstate)
  return (fmi2Status)fmi_forget(i, state);
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
  BEGIN(SerializedFMUstateSize)
  NEED(SerializedFMUstateSize, size, 1, "size");
  return (fmi2Status)fmi_saved_size(i, state, size);
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  BEGIN(SerializeFMUstate)
  return (fmi2Status)fmi_serialize(i, state, (unsigned char *)bytes, size);
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
  BEGIN(DeSerializeFMUstate)
  return (fmi2Status)fmi_deserialize(i, (const unsigned char *)bytes, size, state);
}

/* ---- stepping --------------------------------------------------------------------------------------------------- */
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
  BEGIN(DoStep)
  (void)no_set_state;
  return (fmi2Status)fmi_step(i, t, h);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[]) {
  BEGIN(SetRealInputDerivatives)
  NEED(SetRealInputDerivatives, vr, n, "value references");
  NEED(SetRealInputDerivatives, order, n, "orders");
  NEED(SetRealInputDerivatives, value, n, "values");
  for (int write = 0; write < 2; write++) /* checks all before the first is set */
    for (size_t k = 0; k < n; k++)
      if (fmi_set_slope(i, TABLE + CALL_SetRealInputDerivatives, vr[k], order[k], value[k], write)) return fmi2Error;
  return fmi2OK;
}

/* Only a discarded step has a status; a step is never pending. */
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
  BEGIN(GetRealStatus)
  NEED(GetRealStatus, value, 1, "value");
  if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
  *value = i->run.clock;
  return fmi2OK;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
  BEGIN(GetBooleanStatus)
  NEED(GetBooleanStatus, value, 1, "value");
  if (kind != fmi2Terminated) return fmi2Discard;
  *value = fmi2False;
  return fmi2OK;
}
#define NO_STATUS(name, T)                                                         \
  fmi2Status fmi2Get##name(fmi2Component c, const fmi2StatusKind kind, T *value) { \
    BEGIN(Get##name)                                                               \
    (void)kind, (void)value;                                                       \
    return fmi2Discard;                                                            \
  }
NO_STATUS(Status, fmi2Status)
NO_STATUS(IntegerStatus, fmi2Integer)
NO_STATUS(StringStatus, fmi2String)

/* ---- what this unit does not have -------------------------------------------------------------------------------- */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#define ABSENT(name, why, ...) \
  fmi2Status name(fmi2Component c, __VA_ARGS__) { return (fmi2Status)fmi_absent((const instance *)c, #name, why); }
static const char NO_DERIVATIVES[] = "modelDescription.xml does not declare derivatives";

ABSENT(fmi2GetRealOutputDerivatives, NO_DERIVATIVES, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
       fmi2Real value[])
fmi2Status fmi2CancelStep(fmi2Component c) {
  return (fmi2Status)fmi_absent((const instance *)c, "fmi2CancelStep", "a step is finished when fmi2DoStep returns");
}
