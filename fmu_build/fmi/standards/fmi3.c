/* fmi3.c - FMI 3.0: common functions and Co-Simulation, as names and types around the layers below.
 * FMI Specification 3.0.1, sections 2.2, 2.3 (common functions and states), 4.2 (co-simulation).
 * Arrays are native: a variable has one value reference and as many values as it has elements. */
#include "fmi/derivative.h"
#include "fmi/event.h"
#include "fmi/life.h"
#include "fmi/state.h"
#include "fmi3Functions.h"
#define FMI "fmi3"
#define REFUSED fmi3Error

/* the states in which a call is allowed; there is no Configuration Mode */
#define READ ANY /* before the initialisation: start values (section 2.3.2) */
#define WRITE (INSTANTIATED | INITIALIZATION | EVENT | STEPPING)
#define CALLS(C)                                                                                 \
  C(SetDebugLogging, BOTH, ANY)                                                                  \
  C(EnterInitializationMode, BOTH, INSTANTIATED)                                                 \
  C(ExitInitializationMode, BOTH, INITIALIZATION)                                                \
  C(EnterEventMode, BOTH, STEPPING | CONTINUOUS)                                                 \
  C(UpdateDiscreteStates, BOTH, EVENT)                                                           \
  C(Terminate, BOTH, EVENT | STEPPING | CONTINUOUS)                                              \
  C(Reset, BOTH, ANY)                                                                            \
  C(GetFloat64, BOTH, READ | INTERMEDIATE)                                                       \
  C(GetInt32, BOTH, READ)                                                                        \
  C(GetInt64, BOTH, READ)                                                                        \
  C(GetBoolean, BOTH, READ)                                                                      \
  C(SetFloat64, BOTH, WRITE | CONTINUOUS | INTERMEDIATE)                                         \
  C(SetInt32, BOTH, WRITE)                                                                       \
  C(SetInt64, BOTH, WRITE)                                                                       \
  C(SetBoolean, BOTH, WRITE)                                                                     \
  C(GetDirectionalDerivative, BOTH, INITIALIZATION | EVENT | STEPPING | CONTINUOUS | TERMINATED) \
  C(GetAdjointDerivative, BOTH, INITIALIZATION | EVENT | STEPPING | CONTINUOUS | TERMINATED)     \
  C(GetFMUState, BOTH, ANY)                                                                      \
  C(SetFMUState, BOTH, ANY)                                                                      \
  C(FreeFMUState, BOTH, ANY)                                                                     \
  C(SerializedFMUStateSize, BOTH, ANY)                                                           \
  C(SerializeFMUState, BOTH, ANY)                                                                \
  C(DeserializeFMUState, BOTH, ANY)                                                              \
  C(EnterStepMode, CO_SIMULATION, EVENT)                                                         \
  C(DoStep, CO_SIMULATION, STEPPING)
#include "fmi/standards/calls.h"

static void send(const fmi_logger *to, const char *name, fmi_status status, const char *category, const char *text) {
  (void)name; /* the environment pointer identifies the instance */
  ((fmi3LogMessageCallback)to->callback)(to->environment, (fmi3Status)status, category, text);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
  BEGIN(SetDebugLogging)
  return (fmi3Status)fmi_set_logging(i, TABLE + CALL_SetDebugLogging, on, n, categories);
}

static fmi3Instance refuse(fmi3LogMessageCallback log, fmi3InstanceEnvironment environment, const char *text) {
  if (log) log(environment, fmi3Error, "logStatusError", text);
  return NULL;
}

