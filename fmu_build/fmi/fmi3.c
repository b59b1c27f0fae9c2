/* fmi3.c - FMI 3.0 for Co-Simulation: the standard's names and types around instance.h.
 * FMI Specification 3.0.1, sections 2.2, 2.3 (common functions and states), 4.2 (co-simulation).
 * Arrays are native: a variable has one value reference and as many values as it has elements. */
#include "fmi3Functions.h"
#include "instance.h"

/* the states in which a call is allowed; there is no Event Mode, Configuration Mode or Intermediate Update */
#define READ (INITIALIZATION | STEPPING | TERMINATED)
#define WRITE (INSTANTIATED | INITIALIZATION | STEPPING)
#define CALLS(C)                            \
  C(SetDebugLogging, ANY)                   \
  C(EnterInitializationMode, INSTANTIATED)  \
  C(ExitInitializationMode, INITIALIZATION) \
  C(Terminate, STEPPING)                    \
  C(Reset, ANY)                             \
  C(GetFloat64, READ)                       \
  C(GetInt32, READ)                         \
  C(GetInt64, READ)                         \
  C(GetBoolean, READ)                       \
  C(SetFloat64, WRITE)                      \
  C(SetInt32, WRITE)                        \
  C(SetInt64, WRITE)                        \
  C(SetBoolean, WRITE)                      \
  C(GetFMUState, ANY)                       \
  C(SetFMUState, ANY)                       \
  C(FreeFMUState, ANY)                      \
  C(SerializedFMUStateSize, ANY)            \
  C(SerializeFMUState, ANY)                 \
  C(DeserializeFMUState, ANY)               \
  C(DoStep, STEPPING)
#define ID(name, phases) CALL_##name,
#define ROW(name, phases) {"fmi3" #name, phases},
enum { CALLS(ID) };
static const fmi_call TABLE[] = {CALLS(ROW)};

