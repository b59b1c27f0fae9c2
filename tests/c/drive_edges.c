/* Runs corner cases of the FMI layer: failed allocations, truncated reads, NULL pointers where an importer may omit one
 * or forgets it, long messages.
 *   drive_edges RESOURCES TOKEN
 * RESOURCES: those of a graph with continuous states and a sampled block.  Linked with --wrap for the functions below.
 * Exit 0: each was answered as the header says; the line is named otherwise. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"

#define DEMAND(condition)                                                              \
  do {                                                                                 \
    if (!(condition)) fprintf(stderr, "line %d: %s\n", __LINE__, #condition), exit(1); \
  } while (0)

/* ---- calls that fail -------------------------------------------------------------------------------------------- */
static long good_calls = -1; /* calls left before the one that fails; -1: none fails */
static int fails(void) { return good_calls >= 0 && good_calls-- == 0; }

void *__real_malloc(size_t n);
void *__real_calloc(size_t n, size_t size);
int __real_fseek(FILE *f, long at, int from);
size_t __real_fread(void *to, size_t size, size_t n, FILE *f);
void *__wrap_malloc(size_t n);
void *__wrap_calloc(size_t n, size_t size);
int __wrap_fseek(FILE *f, long at, int from);
size_t __wrap_fread(void *to, size_t size, size_t n, FILE *f);

void *__wrap_malloc(size_t n) { return fails() ? NULL : __real_malloc(n); }
void *__wrap_calloc(size_t n, size_t size) { return fails() ? NULL : __real_calloc(n, size); }
int __wrap_fseek(FILE *f, long at, int from) { return fails() ? -1 : __real_fseek(f, at, from); }
size_t __wrap_fread(void *to, size_t size, size_t n, FILE *f) { return fails() ? 0 : __real_fread(to, size, n, f); }

/* ---- an importer ------------------------------------------------------------------------------------------------ */
static const char *resources, *token;
static char said[1200];
static int n_messages;

static void hear2(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text,
                  ...) {
  (void)e, (void)name, (void)s, (void)category;
  n_messages++;
  snprintf(said, sizeof said, "%s", text);
}
static void hear3(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String text) {
  hear2(e, NULL, (fmi2Status)s, category, text);
}
static const fmi2CallbackFunctions CALLBACKS = {hear2, NULL, NULL, NULL, NULL};

static void *make2(fmi2Type type, const char *name, const char *guid, const char *location) {
  return fmi2Instantiate(name, type, guid, location, &CALLBACKS, 0, 0);
}
static void *make3(int events) {
  return fmi3InstantiateCoSimulation("a", token, resources, 0, 0, events, 0, NULL, 0, NULL, hear3, NULL);
}
static void *make(int kind) {
  switch (kind) {
    case 0: return make2(fmi2CoSimulation, "a", token, resources);
    case 1: return make2(fmi2ModelExchange, "a", token, resources);
    case 2: return make3(0);
    case 3: return make3(1);
    default: return fmi3InstantiateModelExchange("a", token, resources, 0, 0, NULL, hear3);
  }
}
static void end(int kind, void *c) { kind < 2 ? fmi2FreeInstance(c) : fmi3FreeInstance(c); }

/* ---- edges ------------------------------------------------------------------------------------------------------ */
/* Every call in turn fails while an instance is made: there is none, and a message says why; nothing leaks. */
static void fail_while_made(int kind) {
  long n = 0;
  void *c;
  for (;; n++) {
    good_calls = n;
    n_messages = 0;
    c = make(kind);
    const int reached = good_calls < 0;
    good_calls = -1;
    if (c && reached) DEMAND(!"a call failed without an error");
    if (c) break;
    DEMAND(n_messages == (n > 0)); /* the first call makes the instance itself: no logger yet */
  }
  DEMAND(n >= 10);
  end(kind, c);
}