/* the inputs at the end of the step, which begins when the callback returns */
static void ask(instance *i, double t) {
  fmi3Boolean early = fmi3False;
  fmi3Float64 early_time = t;
  ((fmi3IntermediateUpdateCallback)i->update)(i->logger.environment, t, fmi3True, fmi3False, fmi3False, fmi3False,
                                              &early, &early_time);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                         fmi3Boolean logging_on, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[], size_t n_intermediate,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
  (void)visible, (void)early_return;
  if (n_intermediate && !(intermediate && update))
    return refuse(log, environment, "Intermediate updates need a callback and a list of variables.");
  const fmi_logger logger = {send, (void (*)(void))log, environment};
  const fmi_kind kind = {CO_SIMULATION, 0, event_mode};
  instance *i = fmi_instantiate(name, token, path, logging_on, kind, &logger);
  for (size_t k = 0; i && k < n_intermediate; k++) {
    const hyst_port *p = fmi_find(i, intermediate[k]);
    if (p && p->kind == HYST_INPUT && p->type == REAL) continue;
    fmi_refuse(i,
               "The variable with the value reference %lu is no input of type Float64: only those have intermediate "
               "updates.",
               (unsigned long)intermediate[k]);
    fmi_free(i);
    return NULL;
  }
  if (i && n_intermediate) i->ask = ask, i->update = (void (*)(void))update;
  return i;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                          fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
  (void)visible;
  const fmi_logger logger = {send, (void (*)(void))log, environment};
  const fmi_kind kind = {MODEL_EXCHANGE, 0, 0};
  return fmi_instantiate(name, token, path, logging_on, kind, &logger);
}

