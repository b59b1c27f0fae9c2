/* container.c - an FMU 2.0 for Co-Simulation that steps other FMUs in a stated order, by the master loop of scenarios.
 *
 * Its outputs are those of all units; value reference k is value k of the system, and has the type that FMI 2.0 has for
 * it.  The units lie unpacked in its
 * resources.  A communication step is a whole number of steps of the system, from t = 0 on.  States cannot be saved,
 * because not every unit can. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "container/system_file.h"
#include "fmi/files/resource.h"
#include "fmi2Functions.h"
#include "master/master.h"

enum { MADE, INITIALIZING, STEPPING, ENDED, BROKEN }; /* BROKEN: a reset failed, there is no system */

static const double NO_STOP = 1e300;

typedef struct {
  char *name, *location, *text; /* text: the file, which the strings of the system point into */
  fmi2CallbackLogger logger;
  fmi2ComponentEnvironment environment;
  system_file system;
  int phase;
  double clock; /* of the importer: the present time with the rounding of its additions */
  double stop;  /* no step ends after it */
} container;

static fmi2Status refuse(const container *c, const char *format, ...) {
  char text[1024], safe[2048];
  va_list list;
  va_start(list, format);
  vsnprintf(text, sizeof text, format, list);
  va_end(list);
  size_t n = 0;
  for (const char *from = text; *from && n + 2 < sizeof safe; from++) { /* the message is a format without arguments */
    if (*from == '%' || *from == '#') safe[n++] = *from;
    safe[n++] = *from;
  }
  safe[n] = 0;
  if (c->logger) c->logger(c->environment, c->name, fmi2Error, "logStatusError", safe);
  return fmi2Error;
}

static void shut(container *c) {
  for (int64_t k = c->system.m.n_units; k-- > 0;) unit_close(c->system.units + k);
  system_free(&c->system);
  free(c->text);
  c->text = NULL;
}

/* reads the file and makes instances of all units; true after a message */
static bool open_system(container *c, const char *token) {
  char why[1024];
  size_t length = 0;
  char *path = fmi_resource(c->location, "system.txt", why, sizeof why), *root = NULL;
  unsigned char *file = path ? fmi_read_file(path, &length, why, sizeof why) : NULL;
  bool bad = !file || !(c->text = malloc(length + 1));
  if (!bad) {
    memcpy(c->text, file, length);
    c->text[length] = 0;
    bad = system_read(c->text, &c->system, why, sizeof why);
    if (!bad && token && strcmp(token, c->system.token) != 0)
      bad = 1, snprintf(why, sizeof why, "the GUID '%.60s' does not belong to this system.txt", token);
    if (!bad) root = path, root[strlen(root) - strlen("system.txt")] = 0;
    for (int64_t k = 0; !bad && k < c->system.m.n_units; k++)
      bad = unit_open(c->system.units + k, root, why, sizeof why);
  }
  free(file);
  free(path);
  if (!bad) return 0;
  refuse(c, "%s", why);
  shut(c);
  return 1;
}