static void fail_while_saved(void) {
  void *c = make(2), *state = NULL;
  char *bytes;
  size_t size;
  DEMAND(c && !fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0));
  good_calls = 0;
  DEMAND(fmi3GetFMUState(c, &state) == fmi3Error && !state && !strcmp(said, "out of memory"));
  DEMAND(!fmi3GetFMUState(c, &state) && !fmi3SerializedFMUStateSize(c, state, &size));
  DEMAND((bytes = malloc(size)) && !fmi3SerializeFMUState(c, state, (fmi3Byte *)bytes, size));
  void *again = NULL;
  good_calls = 0;
  DEMAND(fmi3DeserializeFMUState(c, (fmi3Byte *)bytes, size, &again) == fmi3Error && !again);
  DEMAND(!fmi3DeserializeFMUState(c, (fmi3Byte *)bytes, size, &state)); /* into a state that is there */
  again = &size;                                                        /* whatever it is, the call makes a state */
  DEMAND(!fmi3DeserializeFMUState(c, (fmi3Byte *)bytes, size, &again) && again != &size && again != state);
  DEMAND(!fmi3FreeFMUState(c, &again));
  DEMAND(fmi3DeserializeFMUState(c, NULL, size, &state) == fmi3Error);
  DEMAND(fmi3DeserializeFMUState(c, (fmi3Byte *)bytes, size, NULL) == fmi3Error);
  DEMAND(fmi3SerializeFMUState(c, state, NULL, size) == fmi3Error);
  DEMAND(fmi3SerializeFMUState(c, &size, (fmi3Byte *)bytes, size) == fmi3Error);
  DEMAND(fmi3SerializedFMUStateSize(c, &size, &size) == fmi3Error);
  DEMAND(fmi3GetFMUState(c, NULL) == fmi3Error);
  again = &size;
  DEMAND(fmi3GetFMUState(c, &again) == fmi3Error && fmi3FreeFMUState(c, &again) == fmi3Error);
  DEMAND(!fmi3FreeFMUState(c, &state) && !state);
  DEMAND(!fmi3FreeFMUState(c, &state) && !fmi3FreeFMUState(c, NULL)); /* the standards: ignored */
  free(bytes);
  fmi3FreeInstance(c);
}

/* NULL result pointers; other calls keep their values */
static void leave_results_out(void) {
  void *c = make(4);
  DEMAND(c && !fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0) && !fmi3ExitInitializationMode(c));
  DEMAND(!fmi3UpdateDiscreteStates(c, NULL, NULL, NULL, NULL, NULL, NULL) && !fmi3EnterContinuousTimeMode(c));
  DEMAND(!fmi3CompletedIntegratorStep(c, 1, NULL, NULL));
  fmi3FreeInstance(c);
  DEMAND((c = make(2)) && !fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0) && !fmi3ExitInitializationMode(c));
  DEMAND(!fmi3DoStep(c, 0, 1e-3, 1, NULL, NULL, NULL, NULL));
  fmi3FreeInstance(c);
  DEMAND((c = make(1)) && !fmi2SetupExperiment(c, 0, 0, 0, 0, 0) && !fmi2EnterInitializationMode(c));
  DEMAND(!fmi2ExitInitializationMode(c) && !fmi2NewDiscreteStates(c, NULL) && !fmi2EnterContinuousTimeMode(c));
  DEMAND(!fmi2CompletedIntegratorStep(c, 1, NULL, NULL));
  fmi2FreeInstance(c);
}

/* No step asks for Event Mode; in one that the importer enters, its sample is taken again. */
static void ask_for_an_event(void) {
  void *c = make(3);
  fmi3Boolean event = 1, again, end, early;
  double t;
  DEMAND(c && !fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0) && !fmi3ExitInitializationMode(c));
  DEMAND(!fmi3UpdateDiscreteStates(c, &again, &end, NULL, NULL, NULL, NULL) && !fmi3EnterStepMode(c));
  DEMAND(!fmi3DoStep(c, 0, 5.7e-15, 1, &event, &end, &early, &t) && !event && t == 0);
  DEMAND(!fmi3DoStep(c, 0, 1e-3, 1, &event, &end, &early, &t) && !event && t == 1e-3);
  DEMAND(!fmi3EnterEventMode(c) && !fmi3UpdateDiscreteStates(c, &again, &end, NULL, NULL, NULL, NULL));
  DEMAND(!fmi3EnterStepMode(c) && !fmi3DoStep(c, 1e-3, 5.7e-15, 1, &event, &end, &early, &t));
  DEMAND(!event && !early && !end && t == 1e-3);
  fmi3FreeInstance(c);
}

