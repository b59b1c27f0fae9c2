/* unit.c - unit.h: calls of FMI 2.0 and FMI 3.0 for Co-Simulation through function pointers. */
#include "container/unit.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "container/library.h"
#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

/* the worst status with which a run continues is Warning */
#define BAD(status) ((int)(status) > 1)

static void log_fmi2(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text,
                     ...) {
  (void)name, (void)s, (void)category;
  va_list list;
  va_start(list, text);
  vsnprintf(((unit *)e)->said, UNIT_TEXT, text, list);
  va_end(list);
}
static void log_fmi3(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String text) {
  (void)s, (void)category;
  snprintf(((unit *)e)->said, UNIT_TEXT, "%s", text);
}

static bool refuse(const unit *u, char *why, size_t size, const char *what) {
  snprintf(why, size, "unit '%s': %s%s%s", u->name, what, u->said[0] ? ": " : "", u->said);
  for (char *c = why; *c; c++)
    if (*c == '\n' || *c == '\r') *c = ' ';
  return 1;
}

/* root + path; with `uri`, as file URI */
static char *joined(const char *root, const char *path, int uri) {
  static const char PLAIN[] = "/._~-:abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";
  char *made = malloc(3 * (strlen(root) + strlen(path)) + sizeof "file:////"), *to = made;
  if (!made) return NULL;
  if (uri) to += strlen(strcpy(to, root[0] == '/' ? "file://" : "file:///"));
  for (int part = 0; part < 2; part++)
    for (const char *c = part ? path : root; *c; c++)
      if (!uri || strchr(PLAIN, *c)) *to++ = *c;
      else to += snprintf(to, 4, "%%%02X", (unsigned char)*c);
  *to = 0;
  return made;
}

static void (*function(const unit *u, const char *name))(void) {
  char full[64];
  snprintf(full, sizeof full, "fmi%d%s", u->fmi, name);
  return library_function(u->loaded, full);
}
static void (*accessor(const unit *u, const char *verb, const value_type *t))(void) {
  char name[32];
  snprintf(name, sizeof name, "%s%s", verb, t->name);
  return function(u, name);
}

#define CALL(TYPE, name) ((TYPE *)function(u, #name))

static bool make(unit *u, const char *root) {
  const int two = u->fmi == 2;
  char *place = joined(root, u->resources, two);
  if (!place) return 1;
  if (two) {
    const fmi2CallbackFunctions given = {log_fmi2, calloc, free, NULL, u};
    fmi2CallbackFunctions *callbacks = malloc(sizeof *callbacks);
    if (callbacks) {
      memcpy(callbacks, &given, sizeof given); /* its members are constants */
      u->callbacks = callbacks;
      u->component =
          CALL(fmi2InstantiateTYPE, Instantiate)(u->name, fmi2CoSimulation, u->token, place, callbacks, 0, 0);
    }
  } else {
    u->component = CALL(fmi3InstantiateCoSimulationTYPE, InstantiateCoSimulation)(u->name, u->token, place, 0, 0, 0, 0,
                                                                                  NULL, 0, u, log_fmi3, NULL);
  }
  free(place);
  return !u->component;
}

/* Values by the functions of their type.  Those of FMI 2.0 take no number of elements: all are scalars. */
typedef int (*access2)(void *, const uint32_t *, size_t, void *);
typedef int (*access3)(void *, const uint32_t *, size_t, void *, size_t);

static bool transfer(const unit *u, void (*call)(void), const uint32_t *references, int64_t n_references, void *values,
                     int64_t n) {
  if (u->fmi == 2) return BAD(((access2)call)(u->component, references, (size_t)n_references, values));
  return BAD(((access3)call)(u->component, references, (size_t)n_references, values, (size_t)n));
}

static bool tell(const unit *u, const told *list, int64_t n) {
  for (int64_t k = 0; k < n; k++) {
    void (*call)(void) = accessor(u, "Set", list[k].type);
    if (!call || transfer(u, call, &list[k].reference, 1, list[k].values, list[k].n)) return 1;
  }
  return 0;
}

/* The functions that the master calls, as those of FMI 2.0: a status above 1 is a failure. */
enum { FAILED = 3 };

static int put_values(void *self, const uint32_t *references, size_t n, const double *values) {
  (void)n;
  unit *u = self;
  for (const batch *b = u->sets; b < u->sets + u->n_sets; b++) {
    for (int64_t k = 0; k < b->n; k++) {
      const double x = values[b->first + k];
      if (value_from_double(b->type, x, (char *)u->room + (size_t)k * b->type->size)) {
        snprintf(u->said, UNIT_TEXT, "%s: %g does not fit the type %s", u->names[b->first + k], x,
                 b->type->letter == 'e' ? "Enumeration" : b->type->name);
        return FAILED;
      }
    }
    if (transfer(u, b->call, references + b->reference, b->n_references, u->room, b->n)) return FAILED;
  }
  return 0;
}

static int get_values(void *self, const uint32_t *references, size_t n, double *values) {
  (void)n;
  unit *u = self;
  for (const batch *b = u->gets; b < u->gets + u->n_gets; b++) {
    memset(u->room, 0, (size_t)b->n * b->type->size); /* what a unit leaves unwritten is no number of another one */
    if (transfer(u, b->call, references + b->reference, b->n_references, u->room, b->n)) return FAILED;
    for (int64_t k = 0; k < b->n; k++)
      values[b->first + k] = value_to_double(b->type, (const char *)u->room + (size_t)k * b->type->size);
  }
  return 0;
}