static char *copied(const char *text) {
  char *made = malloc(strlen(text ? text : "") + 1);
  return made ? strcpy(made, text ? text : "") : NULL;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

void fmi2FreeInstance(fmi2Component component) {
  container *c = component;
  if (!c) return;
  shut(c);
  free(c->name), free(c->location), free(c);
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging_on) {
  (void)visible, (void)logging_on;
  container *c = calloc(1, sizeof *c);
  if (!c) return NULL;
  c->name = copied(name), c->location = copied(location), c->stop = NO_STOP;
  if (functions) c->logger = functions->logger, c->environment = functions->componentEnvironment;
  const int good = c->name && c->location && (type == fmi2CoSimulation || (refuse(c, "has no Model Exchange"), 0)) &&
                   !open_system(c, guid);
  if (good) return c;
  fmi2FreeInstance(c);
  return NULL;
}

#define ALLOW(call, phases) \
  container *c = component; \
  if (!c) return fmi2Error; \
  if (!(1 << c->phase & (phases))) return refuse(c, "fmi2" #call " is not allowed now");

fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean on, size_t n, const fmi2String categories[]) {
  ALLOW(SetDebugLogging, 15)
  (void)on, (void)n, (void)categories; /* errors are its only messages, and always sent */
  return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean tolerance_defined, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop) {
  ALLOW(SetupExperiment, 1 << MADE)
  (void)tolerance_defined, (void)tolerance;
  if (start != 0) return refuse(c, "starts at t = 0 only");
  if (stop_defined && !(stop >= 0 && stop - stop == 0))
    return refuse(c, "the stop time must be finite and not before the start time");
  c->stop = stop_defined ? stop : NO_STOP;
  return fmi2OK;
}

static fmi2Status failed(const container *c) {
  const master *m = &c->system.m;
  if (m->unit < 0) return refuse(c, "values that are not finite at t = %g s", m->t);
  const unit *u = c->system.units + m->unit;
  return refuse(c, "unit '%s' refuses the step from t = %g s%s%s", u->name, m->t, u->said[0] ? ": " : "", u->said);
}

/* without inputs and parameters, the units are initialised at once: outputs are read in Initialization Mode */
fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
  ALLOW(EnterInitializationMode, 1 << MADE)
  char why[1024];
  master *m = &c->system.m;
  for (int64_t k = 0; k < m->n_units; k++)
    if (unit_start(c->system.units + k, m->values, why, sizeof why)) return refuse(c, "%s", why);
  if (master_run(m, 1, NULL)) return failed(c); /* row 0 */
  c->phase = INITIALIZING;
  c->clock = 0;
  return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
  ALLOW(ExitInitializationMode, 1 << INITIALIZING)
  c->phase = STEPPING;
  return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component component, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
  ALLOW(DoStep, 1 << STEPPING)
  (void)no_set_state;
  master *m = &c->system.m;
  const double now = c->clock, steps = h / m->base, slack = 1e-3 * m->base;
  if (!(h > 0 && h <= 1e9)) return refuse(c, "the step size must be in (0, 1e9] s. Got %g instead.", h);
  if (!(t - now <= slack && now - t <= slack)) return refuse(c, "is at t = %g s; the step starts at %g s", now, t);
  if (!(steps <= 1e9))
    return refuse(c, "the step size must be at most 1e9 steps of %g s. Got %g s instead.", m->base, h);
  if (steps < 1e-6) return fmi2OK; /* rounding of the importer's clock: complete before it begins */
  if (t + h - c->stop > slack) return refuse(c, "the step ends at t = %g s, after the stop time %g s", t + h, c->stop);
  const int64_t n = (int64_t)(steps + 0.5);
  if (!(steps - (double)n <= 1e-3 && (double)n - steps <= 1e-3) || n < 1)
    return refuse(c, "the step size must be a whole number of %g s. Got %g s instead.", m->base, h);
  for (int64_t k = 0; k < m->n_units; k++) c->system.units[k].said[0] = 0;
  if (master_run(m, n * m->ripple, NULL)) return failed(c);
  c->clock = t + h;
  return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component component) {
  ALLOW(Terminate, 1 << STEPPING)
  c->phase = ENDED;
  fmi2Status all = fmi2OK;
  for (int64_t k = 0; k < c->system.m.n_units; k++) {
    unit *u = c->system.units + k;
    if (unit_end(u)) all = refuse(c, "unit '%s' cannot be terminated%s%s", u->name, u->said[0] ? ": " : "", u->said);
  }
  return all;
}

fmi2Status fmi2Reset(fmi2Component component) {
  ALLOW(Reset, 15 | 1 << BROKEN)
  shut(c);
  c->stop = NO_STOP;
  c->phase = open_system(c, NULL) ? BROKEN : MADE;
  return c->phase == BROKEN ? fmi2Error : fmi2OK;
}

