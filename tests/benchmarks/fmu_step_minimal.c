/* fmu_step_minimal.c - the smallest FMI 2.0 FMU of the net: no states, checks or messages; for comparison only. */
#include <stdlib.h>

#include "fmi2Functions.h"
#include "fmu_step_net.h"

typedef struct {
  double value[3]; /* u_1, u_2, y */
} unit;

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging_on) {
  (void)name, (void)type, (void)guid, (void)location, (void)functions, (void)visible, (void)logging_on;
  return calloc(1, sizeof(unit));
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop) {
  (void)c, (void)tolerance_defined, (void)tolerance, (void)start, (void)stop_defined, (void)stop;
  return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return (void)c, fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return (void)c, fmi2OK; }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
  for (size_t k = 0; k < n; k++) ((unit *)c)->value[vr[k]] = value[k];
  return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
  for (size_t k = 0; k < n; k++) value[k] = ((unit *)c)->value[vr[k]];
  return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
  unit *const u = c;
  (void)t, (void)h, (void)no_set_state;
  u->value[2] = net(u->value);
  return fmi2OK;
}
