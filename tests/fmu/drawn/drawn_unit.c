/* drawn_unit.c - a foreign FMU (-DFMI=2 or 3) whose variables stand in its token, so that one binary serves all drawn
 * model descriptions.
 *
 * Token: a word per variable, separated by ';'.  Variable k has the value reference k.
 *   TYPE CAUSALITY SIZE VALUE...   separated by ','
 *   TYPE       letters of Python's `struct`: d f b B h H i I q Q, ? Boolean, s string, e enumeration of 1 to 3
 *   CAUSALITY  u input, p parameter, c structural parameter, y output
 *   SIZE       a number, or @K: the value of variable K
 * A word `end,N` among them: the FMU ends the simulation in step N.
 * Every bit of every input and parameter counts: outputs are drawn from a hash of all that was set since the start.
 * A set of a wrong type, size or phase is an error.  The end of the initialisation is a warning, with which a run goes
 * on.  The place of the resources must be one root, not two. */
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if FMI == 2
#include "fmi2FunctionTypes.h"
#define NAME(x) fmi2##x
#else
#include "fmi3FunctionTypes.h"
#define NAME(x) fmi3##x
#endif

enum { MOST = 64, ELEMENTS = 8, TEXT = 64 };
enum { MADE, CONFIGURING, INITIALIZING, STEPPING };

typedef union {
  double d;
  float f;
  int8_t b;
  uint8_t B;
  int16_t h;
  uint16_t H;
  int32_t i;
  uint32_t I;
  int64_t q;
  uint64_t Q;
  char s[TEXT];
} cell;

typedef struct {
  char type, causality;
  int size, sized_by; /* sized_by: -1 */
  cell values[ELEMENTS];
} variable;

typedef struct {
  int n, phase, steps, last; /* last: the step in which it ends the simulation */
  uint64_t hash;
  variable v[MOST];
  void *environment;
#if FMI == 2
  fmi2CallbackLogger logger;
#else
  fmi3LogMessageCallback logger;
#endif
} unit;

static int refuse(unit *u, const char *format, ...) {
  char text[200];
  va_list list;
  va_start(list, format);
  vsnprintf(text, sizeof text, format, list);
  va_end(list);
#if FMI == 2
  if (u->logger) u->logger(u->environment, "drawn", fmi2Error, "error", text);
#else
  if (u->logger) u->logger(u->environment, fmi3Error, "error", text);
#endif
  return 3;
}

static uint64_t mixed(uint64_t z) {
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}

static size_t width(char type) {
  switch (type) {
    case 'e': return FMI == 2 ? 4 : 8;
    case 'f':
    case 'i':
    case 'I': return 4;
    case 'b':
    case 'B':
    case '?': return 1;
    case 'h':
    case 'H': return 2;
    default: return 8;
  }
}

static void put(cell *c, char type, const char *text) {
  memset(c, 0, sizeof *c);
  switch (type) {
    case 'd': c->d = strtod(text, NULL); break;
    case 'f': c->f = strtof(text, NULL); break;
    case 's': snprintf(c->s, sizeof c->s, "%s", text); break;
    case 'Q': c->Q = strtoull(text, NULL, 10); break;
    default: { /* two's complement: the low bytes; the union is little-endian here */
      const int64_t v = strtoll(text, NULL, 10);
      memcpy(c, &v, width(type));
    }
  }
}

static int size_of(const unit *u, const variable *v) {
  const uint64_t n = v->sized_by < 0 ? (uint64_t)v->size : u->v[v->sized_by].values[0].Q;
  return n > ELEMENTS ? ELEMENTS : (int)n;
}

/* 1 if the token is damaged */
static int read_token(unit *u, const char *token) {
  char *text = strdup(token), *after = NULL;
  int bad = 0;
  for (char *word = strtok_r(text, ";", &after); word && !bad; word = strtok_r(NULL, ";", &after)) {
    char *rest = NULL, *type = strtok_r(word, ",", &rest), *causality = strtok_r(NULL, ",", &rest);
    const char *size = strtok_r(NULL, ",", &rest), *start;
    if (type && causality && !strcmp(type, "end")) {
      u->last = atoi(causality);
      continue;
    }
    bad = u->n == MOST || !type || !causality || !size;
    if (bad) break;
    variable *v = u->v + u->n++;
    v->type = type[0], v->causality = causality[0];
    v->sized_by = size[0] == '@' ? atoi(size + 1) : -1;
    v->size = size[0] == '@' ? 0 : atoi(size);
    bad = v->sized_by >= u->n || v->size < 0 || v->size > ELEMENTS;
    for (int e = 0; e < ELEMENTS && (start = strtok_r(NULL, ",", &rest)); e++)
      put(v->values + e, v->type, start[0] == '!' ? start + 1 : start); /* strings begin with '!': none is empty */
  }
  free(text);
  return bad || u->n == 0;
}