/* the numbers of the master by the type of their variable */
#define GET(Name, T, letter)                                                                                 \
  fmi2Status fmi2Get##Name(fmi2Component component, const fmi2ValueReference vr[], size_t n, T value[]) {    \
    ALLOW(Get##Name, 15)                                                                                     \
    if (n && (!vr || !value)) return refuse(c, "fmi2Get" #Name ": a pointer is NULL");                       \
    for (size_t k = 0; k < n; k++) {                                                                         \
      if (vr[k] >= (uint64_t)c->system.m.n_values || c->system.types[vr[k]] != letter)                       \
        return refuse(c, "fmi2Get" #Name ": no variable has the value reference %lu", (unsigned long)vr[k]); \
      if (value_from_double(value_type_of(letter, 2), c->system.m.values[vr[k]], value + k))                 \
        return refuse(c, "fmi2Get" #Name ": %g does not fit the type " #Name, c->system.m.values[vr[k]]);    \
    }                                                                                                        \
    return fmi2OK;                                                                                           \
  }
GET(Real, fmi2Real, 'd')
GET(Integer, fmi2Integer, 'i')
GET(Boolean, fmi2Boolean, '?')

fmi2Status fmi2GetRealStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Real *value) {
  ALLOW(GetRealStatus, 1 << STEPPING | 1 << ENDED)
  if (kind != fmi2LastSuccessfulTime || !value) return fmi2Discard;
  *value = (double)((c->system.m.row - 1) / c->system.m.ripple) * c->system.m.base;
  return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Boolean *value) {
  ALLOW(GetBooleanStatus, 1 << STEPPING | 1 << ENDED)
  if (kind != fmi2Terminated || !value) return fmi2Discard;
  *value = fmi2False;
  return fmi2OK;
}

/* ---- what a container does not have: no inputs or parameters, no states ----------------------------------------- */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#define EMPTY(name, ...)                                                                           \
  fmi2Status name(fmi2Component component, const fmi2ValueReference vr[], size_t n, __VA_ARGS__) { \
    ALLOW(name, 15)                                                                                \
    return n == 0 ? fmi2OK : refuse(c, #name ": there is no such variable");                       \
  }
EMPTY(fmi2SetReal, const fmi2Real value[])
EMPTY(fmi2SetInteger, const fmi2Integer value[])
EMPTY(fmi2SetBoolean, const fmi2Boolean value[])
EMPTY(fmi2GetString, fmi2String value[])
EMPTY(fmi2SetString, const fmi2String value[])
EMPTY(fmi2SetRealInputDerivatives, const fmi2Integer order[], const fmi2Real value[])
EMPTY(fmi2GetRealOutputDerivatives, const fmi2Integer order[], fmi2Real value[])
#define ABSENT(name, ...)                                      \
  fmi2Status name(fmi2Component component, __VA_ARGS__) {      \
    ALLOW(name, 15)                                            \
    return refuse(c, #name " is not available: not declared"); \
  }
ABSENT(fmi2GetFMUstate, fmi2FMUstate *state)
ABSENT(fmi2SetFMUstate, fmi2FMUstate state)
ABSENT(fmi2FreeFMUstate, fmi2FMUstate *state)
ABSENT(fmi2SerializedFMUstateSize, fmi2FMUstate state, size_t *size)
ABSENT(fmi2SerializeFMUstate, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
ABSENT(fmi2DeSerializeFMUstate, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
ABSENT(fmi2GetDirectionalDerivative, const fmi2ValueReference unknown[], size_t n, const fmi2ValueReference known[],
       size_t m, const fmi2Real seed[], fmi2Real sensitivity[])
fmi2Status fmi2CancelStep(fmi2Component component) {
  ALLOW(CancelStep, 15)
  return refuse(c, "fmi2CancelStep is not available: not declared");
}
#define NO_STATUS(name, T) \
  fmi2Status name(fmi2Component component, const fmi2StatusKind kind, T *value) { return fmi2Discard; }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetStringStatus, fmi2String)
