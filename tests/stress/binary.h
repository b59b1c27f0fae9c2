/* binary.h - loads the binary of an FMU and runs models with it as an importer does, FMI 2.0 and 3.0. */
#ifndef BINARY_H
#define BINARY_H
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/elementary/random.h"
#include "fmi2Functions.h"
#include "fmi3Functions.h"

/* clang-format off: its result for this list is not stable */
#define FUNCTIONS(F)             \
  F(fmi2Instantiate)             \
  F(fmi2FreeInstance)            \
  F(fmi2SetupExperiment)         \
  F(fmi2EnterInitializationMode) \
  F(fmi2ExitInitializationMode)  \
  F(fmi2SetReal)                 \
  F(fmi2GetReal)                 \
  F(fmi2DoStep)                  \
  F(fmi3InstantiateCoSimulation) \
  F(fmi3FreeInstance)            \
  F(fmi3EnterInitializationMode) \
  F(fmi3ExitInitializationMode)  \
  F(fmi3SetFloat64)              \
  F(fmi3GetFloat64)              \
  F(fmi3DoStep)
/* clang-format on */

typedef struct {
  void *handle;
#define FIELD(f) f##TYPE *f;
  FUNCTIONS(FIELD)
#undef FIELD
} binary;

/* prints a message to stderr and exits */
#define DEMAND(condition)                                                              \
  do {                                                                                 \
    if (!(condition)) fprintf(stderr, "line %d: %s\n", __LINE__, #condition), exit(1); \
  } while (0)

static binary load(const char *path) {
  binary b;
  b.handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!b.handle) fprintf(stderr, "%s\n", dlerror()), exit(1);
#define FIND(f) DEMAND(*(void **)&b.f = dlsym(b.handle, #f));
  FUNCTIONS(FIND)
#undef FIND
  return b;
}

/* the ports of modelDescription.xml as (first reference, elements) */
enum { MOST_PORTS = 64, MOST_VALUES = 256 };
typedef struct {
  char location[1000], token[80];
  int n_inputs, n_outputs;
  struct {
    unsigned reference, size;
  } input[MOST_PORTS], output[MOST_PORTS];
} model;

/* one model per line: location, token, number of inputs, reference and size of each, then the same for outputs */
static int read_models(const char *path, model *to, int most) {
  FILE *f = fopen(path, "r");
  int n = 0;
  DEMAND(f);
  while (n < most && fscanf(f, "%999s %79s %d", to[n].location, to[n].token, &to[n].n_inputs) == 3) {
    model *m = to + n++;
    DEMAND(m->n_inputs <= MOST_PORTS);
    for (int k = 0; k < m->n_inputs; k++) DEMAND(fscanf(f, "%u %u", &m->input[k].reference, &m->input[k].size) == 2);
    DEMAND(fscanf(f, "%d", &m->n_outputs) == 1 && m->n_outputs <= MOST_PORTS);
    for (int k = 0; k < m->n_outputs; k++) DEMAND(fscanf(f, "%u %u", &m->output[k].reference, &m->output[k].size) == 2);
  }
  fclose(f);
  return n;
}

static void quiet2(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text,
                   ...) {
  (void)e, (void)name, (void)category;
  if (s > fmi2Warning) fprintf(stderr, "%s\n", text);
}
static void quiet3(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String text) {
  (void)e, (void)category;
  if (s > fmi3Warning) fprintf(stderr, "%s\n", text);
}

static const double STEP = 0.05; /* sample time of the models, see excitation.py */
static const fmi2CallbackFunctions CALLBACKS = {quiet2, NULL, NULL, NULL, NULL};

static void *start(const binary *b, const model *m, int fmi) {
  void *c;
  if (fmi == 2) {
    DEMAND(c = b->fmi2Instantiate("a", fmi2CoSimulation, m->token, m->location, &CALLBACKS, 0, 0));
    DEMAND(!b->fmi2SetupExperiment(c, 0, 0, 0, 0, 0) && !b->fmi2EnterInitializationMode(c));
    DEMAND(!b->fmi2ExitInitializationMode(c));
  } else {
    DEMAND(c = b->fmi3InstantiateCoSimulation("a", m->token, m->location, 0, 0, 0, 0, NULL, 0, NULL, quiet3, NULL));
    DEMAND(!b->fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0) && !b->fmi3ExitInitializationMode(c));
  }
  return c;
}

static inline void stop(const binary *b, void *c, int fmi) {
  if (fmi == 2) b->fmi2FreeInstance(c);
  else b->fmi3FreeInstance(c);
}

/* Sets inputs, makes step k, reads outputs into the hash; 0 on success.  Calls only functions of the FMU. */
static int advance(const binary *b, const model *m, void *c, int fmi, int k, uint64_t *hash) {
  fmi2ValueReference vr[MOST_VALUES];
  double v[MOST_VALUES];
  fmi3Boolean flag[3];
  double t = k * STEP, last;
  for (int p = 0; p < m->n_inputs; p++) {
    const unsigned n = m->input[p].size;
    for (unsigned e = 0; e < n; e++) {
      vr[e] = m->input[p].reference + e;
      v[e] = hyst_random_uniform(vr[e], (uint64_t)k) - 0.5;
    }
    if (fmi == 2 ? (int)b->fmi2SetReal(c, vr, n, v) : (int)b->fmi3SetFloat64(c, vr, 1, v, n)) return 1;
  }
  if (fmi == 2 ? (int)b->fmi2DoStep(c, t, STEP, 1) : (int)b->fmi3DoStep(c, t, STEP, 1, flag, flag + 1, flag + 2, &last))
    return 2;
  for (int p = 0; p < m->n_outputs; p++) {
    const unsigned n = m->output[p].size;
    for (unsigned e = 0; e < n; e++) vr[e] = m->output[p].reference + e;
    if (fmi == 2 ? (int)b->fmi2GetReal(c, vr, n, v) : (int)b->fmi3GetFloat64(c, vr, 1, v, n)) return 3;
    for (unsigned e = 0; e < n; e++) *hash = (*hash ^ hyst_to_bits(v[e])) * 0x100000001b3u;
  }
  return 0;
}
#endif