/* all that is set goes into the hash; then every output takes bits of it */
static void calculate(unit *u) {
  for (int k = 0; k < u->n; k++) {
    const variable *v = u->v + k;
    if (v->causality == 'y') continue;
    for (int e = 0; e < size_of(u, v); e++) {
      const unsigned char *bytes = (const unsigned char *)(v->values + e);
      const size_t n = v->type == 's' ? strlen(v->values[e].s) : width(v->type);
      for (size_t b = 0; b < n; b++) u->hash = (u->hash ^ bytes[b]) * 0x100000001B3u;
      u->hash = mixed(u->hash + (uint64_t)(k * ELEMENTS + e));
    }
  }
  for (int k = 0; k < u->n; k++) {
    variable *v = u->v + k;
    for (int e = 0; v->causality == 'y' && e < size_of(u, v); e++) {
      const uint64_t z = mixed(u->hash + 0x9E3779B97F4A7C15u * (uint64_t)(k * ELEMENTS + e + 1));
      const double x = (double)(int64_t)z / 9223372036854775808.0;
      memset(v->values + e, 0, sizeof *v->values);
      if (v->type == 'd') v->values[e].d = x;
      else if (v->type == 'f') v->values[e].f = (float)x;
      else if (v->type == 'e') v->values[e].q = (int64_t)(z % 3 + 1);
      else if (v->type == '?') v->values[e].B = z & 1;
      else if (v->type == 's') snprintf(v->values[e].s, TEXT, "%llx", (unsigned long long)z);
      else memcpy(v->values + e, &z, width(v->type));
    }
  }
}

static variable *find(unit *u, uint32_t r, char type, int set) {
  variable *v = r < (uint32_t)u->n ? u->v + r : NULL;
  const char enumeration = FMI == 2 ? 'i' : 'q'; /* what its functions are those of */
  if (!v || (v->type == 'e' ? enumeration : v->type) != type)
    return refuse(u, "reference %u is no variable of type %c", r, type), NULL;
  if (!set) return v;
  const int good = v->causality == 'u'   ? u->phase == INITIALIZING || u->phase == STEPPING
                   : v->causality == 'p' ? u->phase == MADE || u->phase == INITIALIZING
                   : v->causality == 'c' ? u->phase == CONFIGURING
                                         : 0;
  return good ? v : (refuse(u, "reference %u cannot be set now", r), NULL);
}

#if FMI == 2
#define VALUES(T) size_t n, T *x
#define COUNT n
#else
#define VALUES(T) size_t n, T *x, size_t n_x
#define COUNT n_x
#endif
#define ACCESS(Name, T, letter, put_one, get_one)                    \
  int NAME(Set##Name)(void *c, const uint32_t *r, VALUES(const T)) { \
    size_t at = 0;                                                   \
    for (size_t k = 0; k < n; k++) {                                 \
      variable *v = find(c, r[k], letter, 1);                        \
      if (!v) return 3;                                              \
      for (int e = 0; e < size_of(c, v); e++, at++) {                \
        if (at >= COUNT) return refuse(c, "set: too few values");    \
        put_one;                                                     \
      }                                                              \
    }                                                                \
    return at == COUNT ? 0 : refuse(c, "set: too many values");      \
  }                                                                  \
  int NAME(Get##Name)(void *c, const uint32_t *r, VALUES(T)) {       \
    size_t at = 0;                                                   \
    for (size_t k = 0; k < n; k++) {                                 \
      variable *v = find(c, r[k], letter, 0);                        \
      if (!v) return 3;                                              \
      for (int e = 0; e < size_of(c, v); e++, at++) {                \
        if (at >= COUNT) return refuse(c, "get: too few values");    \
        get_one;                                                     \
      }                                                              \
    }                                                                \
    return at == COUNT ? 0 : refuse(c, "get: too many values");      \
  }
#define NUMBERS(Name, T, letter, member) \
  ACCESS(Name, T, letter, v->values[e].member = x[at], x[at] = v->values[e].member)
#define STRINGS(Name, T) ACCESS(Name, T, 's', snprintf(v->values[e].s, TEXT, "%s", x[at]), x[at] = v->values[e].s)

