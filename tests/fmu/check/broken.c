/* broken.c - a small FMI 2.0 unit, x' = u and y = k x + u, with a defect: the guid {broken n}.
 * In Model Exchange it has a second state, w' = -w, and an event at t = 0.1013 s that changes nothing, and must not be
 * passed over. */
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "fmi2Functions.h"

enum {
  NONE,
  ADVANCES_ON_GET,
  ADVANCES_ON_SET,
  LEAKS,
  RESTORES_NOTHING,
  RESTORES_ONCE,
  RESETS_NOTHING,
  CRASHES_ON_SECOND,
  SHARES_MEMORY,
  HANGS,
  CRASHES,
  GIVES_NAN,
  WRONG_DERIVATIVE,
  IGNORES_INPUT,
  REFUSES_STEP,
  NOT_REPEATABLE,
  ODD_FOLDER,
  EXITS,
  TAKES_ALL_MEMORY,
  LOSES_BYTES,
  LOSES_PARAMETER,
  CRASHES_ON_NULL,
  RESET_KEEPS_VALUES,
  KEEPS_FREED_POINTER,
  HIDES_A_VARIABLE,
  REFUSES_OTHER_STEPS,
  REFUSES_TO_END,
  ENDS_AT_ONCE,
  REFUSES_INPUT,
  ENDLESS_EVENTS,
  EVENT_IN_THE_PAST,
  OTHER_ORDER,
  ADVANCES_ON_DERIVATIVES,
  ADVANCES_ON_SET_TIME,
  NO_NOMINAL,
  REFUSES_EVENT_MODE,
  NOT_REPEATABLE_STATES
};

typedef struct {
  double u, x, k, y, w, t, next;
  int steps, number;
} unit;

static int defect, instances, made, exchange;
static double shared;
static void *volatile lost; /* volatile: the compiler may remove an unused allocation */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
  (void)c, (void)on, (void)n, (void)names;
  return fmi2OK;
}

static void start(unit *i) {
  const unit fresh = {0, 0.25, defect == LOSES_PARAMETER ? 2.5 : 2, 0, 1, 0, 1e300, 0, made};
  *i = fresh;
  if (defect == NOT_REPEATABLE_STATES) {
    struct timespec now; /* the binary is unloaded between two runs: a counter would begin anew */
    clock_gettime(CLOCK_MONOTONIC, &now);
    i->x += 1e-12 * now.tv_nsec;
  }
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging_on) {
  (void)name, (void)functions, (void)visible, (void)logging_on;
  if (strncmp(guid, "{broken", 7) != 0) return NULL;
  defect = atoi(guid + 7);
  exchange = type == fmi2ModelExchange;
  if (defect == ODD_FOLDER && strchr(location, '%')) return NULL;
  if (defect == CRASHES_ON_SECOND && instances > 0) *(volatile int *)8 = 1;
  unit *i = malloc(sizeof *i);
  made++;
  start(i);
  instances++;
  return i;
}
void fmi2FreeInstance(fmi2Component c) {
  if (defect == CRASHES_ON_NULL) ((volatile unit *)c)->steps = 0;
  if (!c) return;
  free(c);
  instances--;
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean with, fmi2Real tolerance, fmi2Real t, fmi2Boolean stops,
                               fmi2Real stop) {
  (void)with, (void)tolerance, (void)stops, (void)stop;
  ((unit *)c)->t = t;
  return fmi2OK;
}

static double *at(unit *i, fmi2ValueReference r) {
  static double rate;
  if (r == 5) rate = i->u;
  if (r == 6) rate = -i->w;
  if (r == 4 && defect == HIDES_A_VARIABLE) return NULL;
  return r == 0 ? &i->u : r == 1 ? &i->y : r == 2 ? &i->k : r == 3 ? &i->x : r == 4 ? &i->w : r <= 6 ? &rate : NULL;
}

static void output(unit *i) { i->y = i->k * (defect == SHARES_MEMORY ? shared : i->x) + i->u; }

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  output(c);
  return fmi2OK;
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  output(c);
  return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) {
  (void)c;
  return defect == REFUSES_TO_END ? fmi2Error : fmi2OK;
}
fmi2Status fmi2Reset(fmi2Component c) {
  const double k = ((unit *)c)->k;
  if (defect != RESETS_NOTHING) start(c);
  if (defect == RESET_KEEPS_VALUES) ((unit *)c)->k = k;
  return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real value[]) {
  unit *i = c;
  for (size_t k = 0; k < n; k++) {
    if (!at(i, r[k])) return fmi2Error;
    if (i->steps == 0 || exchange) output(i);
    if (defect == ADVANCES_ON_GET && r[k] == 1) i->y += 1e-9;
    value[k] = *at(i, r[k]);
  }
  return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real value[]) {
  unit *i = c;
  for (size_t k = 0; k < n; k++) {
    if (!at(i, r[k])) return fmi2Error;
    if (defect == REFUSES_INPUT && r[k] == 0 && value[k] < 0) return fmi2Error;
    if (defect == ADVANCES_ON_SET && r[k] == 0) i->x += 1e-9 * value[k];
    if (defect != IGNORES_INPUT || r[k] != 0) *at(i, r[k]) = value[k];
  }
  return fmi2OK;
}
#define OTHER(name, T)                                                                                 \
  fmi2Status fmi2Get##name(fmi2Component c, const fmi2ValueReference r[], size_t n, T value[]) {       \
    (void)c, (void)r, (void)value;                                                                     \
    return n ? fmi2Error : fmi2OK;                                                                     \
  }                                                                                                    \
  fmi2Status fmi2Set##name(fmi2Component c, const fmi2ValueReference r[], size_t n, const T value[]) { \
    (void)c, (void)r, (void)value;                                                                     \
    return n ? fmi2Error : fmi2OK;                                                                     \
  }
