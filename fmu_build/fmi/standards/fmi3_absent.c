/* fmi3_absent.c - functions of FMI 3.0 that these FMUs do not support: they log a message and return Error.
 * modelDescription.xml declares none of them. */
#include "fmi/messages.h"
#include "fmi3Functions.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"
#define ABSENT(name, why, ...) \
  fmi3Status name(fmi3Instance c, __VA_ARGS__) { return (fmi3Status)fmi_absent((const instance *)c, #name, why); }
/* of variables: a call for none of them is no error, as importers may make it for every type */
#define ABSENT_VALUES(name, why, ...)                                                        \
  fmi3Status name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, __VA_ARGS__) {    \
    return (fmi3Status)(c && n == 0 ? FMI_OK : fmi_absent((const instance *)c, #name, why)); \
  }
#define ABSENT_MODE(name, why) \
  fmi3Status name(fmi3Instance c) { return (fmi3Status)fmi_absent((const instance *)c, #name, why); }
static const char NO_SCHEDULE[] = "this FMU has no Scheduled Execution";
static const char NO_CLOCKS[] = "this FMU has no clocks";
static const char NO_STRUCTURE[] = "this FMU has no structural parameters";
static const char NO_DERIVATIVES[] = "modelDescription.xml does not declare derivatives";
static const char NO_TYPE[] = "this FMU has no variables of that type";

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                               fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback log, fmi3ClockUpdateCallback clock,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
  if (log) log(environment, fmi3Error, "logStatusError", "This FMU has no Scheduled Execution.");
  return NULL;
}

#define NO_SUCH_TYPE(name)                                                 \
  ABSENT_VALUES(fmi3Get##name, NO_TYPE, fmi3##name values[], size_t count) \
  ABSENT_VALUES(fmi3Set##name, NO_TYPE, const fmi3##name values[], size_t count)
NO_SUCH_TYPE(Float32)
NO_SUCH_TYPE(Int8)
NO_SUCH_TYPE(UInt8)
NO_SUCH_TYPE(Int16)
NO_SUCH_TYPE(UInt16)
NO_SUCH_TYPE(UInt32)
NO_SUCH_TYPE(UInt64)
NO_SUCH_TYPE(String)
ABSENT_VALUES(fmi3GetBinary, NO_TYPE, size_t sizes[], fmi3Binary values[], size_t count)
ABSENT_VALUES(fmi3SetBinary, NO_TYPE, const size_t sizes[], const fmi3Binary values[], size_t count)
ABSENT_VALUES(fmi3GetClock, NO_CLOCKS, fmi3Clock values[])
ABSENT_VALUES(fmi3SetClock, NO_CLOCKS, const fmi3Clock values[])
ABSENT_VALUES(fmi3GetIntervalDecimal, NO_CLOCKS, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
ABSENT_VALUES(fmi3GetIntervalFraction, NO_CLOCKS, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
              fmi3IntervalQualifier qualifiers[])
ABSENT_VALUES(fmi3GetShiftDecimal, NO_CLOCKS, fmi3Float64 shifts[])
ABSENT_VALUES(fmi3GetShiftFraction, NO_CLOCKS, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ABSENT_VALUES(fmi3SetIntervalDecimal, NO_CLOCKS, const fmi3Float64 intervals[])
ABSENT_VALUES(fmi3SetIntervalFraction, NO_CLOCKS, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT_VALUES(fmi3SetShiftDecimal, NO_CLOCKS, const fmi3Float64 shifts[])
ABSENT_VALUES(fmi3SetShiftFraction, NO_CLOCKS, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(fmi3ActivateModelPartition, NO_SCHEDULE, fmi3ValueReference clock, fmi3Float64 time)
ABSENT(fmi3GetNumberOfVariableDependencies, "modelDescription.xml has the dependencies", fmi3ValueReference vr,
       size_t *n)
ABSENT(fmi3GetVariableDependencies, "modelDescription.xml has the dependencies", fmi3ValueReference vr,
       size_t elements[], fmi3ValueReference independents[], size_t elements_of_independents[],
       fmi3DependencyKind kinds[], size_t n)
ABSENT_VALUES(fmi3GetOutputDerivatives, NO_DERIVATIVES, const fmi3Int32 orders[], fmi3Float64 values[], size_t count)
ABSENT_MODE(fmi3EnterConfigurationMode, NO_STRUCTURE)
ABSENT_MODE(fmi3ExitConfigurationMode, NO_STRUCTURE)
ABSENT_MODE(fmi3EvaluateDiscreteStates, "reading outputs in Event Mode evaluates the discrete states")