#if FMI == 2
NUMBERS(Real, double, 'd', d)
NUMBERS(Integer, int32_t, 'i', i)
NUMBERS(Boolean, int32_t, '?', B)
STRINGS(String, fmi2String)
#else
NUMBERS(Float64, double, 'd', d)
NUMBERS(Float32, float, 'f', f)
NUMBERS(Int8, int8_t, 'b', b)
NUMBERS(UInt8, uint8_t, 'B', B)
NUMBERS(Int16, int16_t, 'h', h)
NUMBERS(UInt16, uint16_t, 'H', H)
NUMBERS(Int32, int32_t, 'i', i)
NUMBERS(UInt32, uint32_t, 'I', I)
NUMBERS(Int64, int64_t, 'q', q)
NUMBERS(UInt64, uint64_t, 'Q', Q)
NUMBERS(Boolean, fmi3Boolean, '?', B)
STRINGS(String, fmi3String)
#endif

static int enter(unit *u, int from, int to) {
  if (u->phase != from) return refuse(u, "phase %d cannot follow phase %d", to, u->phase);
  u->phase = to;
  return 0;
}

#if FMI == 2
const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
void *fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String place,
                      const fmi2CallbackFunctions *f, fmi2Boolean visible, fmi2Boolean on) {
  (void)name, (void)type, (void)visible, (void)on;
  unit *u = calloc(1, sizeof *u);
  u->logger = f->logger, u->environment = f->componentEnvironment;
  if (read_token(u, token) || strncmp(place, "file:///", 8) || place[8] == '/') return free(u), NULL;
  return u;
}
int fmi2GetBooleanStatus(unit *u, fmi2StatusKind kind, fmi2Boolean *value) {
  *value = kind == fmi2Terminated && u->last && u->steps >= u->last;
  return kind == fmi2Terminated ? fmi2OK : fmi2Discard;
}
int fmi2SetupExperiment(unit *u) { return u->phase == MADE ? 0 : refuse(u, "is set up late"); }
#else
const char *fmi3GetVersion(void) { return "3.0"; }
void *fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String place, fmi3Boolean visible,
                                  fmi3Boolean on, fmi3Boolean events, fmi3Boolean early, const uint32_t *r, size_t n,
                                  void *environment, fmi3LogMessageCallback log,
                                  fmi3IntermediateUpdateCallback update) {
  (void)name, (void)place, (void)visible, (void)on, (void)events, (void)early, (void)r, (void)n, (void)update;
  unit *u = calloc(1, sizeof *u);
  u->logger = log, u->environment = environment;
  if (read_token(u, token)) return free(u), NULL;
  return u;
}
int fmi3EnterConfigurationMode(unit *u) { return enter(u, MADE, CONFIGURING); }
int fmi3ExitConfigurationMode(unit *u) { return enter(u, CONFIGURING, MADE); }
#endif
void NAME(FreeInstance)(unit *u) { free(u); }
int NAME(EnterInitializationMode)(unit *u) { return enter(u, MADE, INITIALIZING); }
int NAME(ExitInitializationMode)(unit *u) {
  if (enter(u, INITIALIZING, STEPPING)) return 3;
  calculate(u);
  return 1;
}
int NAME(Terminate)(unit *u) {
  if (u->phase != STEPPING) return refuse(u, "does not run");
  return u->last < 0 ? refuse(u, "refuses the end") : 0;
}

#if FMI == 2
int fmi2DoStep(unit *u, double t, double h, int forward) {
  (void)t, (void)h, (void)forward;
#else
int fmi3DoStep(unit *u, double t, double h, fmi3Boolean forward, fmi3Boolean *event, fmi3Boolean *end,
               fmi3Boolean *early, double *reached) {
  (void)forward, (void)event, (void)early; /* what is not so is not written */
  *reached = t + h;
#endif
  if (u->phase != STEPPING) return refuse(u, "does not run");
  if (++u->steps == u->last) {
#if FMI == 2
    return fmi2Discard;
#else
    *end = 1;
#endif
  }
  calculate(u);
  return 0;
}

static int save(const unit *u, void **state) {
  if (!*state) *state = malloc(sizeof *u);
  memcpy(*state, u, sizeof *u);
  return 0;
}
static int restore(unit *u, const void *state) {
  memcpy(u, state, sizeof *u);
  return 0;
}
static int forget(void **state) {
  free(*state);
  *state = NULL;
  return 0;
}
#if FMI == 2
int fmi2GetFMUstate(unit *u, void **state) { return save(u, state); }
int fmi2SetFMUstate(unit *u, void *state) { return restore(u, state); }
int fmi2FreeFMUstate(unit *u, void **state) { return (void)u, forget(state); }
#else
int fmi3GetFMUState(unit *u, void **state) { return save(u, state); }
int fmi3SetFMUState(unit *u, void *state) { return restore(u, state); }
int fmi3FreeFMUState(unit *u, void **state) { return (void)u, forget(state); }
#endif

/* functions of the standard that are never called: an importer looks them up */
#define STUB(name) \
  int name(void) { return 3; }
#include "stubs.h"