static int make_step(void *self, double t, double h, int forward) {
  unit *u = self;
  if (u->fmi == 2) return ((fmi2DoStepTYPE *)u->step)(u->component, t, h, forward);
  fmi3Boolean event = 0, end = 0, early = 0;
  double reached;
  const int status = (int)((fmi3DoStepTYPE *)u->step)(u->component, t, h, forward != 0, &event, &end, &early, &reached);
  if (BAD(status)) return status;
  if (end) return snprintf(u->said, UNIT_TEXT, "the FMU ends the simulation"), FAILED;
  if (early) return snprintf(u->said, UNIT_TEXT, "doStep returns early, which was not allowed"), FAILED;
  return 0;
}

/* whether the library lacks a function that is called */
static bool look_up(unit *u) {
  static const char *const NEEDED[] = {"EnterInitializationMode", "ExitInitializationMode", "Terminate",
                                       "FreeInstance"};
  const int two = u->fmi == 2;
  bool lacks =
      !function(u, two ? "Instantiate" : "InstantiateCoSimulation") || (two && !function(u, "SetupExperiment"));
  for (size_t k = 0; k < sizeof NEEDED / sizeof *NEEDED; k++) lacks |= !function(u, NEEDED[k]);
  if (u->n_structural) lacks |= !function(u, "EnterConfigurationMode") || !function(u, "ExitConfigurationMode");
  for (int64_t k = 0; k < u->n_sets; k++) lacks |= !(u->sets[k].call = accessor(u, "Set", u->sets[k].type));
  for (int64_t k = 0; k < u->n_gets; k++) lacks |= !(u->gets[k].call = accessor(u, "Get", u->gets[k].type));
  return lacks | !(u->step = function(u, "DoStep"));
}

static bool configure(const unit *u) {
  if (!u->n_structural) return 0;
  return BAD(CALL(fmi3EnterConfigurationModeTYPE, EnterConfigurationMode)(u->component)) ||
         tell(u, u->structural, u->n_structural) ||
         BAD(CALL(fmi3ExitConfigurationModeTYPE, ExitConfigurationMode)(u->component));
}

bool unit_open(unit *u, const char *root, char *why, size_t size) {
  char *path = joined(root, u->library, 0);
  u->loaded = path ? library_open(path, u->said, UNIT_TEXT) : NULL;
  free(path);
  if (!u->loaded) return refuse(u, why, size, "its library cannot be loaded");
  if (look_up(u)) return refuse(u, why, size, "its library lacks functions of the standard");
  if (make(u, root)) return refuse(u, why, size, "cannot be instantiated");
  u->master->self = u;
  u->master->set = (void (*)(void))put_values;
  u->master->get = (void (*)(void))get_values;
  u->master->step = (void (*)(void))make_step;
  if (configure(u) || tell(u, u->parameters, u->n_parameters)) return refuse(u, why, size, "refuses a parameter");
  return 0;
}

bool unit_start(unit *u, double *values, char *why, size_t size) {
  master_unit *m = u->master;
  bool bad;
  if (u->fmi == 2)
    bad = BAD(CALL(fmi2SetupExperimentTYPE, SetupExperiment)(u->component, 0, 0, 0, 0, 0)) ||
          BAD(CALL(fmi2EnterInitializationModeTYPE, EnterInitializationMode)(u->component));
  else bad = BAD(CALL(fmi3EnterInitializationModeTYPE, EnterInitializationMode)(u->component, 0, 0, 0, 0, 0));
  for (int64_t k = 0; k < m->n_in; k++)
    if (m->source[k] >= 0) m->u[k] = values[m->source[k]];
  bad = bad || tell(u, u->inputs, u->n_inputs) || put_values(u, m->vr_in, (size_t)m->n_vr_in, m->u);
  if (!bad && u->fmi == 2) bad = BAD(CALL(fmi2ExitInitializationModeTYPE, ExitInitializationMode)(u->component));
  if (!bad && u->fmi == 3) bad = BAD(CALL(fmi3ExitInitializationModeTYPE, ExitInitializationMode)(u->component));
  bad = bad || get_values(u, m->vr_out, (size_t)m->n_vr_out, values + m->first);
  return bad ? refuse(u, why, size, "refuses the initialisation") : 0;
}

bool unit_end(unit *u) {
  u->said[0] = 0;
  if (u->fmi == 2) return BAD(CALL(fmi2TerminateTYPE, Terminate)(u->component));
  return BAD(CALL(fmi3TerminateTYPE, Terminate)(u->component));
}

void unit_close(unit *u) {
  if (u->loaded && u->component) {
    if (u->fmi == 2) CALL(fmi2FreeInstanceTYPE, FreeInstance)(u->component);
    else CALL(fmi3FreeInstanceTYPE, FreeInstance)(u->component);
  }
  if (u->loaded) library_close(u->loaded);
  free(u->callbacks);
  u->component = u->loaded = u->callbacks = NULL;
}