OTHER(Integer, fmi2Integer)
OTHER(Boolean, fmi2Boolean)
OTHER(String, fmi2String)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
  if (!*state) *state = malloc(sizeof(unit));
  memcpy(*state, c, sizeof(unit));
  return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  if (defect != RESTORES_NOTHING) memcpy(c, state, sizeof(unit));
  if (defect == RESTORES_ONCE) ((unit *)state)->x += 1;
  return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
  (void)c;
  free(*state);
  if (defect != KEEPS_FREED_POINTER) *state = NULL;
  return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
  (void)c, (void)state;
  *size = sizeof(unit);
  return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  (void)c;
  memcpy(bytes, state, size);
  if (defect == LOSES_BYTES) memset(bytes, 0, 16);
  return fmi2OK;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
  (void)c;
  *state = malloc(sizeof(unit));
  memcpy(*state, bytes, size);
  return fmi2OK;
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
                                        const fmi2ValueReference known[], size_t m, const fmi2Real d[], fmi2Real s[]) {
  (void)c, (void)unknown, (void)n, (void)known, (void)m;
  s[0] = (defect == WRONG_DERIVATIVE ? -1 : 1) * d[0];
  return fmi2OK;
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer o[],
                                       const fmi2Real value[]) {
  (void)c, (void)r, (void)n, (void)o, (void)value;
  return fmi2Error;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer o[],
                                        fmi2Real value[]) {
  (void)c, (void)r, (void)n, (void)o, (void)value;
  return fmi2Error;
}

#ifdef NO_STEP
#define fmi2DoStep doStep /* the binary lacks the function */
fmi2Status doStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set);
#undef FMI2_Export
#endif
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set) {
  unit *i = c;
  if (defect == REFUSES_OTHER_STEPS && (h < 0.0099 || h > 0.0101)) return fmi2Error;
  if (defect == ENDS_AT_ONCE) return fmi2Discard;
  (void)t, (void)no_set;
  if (defect == HANGS && i->steps == 20)
    for (;;) sleep(1);
  if (defect == CRASHES && i->steps == 20) abort();
  if (defect == EXITS && i->steps == 20) exit(3);
  if (defect == REFUSES_STEP && i->steps == 20) return fmi2Error;
  if (defect == LEAKS) memset(lost = malloc(752), 1, 752);
  if (defect == TAKES_ALL_MEMORY) memset(lost = malloc((size_t)1 << 30), 1, 4096);
  i->x += h * i->u;
  shared = defect == SHARES_MEMORY ? shared + h * i->u : 0;
  i->steps++;
  output(i);
  if (defect == GIVES_NAN && i->steps == 7) i->y = 0.0 / (h - h);
  if (defect == NOT_REPEATABLE) i->y += 1e-12 * i->number;
  return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component c) {
  (void)c;
  return fmi2Error;
}
#define STATUS(name, T)                                                            \
  fmi2Status fmi2Get##name(fmi2Component c, const fmi2StatusKind kind, T *value) { \
    (void)c, (void)kind, (void)value;                                              \
    return fmi2Discard;                                                            \
  }
STATUS(Status, fmi2Status)
STATUS(RealStatus, fmi2Real)
STATUS(IntegerStatus, fmi2Integer)
STATUS(StringStatus, fmi2String)
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
  (void)c;
  *value = kind == fmi2Terminated;
  return fmi2OK;
}

/* ---- Model Exchange ---- */
fmi2Status fmi2EnterEventMode(fmi2Component c) {
  (void)c;
  return defect == REFUSES_EVENT_MODE ? fmi2Error : fmi2OK;
}
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
  unit *i = c;
  const double next = defect == EVENT_IN_THE_PAST && i->t > 0.05 ? 0.01 : 0.1013;
  memset(info, 0, sizeof *info);
  info->newDiscreteStatesNeeded = defect == ENDLESS_EVENTS;
  info->nextEventTimeDefined = i->t < 0.1013 - 1e-9 || defect == EVENT_IN_THE_PAST;
  info->nextEventTime = next;
  i->next = info->nextEventTimeDefined ? next : 1e300;
  return fmi2OK;
}
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
  (void)c;
  return fmi2OK;
}
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean *event, fmi2Boolean *ends) {
  (void)c, (void)no_set;
  *event = *ends = fmi2False;
  return fmi2OK;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) {
  if (t > ((unit *)c)->next + 1e-9) return fmi2Error;
  ((unit *)c)->t = t;
  if (defect == ADVANCES_ON_SET_TIME) ((unit *)c)->k += 1e-9;
  return fmi2OK;
}
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
  if (n != 2) return fmi2Error;
  ((unit *)c)->x = x[0], ((unit *)c)->w = x[1];
  return fmi2OK;
}
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
  if (n != 2) return fmi2Error;
  x[0] = ((unit *)c)->x, x[1] = ((unit *)c)->w;
  return fmi2OK;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real rates[], size_t n) {
  unit *i = c;
  if (n != 2) return fmi2Error;
  if (defect == ADVANCES_ON_DERIVATIVES) i->k += 1e-9;
  rates[defect == OTHER_ORDER] = i->u, rates[defect != OTHER_ORDER] = -i->w;
  return fmi2OK;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
  (void)c, (void)z;
  return n ? fmi2Error : fmi2OK;
}
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
  (void)c;
  for (size_t k = 0; k < n; k++) x[k] = defect == NO_NOMINAL ? 0 : 1;
  return fmi2OK;
}