void fmi3FreeInstance(fmi3Instance c) { fmi_free((instance *)c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop) {
  BEGIN(EnterInitializationMode)
  (void)tolerance_defined, (void)tolerance; /* the tolerance is ignored: steps are exact */
  const fmi_status s = fmi_setup(i, start, stop_defined, stop);
  return (fmi3Status)(s ? s : fmi_enter_initialization(i));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
  BEGIN(ExitInitializationMode)
  return (fmi3Status)fmi_exit_initialization(i);
}

fmi3Status fmi3Terminate(fmi3Instance c) {
  BEGIN(Terminate)
  return (fmi3Status)fmi_terminate(i);
}

fmi3Status fmi3Reset(fmi3Instance c) {
  BEGIN(Reset)
  fmi_reset(i);
  return fmi3OK;
}

/* ---- values: the elements of one variable after those of the other ----------------------------------------------- */
static fmi_status wrong_count(const instance *i, const char *name, size_t n, size_t got) {
  return fmi_refuse(i, "%s: the variables have %lu values. Got room for %lu.", name, (unsigned long)n,
                    (unsigned long)got);
}

/* Checks that all variables exist, have the type, and have `count` elements in total.  `time`: allows the independent
 * variable too, whose value reference follows the last one of the graph. */
static fmi_status check_count(const instance *i, const fmi_call *call, const fmi3ValueReference vr[], size_t n,
                              unsigned types, int time, size_t count) {
  size_t have = 0;
  for (size_t k = 0; k < n; k++) {
    if (time && vr[k] == i->graph->n_references) {
      have++;
      continue;
    }
    const hyst_port *p = fmi_port(i, call, vr[k], types);
    if (!p) return FMI_ERROR;
    have += (size_t)p->size;
  }
  return have == count ? FMI_OK : wrong_count(i, call->name, have, count);
}

#define GET(name, T, types)                                                                                     \
  fmi3Status fmi3Get##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, T values[], size_t count) { \
    BEGIN(Get##name)                                                                                            \
    NEED(Get##name, vr, n, "value references");                                                                 \
    NEED(Get##name, values, count, "values");                                                                   \
    if (fmi_fresh(i) || check_count(i, TABLE + CALL_Get##name, vr, n, types, (types) == REAL, count))           \
      return fmi3Error;                                                                                         \
    fmi_status s = FMI_OK;                                                                                      \
    for (size_t k = 0; k < n; k++) {                                                                            \
      const hyst_port *p = fmi_found(i, vr[k]);                                                                 \
      if (!p) *values++ = (T)i->run.clock;                                                                      \
      for (int64_t e = 0; p && e < p->size; e++) *values++ = (T)fmi_read(i, p, e, &s);                          \
    }                                                                                                           \
    return (fmi3Status)s;                                                                                       \
  }
#define SET(name, T, types)                                                                                           \
  fmi3Status fmi3Set##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const T values[], size_t count) { \
    BEGIN(Set##name)                                                                                                  \
    NEED(Set##name, vr, n, "value references");                                                                       \
    NEED(Set##name, values, count, "values");                                                                         \
    if (check_count(i, TABLE + CALL_Set##name, vr, n, types, 0, count)) return fmi3Error;                             \
    for (int write = 0; write < 2; write++) { /* checks all values before the first is set */                         \
      const T *from = values;                                                                                         \
      for (size_t k = 0; k < n; k++) {                                                                                \
        const hyst_port *p = fmi_found(i, vr[k]);                                                                     \
        for (int64_t e = 0; e < p->size; e++, from++) {                                                               \
          const fmi_status s = write ? FMI_OK : fmi_accept(i, p, e, (double)*from);                                   \
          if (s) return (fmi3Status)s;                                                                                \
          if (write) fmi_set(i, p, e, (double)*from);                                                                 \
        }                                                                                                             \
      }                                                                                                               \
    }                                                                                                                 \
    return fmi3OK;                                                                                                    \
  }
GET(Float64, fmi3Float64, REAL)
GET(Int32, fmi3Int32, INTEGER)
GET(Int64, fmi3Int64, ENUMERATION)
GET(Boolean, fmi3Boolean, BOOLEAN)
SET(Float64, fmi3Float64, REAL)
SET(Int32, fmi3Int32, INTEGER)
SET(Int64, fmi3Int64, ENUMERATION)
SET(Boolean, fmi3Boolean, BOOLEAN)

#define DERIVATIVE(name, function, n_of_unknowns, n_of_knowns)                                                        \
  fmi3Status fmi3Get##name(fmi3Instance c, const fmi3ValueReference unknown[], size_t n_unknown,                      \
                           const fmi3ValueReference known[], size_t n_known, const fmi3Float64 seed[], size_t n_seed, \
                           fmi3Float64 sensitivity[], size_t n_sensitivity) {                                         \
    BEGIN(Get##name)                                                                                                  \
    const fmi_references unknowns = {unknown, n_unknown, n_of_unknowns}, knowns = {known, n_known, n_of_knowns};      \
    return (fmi3Status)function(i, TABLE + CALL_Get##name, &unknowns, &knowns, seed, sensitivity);                    \
  }
DERIVATIVE(DirectionalDerivative, fmi_directional, n_sensitivity, n_seed)
DERIVATIVE(AdjointDerivative, fmi_adjoint, n_seed, n_sensitivity)

/* ---- saved states ----------------------------------------------------------------------------------------------- */
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
  BEGIN(GetFMUState)
  return (fmi3Status)fmi_save(i, state);
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
  BEGIN(SetFMUState)
  return (fmi3Status)fmi_restore(i, state);
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
  BEGIN(FreeFMUState)
  return (fmi3Status)fmi_forget(i, state);
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
  BEGIN(SerializedFMUStateSize)
  NEED(SerializedFMUStateSize, size, 1, "size");
  return (fmi3Status)fmi_saved_size(i, state, size);
}
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
  BEGIN(SerializeFMUState)
  return (fmi3Status)fmi_serialize(i, state, bytes, size);
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
  BEGIN(DeserializeFMUState)
  return (fmi3Status)fmi_deserialize(i, bytes, size, state);
}

/* ---- stepping --------------------------------------------------------------------------------------------------- */
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last_time) {
  BEGIN(DoStep)
  (void)no_set_state;
  const fmi_status s = fmi_step(i, t, h);
  if (event) *event = fmi3False; /* no output is discrete */
  if (terminate) *terminate = fmi3False;
  if (early_return) *early_return = fmi3False;
  if (last_time) *last_time = i->run.clock;
  return (fmi3Status)s;
}

/* ---- events ------------------------------------------------------------------------------------------------------ */
fmi3Status fmi3EnterEventMode(fmi3Instance c) {
  BEGIN(EnterEventMode)
  if (i->run.phase == STEPPING && !i->run.event_mode)
    return (fmi3Status)fmi_refuse(i,
                                  "fmi3EnterEventMode is not allowed in the state 'Step Mode' of Co-Simulation: the "
                                  "instance was made with eventModeUsed = false.");
  return (fmi3Status)fmi_enter_event(i);
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *next_defined, fmi3Float64 *next) {
  BEGIN(UpdateDiscreteStates)
  const fmi_status s = fmi_update_discrete(i);
  if (s) return (fmi3Status)s;
  fmi3Boolean *const never[] = {again, terminate, nominals, values};
  for (int k = 0; k < 4; k++)
    if (never[k]) *never[k] = fmi3False;
  double t;
  const int defined = fmi_next_event(i, &t);
  if (next_defined) *next_defined = defined;
  if (next) *next = t;
  return fmi3OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance c) {
  BEGIN(EnterStepMode)
  return (fmi3Status)fmi_leave_event(i);
}