#define BEGIN(name) \
  instance *i = c;  \
  if (!fmi_allowed(i, TABLE + CALL_##name)) return fmi3Error;

static void send(const fmi_logger *to, const char *name, fmi_status status, const char *category, const char *text) {
  (void)name; /* the environment pointer tells the importer who speaks */
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

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                         fmi3Boolean logging_on, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[], size_t n_intermediate,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
  (void)visible, (void)early_return, (void)intermediate, (void)update;
  if (event_mode) return refuse(log, environment, "This FMU has no Event Mode: eventModeUsed must be false.");
  if (n_intermediate) return refuse(log, environment, "This FMU provides no intermediate updates.");
  const fmi_logger logger = {send, (void (*)(void))log, environment};
  return fmi_instantiate(name, token, path, logging_on, 0, &logger);
}

void fmi3FreeInstance(fmi3Instance c) { fmi_free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop) {
  BEGIN(EnterInitializationMode)
  (void)tolerance_defined, (void)tolerance; /* the steps are exact: nothing to control */
  const fmi_status s = fmi_setup(i, start, stop_defined, stop);
  if (s) return (fmi3Status)s;
  i->run.phase = INITIALIZATION;
  i->run.stale = 1;
  return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
  BEGIN(ExitInitializationMode)
  return (fmi3Status)fmi_exit_initialization(i);
}

fmi3Status fmi3Terminate(fmi3Instance c) {
  BEGIN(Terminate)
  i->run.phase = TERMINATED;
  return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c) {
  BEGIN(Reset)
  fmi_reset(i);
  return fmi3OK;
}

/* ---- values: the elements of one variable after those of the other ------------------------------------------------
 */
static fmi_status wrong_count(const instance *i, const char *name, size_t n, size_t got) {
  return fmi_refuse(i, "%s: the variables have %lu values. Got room for %lu.", name, (unsigned long)n,
                    (unsigned long)got);
}

/* All variables exist, have the type, and have `count` elements together.  `time`: the independent variable, whose
 * value reference follows the last one of the graph, is allowed too. */
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
    if (fmi_fresh(i) || check_count(i, TABLE + CALL_Get##name, vr, n, types, (types) == REAL, count))           \
      return fmi3Error;                                                                                         \
    for (size_t k = 0; k < n; k++) {                                                                            \
      const hyst_port *p = hyst_graph_port(i->graph, vr[k]);                                                    \
      if (!p) *values++ = (T)i->run.t;                                                                          \
      for (int64_t e = 0; p && e < p->size; e++) *values++ = (T)p->value[e];                                    \
    }                                                                                                           \
    return fmi3OK;                                                                                              \
  }
#define SET(name, T, types)                                                                                           \
  fmi3Status fmi3Set##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const T values[], size_t count) { \
    BEGIN(Set##name)                                                                                                  \
    if (check_count(i, TABLE + CALL_Set##name, vr, n, types, 0, count)) return fmi3Error;                             \
    for (int write = 0; write < 2; write++) { /* look at all of them before the first is set */                       \
      const T *from = values;                                                                                         \
      for (size_t k = 0; k < n; k++) {                                                                                \
        const hyst_port *p = hyst_graph_port(i->graph, vr[k]);                                                        \
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
  if (event) *event = fmi3False;
  if (terminate) *terminate = fmi3False;
  if (early_return) *early_return = fmi3False;
  if (last_time) *last_time = i->run.t;
  return (fmi3Status)s;
}

/* ---- what this unit does not have ---------------------------------------------------------------------------------
 */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#define ABSENT(name, why, ...) \
  fmi3Status name(fmi3Instance c, __VA_ARGS__) { return (fmi3Status)fmi_absent(c, #name, why); }
#define ABSENT_MODE(name, why) \
  fmi3Status name(fmi3Instance c) { return (fmi3Status)fmi_absent(c, #name, why); }
static const char CS_ONLY[] = "this FMU is for co-simulation only";
static const char NO_EVENTS[] = "this FMU has no Event Mode";
static const char NO_CLOCKS[] = "this FMU has no clocks";
static const char NO_STRUCTURE[] = "this FMU has no structural parameters";
static const char NO_DERIVATIVES[] = "modelDescription.xml does not declare derivatives";
static const char NO_TYPE[] = "this FMU has no variables of that type";

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                          fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
  return refuse(log, environment, "This FMU is for co-simulation only.");
}
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                               fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback log, fmi3ClockUpdateCallback clock,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
  return refuse(log, environment, "This FMU is for co-simulation only.");
}

#define NO_SUCH_TYPE(name)                                                                                   \
  ABSENT(fmi3Get##name, NO_TYPE, const fmi3ValueReference vr[], size_t n, fmi3##name values[], size_t count) \
  ABSENT(fmi3Set##name, NO_TYPE, const fmi3ValueReference vr[], size_t n, const fmi3##name values[], size_t count)
NO_SUCH_TYPE(Float32)
NO_SUCH_TYPE(Int8)
NO_SUCH_TYPE(UInt8)
NO_SUCH_TYPE(Int16)
NO_SUCH_TYPE(UInt16)
NO_SUCH_TYPE(UInt32)
NO_SUCH_TYPE(UInt64)
NO_SUCH_TYPE(String)
ABSENT(fmi3GetBinary, NO_TYPE, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary values[],
       size_t count)
ABSENT(fmi3SetBinary, NO_TYPE, const fmi3ValueReference vr[], size_t n, const size_t sizes[], const fmi3Binary values[],
       size_t count)
ABSENT(fmi3GetClock, NO_CLOCKS, const fmi3ValueReference vr[], size_t n, fmi3Clock values[])
ABSENT(fmi3SetClock, NO_CLOCKS, const fmi3ValueReference vr[], size_t n, const fmi3Clock values[])
ABSENT(fmi3GetIntervalDecimal, NO_CLOCKS, const fmi3ValueReference vr[], size_t n, fmi3Float64 intervals[],
       fmi3IntervalQualifier qualifiers[])
ABSENT(fmi3GetIntervalFraction, NO_CLOCKS, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[],
       fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
ABSENT(fmi3GetShiftDecimal, NO_CLOCKS, const fmi3ValueReference vr[], size_t n, fmi3Float64 shifts[])
ABSENT(fmi3GetShiftFraction, NO_CLOCKS, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[],
       fmi3UInt64 resolutions[])
ABSENT(fmi3SetIntervalDecimal, NO_CLOCKS, const fmi3ValueReference vr[], size_t n, const fmi3Float64 intervals[])
ABSENT(fmi3SetIntervalFraction, NO_CLOCKS, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 counters[],
       const fmi3UInt64 resolutions[])
ABSENT(fmi3SetShiftDecimal, NO_CLOCKS, const fmi3ValueReference vr[], size_t n, const fmi3Float64 shifts[])
ABSENT(fmi3SetShiftFraction, NO_CLOCKS, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 counters[],
       const fmi3UInt64 resolutions[])
ABSENT(fmi3ActivateModelPartition, CS_ONLY, fmi3ValueReference clock, fmi3Float64 time)
ABSENT(fmi3GetNumberOfVariableDependencies, "modelDescription.xml has the dependencies", fmi3ValueReference vr,
       size_t *n)
ABSENT(fmi3GetVariableDependencies, "modelDescription.xml has the dependencies", fmi3ValueReference vr,
       size_t elements[], fmi3ValueReference independents[], size_t elements_of_independents[],
       fmi3DependencyKind kinds[], size_t n)
ABSENT(fmi3GetDirectionalDerivative, NO_DERIVATIVES, const fmi3ValueReference unknowns[], size_t n_unknowns,
       const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], size_t n_seed,
       fmi3Float64 sensitivity[], size_t n_sensitivity)
ABSENT(fmi3GetAdjointDerivative, NO_DERIVATIVES, const fmi3ValueReference unknowns[], size_t n_unknowns,
       const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], size_t n_seed,
       fmi3Float64 sensitivity[], size_t n_sensitivity)
ABSENT(fmi3GetOutputDerivatives, NO_DERIVATIVES, const fmi3ValueReference vr[], size_t n, const fmi3Int32 orders[],
       fmi3Float64 values[], size_t count)
ABSENT_MODE(fmi3EnterConfigurationMode, NO_STRUCTURE)
ABSENT_MODE(fmi3ExitConfigurationMode, NO_STRUCTURE)
ABSENT_MODE(fmi3EnterEventMode, NO_EVENTS)
ABSENT_MODE(fmi3EnterStepMode, NO_EVENTS)
ABSENT_MODE(fmi3EvaluateDiscreteStates, NO_EVENTS)
ABSENT(fmi3UpdateDiscreteStates, NO_EVENTS, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
       fmi3Boolean *values, fmi3Boolean *next_defined, fmi3Float64 *next)
ABSENT_MODE(fmi3EnterContinuousTimeMode, CS_ONLY)
ABSENT(fmi3CompletedIntegratorStep, CS_ONLY, fmi3Boolean no_set_state, fmi3Boolean *event, fmi3Boolean *terminate)
ABSENT(fmi3SetTime, CS_ONLY, fmi3Float64 time)
ABSENT(fmi3SetContinuousStates, CS_ONLY, const fmi3Float64 x[], size_t n)
ABSENT(fmi3GetContinuousStateDerivatives, CS_ONLY, fmi3Float64 dx[], size_t n)
ABSENT(fmi3GetEventIndicators, CS_ONLY, fmi3Float64 z[], size_t n)
ABSENT(fmi3GetContinuousStates, CS_ONLY, fmi3Float64 x[], size_t n)
ABSENT(fmi3GetNominalsOfContinuousStates, CS_ONLY, fmi3Float64 x[], size_t n)
ABSENT(fmi3GetNumberOfEventIndicators, CS_ONLY, size_t *n)
ABSENT(fmi3GetNumberOfContinuousStates, CS_ONLY, size_t *n)