/* NULL instead of an array or a result: Error, and a message that names the call and the argument */
#define REFUSE(call, what)                                                          \
  do {                                                                              \
    said[0] = 0;                                                                    \
    DEMAND((int)(call) == fmi2Error && !strncmp(said, #call, strcspn(#call, "("))); \
    DEMAND(strstr(said, ": the pointer to the " what " is NULL."));                 \
  } while (0)

static void give_no_arrays(void) {
  const fmi2ValueReference first[1] = {0};
  void *c = make(1), *state = NULL;
  DEMAND(c && !fmi2SetupExperiment(c, 0, 0, 0, 0, 0) && !fmi2EnterInitializationMode(c));
  {
    fmi2Real some[1] = {0};
    REFUSE(fmi2GetReal(c, NULL, 1, some), "value references");
    REFUSE(fmi2GetReal(c, first, 1, NULL), "values");
    REFUSE(fmi2SetReal(c, NULL, 1, some), "value references");
    REFUSE(fmi2SetReal(c, first, 1, NULL), "values");
    REFUSE(fmi2GetInteger(c, NULL, 1, NULL), "value references");
    REFUSE(fmi2GetInteger(c, first, 1, NULL), "values");
    REFUSE(fmi2SetInteger(c, NULL, 1, NULL), "value references");
    REFUSE(fmi2SetInteger(c, first, 1, NULL), "values");
    REFUSE(fmi2GetBoolean(c, NULL, 1, NULL), "value references");
    REFUSE(fmi2GetBoolean(c, first, 1, NULL), "values");
    REFUSE(fmi2SetBoolean(c, NULL, 1, NULL), "value references");
    REFUSE(fmi2SetBoolean(c, first, 1, NULL), "values");
    REFUSE(fmi2GetString(c, NULL, 1, NULL), "value references");
    REFUSE(fmi2SetString(c, NULL, 1, NULL), "value references");
    REFUSE(fmi2GetDirectionalDerivative(c, NULL, 1, first, 1, some, some), "unknowns");
    REFUSE(fmi2GetDirectionalDerivative(c, first, 1, NULL, 1, some, some), "knowns");
    REFUSE(fmi2GetDirectionalDerivative(c, first, 1, first, 1, NULL, some), "seeds");
    REFUSE(fmi2GetDirectionalDerivative(c, first, 1, first, 1, some, NULL), "sensitivities");
    DEMAND(!fmi2GetReal(c, NULL, 0, NULL) && !fmi2SetReal(c, NULL, 0, NULL));
    DEMAND(!fmi2GetInteger(c, NULL, 0, NULL) && !fmi2SetInteger(c, NULL, 0, NULL));
    DEMAND(!fmi2GetBoolean(c, NULL, 0, NULL) && !fmi2SetBoolean(c, NULL, 0, NULL));
    DEMAND(!fmi2GetDirectionalDerivative(c, NULL, 0, NULL, 0, NULL, NULL));
    REFUSE(fmi2GetContinuousStates(c, NULL, 1), "continuous states");
    REFUSE(fmi2GetDerivatives(c, NULL, 1), "derivatives");
    REFUSE(fmi2GetNominalsOfContinuousStates(c, NULL, 1), "nominal values");
    DEMAND(!fmi2GetEventIndicators(c, NULL, 0));
    DEMAND(!fmi2GetFMUstate(c, &state));
    REFUSE(fmi2SerializedFMUstateSize(c, state, NULL), "size");
    REFUSE(fmi2SetDebugLogging(c, 1, 1, NULL), "log categories");
    DEMAND(!fmi2SetDebugLogging(c, 1, 0, NULL) && !fmi2ExitInitializationMode(c) && !fmi2EnterContinuousTimeMode(c));
    REFUSE(fmi2SetContinuousStates(c, NULL, 1), "continuous states");
  }
  fmi2FreeInstance(c);
  DEMAND((c = make(0)) && !fmi2SetupExperiment(c, 0, 0, 0, 0, 0) && !fmi2EnterInitializationMode(c));
  DEMAND(!fmi2ExitInitializationMode(c));
  REFUSE(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, NULL), "value");
  REFUSE(fmi2GetBooleanStatus(c, fmi2Terminated, NULL), "value");
  fmi2FreeInstance(c);
  DEMAND((c = make(4)) && !fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0));
  {
    fmi3Float64 some[1] = {0};
    REFUSE(fmi3GetFloat64(c, NULL, 1, some, 1), "value references");
    REFUSE(fmi3GetFloat64(c, first, 1, NULL, 1), "values");
    REFUSE(fmi3SetFloat64(c, NULL, 1, some, 1), "value references");
    REFUSE(fmi3SetFloat64(c, first, 1, NULL, 1), "values");
    REFUSE(fmi3GetInt32(c, NULL, 1, NULL, 1), "value references");
    REFUSE(fmi3GetInt32(c, first, 1, NULL, 1), "values");
    REFUSE(fmi3SetInt32(c, NULL, 1, NULL, 1), "value references");
    REFUSE(fmi3SetInt32(c, first, 1, NULL, 1), "values");
    REFUSE(fmi3GetInt64(c, NULL, 1, NULL, 1), "value references");
    REFUSE(fmi3GetInt64(c, first, 1, NULL, 1), "values");
    REFUSE(fmi3SetInt64(c, NULL, 1, NULL, 1), "value references");
    REFUSE(fmi3SetInt64(c, first, 1, NULL, 1), "values");
    REFUSE(fmi3GetBoolean(c, NULL, 1, NULL, 1), "value references");
    REFUSE(fmi3GetBoolean(c, first, 1, NULL, 1), "values");
    REFUSE(fmi3SetBoolean(c, NULL, 1, NULL, 1), "value references");
    REFUSE(fmi3SetBoolean(c, first, 1, NULL, 1), "values");
    REFUSE(fmi3GetDirectionalDerivative(c, NULL, 1, first, 1, some, 1, some, 1), "unknowns");
    REFUSE(fmi3GetDirectionalDerivative(c, first, 1, NULL, 1, some, 1, some, 1), "knowns");
    REFUSE(fmi3GetDirectionalDerivative(c, first, 1, first, 1, NULL, 1, some, 1), "seeds");
    REFUSE(fmi3GetDirectionalDerivative(c, first, 1, first, 1, some, 1, NULL, 1), "sensitivities");
    REFUSE(fmi3GetAdjointDerivative(c, NULL, 1, first, 1, some, 1, some, 1), "unknowns");
    REFUSE(fmi3GetAdjointDerivative(c, first, 1, NULL, 1, some, 1, some, 1), "knowns");
    REFUSE(fmi3GetAdjointDerivative(c, first, 1, first, 1, NULL, 1, some, 1), "seeds");
    REFUSE(fmi3GetAdjointDerivative(c, first, 1, first, 1, some, 1, NULL, 1), "sensitivities");
    DEMAND(!fmi3GetFloat64(c, NULL, 0, NULL, 0) && !fmi3SetFloat64(c, NULL, 0, NULL, 0));
    DEMAND(!fmi3GetInt32(c, NULL, 0, NULL, 0) && !fmi3SetInt32(c, NULL, 0, NULL, 0));
    DEMAND(!fmi3GetInt64(c, NULL, 0, NULL, 0) && !fmi3SetInt64(c, NULL, 0, NULL, 0));
    DEMAND(!fmi3GetBoolean(c, NULL, 0, NULL, 0) && !fmi3SetBoolean(c, NULL, 0, NULL, 0));
    DEMAND(!fmi3GetDirectionalDerivative(c, NULL, 0, NULL, 0, NULL, 0, NULL, 0));
    DEMAND(!fmi3GetAdjointDerivative(c, NULL, 0, NULL, 0, NULL, 0, NULL, 0));
    REFUSE(fmi3GetContinuousStates(c, NULL, 1), "continuous states");
    REFUSE(fmi3GetContinuousStateDerivatives(c, NULL, 1), "derivatives");
    REFUSE(fmi3GetNominalsOfContinuousStates(c, NULL, 1), "nominal values");
    REFUSE(fmi3GetNumberOfContinuousStates(c, NULL), "number");
    REFUSE(fmi3GetNumberOfEventIndicators(c, NULL), "number");
    DEMAND(!fmi3GetEventIndicators(c, NULL, 0));
    state = NULL;
    DEMAND(!fmi3GetFMUState(c, &state));
    REFUSE(fmi3SerializedFMUStateSize(c, state, NULL), "size");
    REFUSE(fmi3SetDebugLogging(c, 1, 1, NULL), "log categories");
    DEMAND(!fmi3ExitInitializationMode(c) && !fmi3EnterContinuousTimeMode(c));
    REFUSE(fmi3SetContinuousStates(c, NULL, 1), "continuous states");
  }
  fmi3FreeInstance(c);
}

/* failed instantiation, with and without a logger */
static void refuse_to_be_made(void) {
  const fmi3ValueReference one = 0;
  char endless[901];
  DEMAND(!make2(fmi2CoSimulation, NULL, token, resources) && !make2(fmi2CoSimulation, " \t", token, resources));
  DEMAND(!make2(fmi2CoSimulation, "a", NULL, resources) && !make2(fmi2CoSimulation, "a", token, NULL));
  DEMAND(!fmi2Instantiate("a", fmi2CoSimulation, "", resources, NULL, 0, 0));
  for (int k = 0; k < 900; k++) endless[k] = "%#a"[k % 3];
  endless[900] = 0;
  DEMAND(!make2(fmi2CoSimulation, "a", endless, resources) && strlen(said) > 900 && strstr(said, "'%%##a%%##a"));
  n_messages = 0;
  DEMAND(!fmi3InstantiateCoSimulation("a", token, resources, 0, 0, 0, 0, &one, 1, NULL, hear3, NULL));
  DEMAND(!fmi3InstantiateScheduledExecution("a", token, resources, 0, 0, NULL, hear3, NULL, NULL, NULL));
  DEMAND(n_messages == 2);
  DEMAND(!fmi3InstantiateCoSimulation("a", token, resources, 0, 0, 0, 0, &one, 1, NULL, NULL, NULL));
  DEMAND(!fmi3InstantiateScheduledExecution("a", token, resources, 0, 0, NULL, NULL, NULL, NULL, NULL));
  DEMAND(n_messages == 2);
}

static void ask_what_is_not_there(void) {
  void *c = make(0);
  fmi2Real t;
  fmi2Boolean terminated = 1;
  fmi2Status status;
  const fmi2ValueReference first = 0;
  const char *names[] = {"logEvents", NULL}, *all[] = {"logAll"};
  DEMAND(c && !fmi2SetDebugLogging(c, 1, 1, all) && !fmi2SetDebugLogging(c, 0, 1, names));
  DEMAND(fmi2SetDebugLogging(c, 1, 2, names) == fmi2Error && fmi2SetDebugLogging(c, 1, 1, NULL) == fmi2Error);
  DEMAND(!fmi2SetupExperiment(c, 0, 0, 0, 0, 0) && !fmi2EnterInitializationMode(c) && !fmi2ExitInitializationMode(c));
  DEMAND(!fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &t) && t == 0);
  DEMAND(fmi2GetRealStatus(c, fmi2PendingStatus, &t) == fmi2Discard);
  DEMAND(!fmi2GetBooleanStatus(c, fmi2Terminated, &terminated) && !terminated);
  DEMAND(fmi2GetBooleanStatus(c, fmi2DoStepStatus, &terminated) == fmi2Discard);
  DEMAND(fmi2GetStatus(c, fmi2DoStepStatus, &status) == fmi2Discard);
  DEMAND(!fmi2GetString(c, NULL, 0, NULL) && !fmi2SetString(c, NULL, 0, NULL)); /* zero strings */
  DEMAND(fmi2GetString(c, &first, 1, names) == fmi2Error && fmi2SetString(c, &first, 1, names) == fmi2Error);
  fmi2FreeInstance(c);
  fmi2FreeInstance(NULL);
}

/* the folder as a URI with every byte escaped, in lower and upper case: "file:%2f...", an absolute
 * path without a visible slash */
static void read_escapes(void) {
  const size_t n = strlen(resources);
  char *uri = malloc(3 * n + 6);
  for (int capital = 0; capital < 2; capital++) {
    strcpy(uri, "file:");
    for (size_t k = 0; k < n; k++) sprintf(uri + 5 + 3 * k, capital ? "%%%02X" : "%%%02x", (unsigned char)resources[k]);
    void *c = make2(fmi2CoSimulation, "a", token, uri);
    DEMAND(c);
    fmi2FreeInstance(c);
  }
  DEMAND(!make2(fmi2CoSimulation, "a", token, "file:%2g") && !make2(fmi2CoSimulation, "a", token, "file:%@1"));
  DEMAND(!make2(fmi2CoSimulation, "a", token, "file:%`1") && !make2(fmi2CoSimulation, "a", token, "file:%/1"));
  free(uri);
}

int main(int argc, char **argv) {
  if (argc != 3) return 2;
  resources = argv[1], token = argv[2];
  for (int kind = 0; kind < 5; kind++) fail_while_made(kind);
  fail_while_saved();
  leave_results_out();
  ask_for_an_event();
  give_no_arrays();
  refuse_to_be_made();
  ask_what_is_not_there();
  read_escapes();
  return 0;
}
