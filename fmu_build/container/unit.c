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

static int refuse(const unit *u, char *why, size_t size, const char *what) {
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
  snprintf(full, sizeof full, "fmi%d%s", u->master->kind == MASTER_FMI2 ? 2 : 3, name);
  return library_function(u->loaded, full);
}

#define CALL(TYPE, name) ((TYPE *)function(u, #name))

static int make(unit *u, const char *root) {
  const int two = u->master->kind == MASTER_FMI2;
  char *place = joined(root, u->resources, two);
  if (!place) return 1;
  if (two) {
    const fmi2CallbackFunctions given = {log_fmi2, calloc, free, NULL, u};
    fmi2CallbackFunctions *callbacks = malloc(sizeof *callbacks);
    if (callbacks) {
      memcpy(callbacks, &given, sizeof given); /* its members are constants */
      u->callbacks = callbacks;
      u->master->self =
          CALL(fmi2InstantiateTYPE, Instantiate)(u->name, fmi2CoSimulation, u->token, place, callbacks, 0, 0);
    }
  } else {
    u->master->self = CALL(fmi3InstantiateCoSimulationTYPE, InstantiateCoSimulation)(u->name, u->token, place, 0, 0, 0,
                                                                                     0, NULL, 0, u, log_fmi3, NULL);
  }
  free(place);
  return !u->master->self;
}

static int tell2(const unit *u, const told *v) {
  void *c = u->master->self;
  const uint32_t *r = &v->reference;
  const double x = v->n ? v->values[0] : 0;
  const fmi2Integer whole = (fmi2Integer)x;
  const fmi2String text = v->text;
  switch (v->type) {
    case 'r': return BAD(CALL(fmi2SetRealTYPE, SetReal)(c, r, 1, &x));
    case 'i': return BAD(CALL(fmi2SetIntegerTYPE, SetInteger)(c, r, 1, &whole));
    case 'b': return BAD(CALL(fmi2SetBooleanTYPE, SetBoolean)(c, r, 1, &whole));
    default: return BAD(CALL(fmi2SetStringTYPE, SetString)(c, r, 1, &text));
  }
}

static int tell3(const unit *u, const told *v) {
  void *c = u->master->self;
  const uint32_t *r = &v->reference;
  const double x = v->n ? v->values[0] : 0;
  const fmi3Int32 i32 = (fmi3Int32)x;
  const fmi3Int64 i64 = (fmi3Int64)x;
  const fmi3Boolean yes = x != 0;
  const fmi3String text = v->text;
  switch (v->type) {
    case 'r': return BAD(CALL(fmi3SetFloat64TYPE, SetFloat64)(c, r, 1, v->values, (size_t)v->n));
    case 'i': return BAD(CALL(fmi3SetInt32TYPE, SetInt32)(c, r, 1, &i32, 1));
    case 'l': return BAD(CALL(fmi3SetInt64TYPE, SetInt64)(c, r, 1, &i64, 1));
    case 'b': return BAD(CALL(fmi3SetBooleanTYPE, SetBoolean)(c, r, 1, &yes, 1));
    default: return BAD(CALL(fmi3SetStringTYPE, SetString)(c, r, 1, &text, 1));
  }
}

static int tell(const unit *u, const told *v) { return u->master->kind == MASTER_FMI2 ? tell2(u, v) : tell3(u, v); }

int unit_open(unit *u, const char *root, char *why, size_t size) {
  static const char *const NEEDED[] = {"EnterInitializationMode", "ExitInitializationMode", "DoStep", "Terminate",
                                       "FreeInstance"};
  const int two = u->master->kind == MASTER_FMI2;
  char *path = joined(root, u->library, 0);
  u->loaded = path ? library_open(path, u->said, UNIT_TEXT) : NULL;
  free(path);
  if (!u->loaded) return refuse(u, why, size, "its library cannot be loaded");
  u->said[0] = 0;
  for (size_t k = 0; k < sizeof NEEDED / sizeof *NEEDED; k++)
    if (!function(u, NEEDED[k])) return refuse(u, why, size, "its library lacks functions of the standard");
  u->master->set = function(u, two ? "SetReal" : "SetFloat64");
  u->master->get = function(u, two ? "GetReal" : "GetFloat64");
  u->master->step = function(u, "DoStep");
  if (!u->master->set || !u->master->get || !function(u, two ? "Instantiate" : "InstantiateCoSimulation") ||
      (two && !function(u, "SetupExperiment")))
    return refuse(u, why, size, "its library lacks functions of the standard");
  if (make(u, root)) return refuse(u, why, size, "cannot be instantiated");
  for (int64_t k = 0; k < u->n_parameters; k++)
    if (tell(u, u->parameters + k)) return refuse(u, why, size, "refuses a parameter");
  return 0;
}

int unit_start(unit *u, double *values, char *why, size_t size) {
  master_unit *m = u->master;
  const int two = m->kind == MASTER_FMI2;
  int bad;
  if (two)
    bad = BAD(CALL(fmi2SetupExperimentTYPE, SetupExperiment)(m->self, 0, 0, 0, 0, 0)) ||
          BAD(CALL(fmi2EnterInitializationModeTYPE, EnterInitializationMode)(m->self));
  else bad = BAD(CALL(fmi3EnterInitializationModeTYPE, EnterInitializationMode)(m->self, 0, 0, 0, 0, 0));
  for (int64_t k = 0; !bad && k < u->n_inputs; k++) bad = tell(u, u->inputs + k);
  for (int64_t k = 0; k < m->n_in; k++)
    if (m->source[k] >= 0) m->u[k] = values[m->source[k]];
  const size_t n_in = (size_t)m->n_in, n_out = (size_t)m->n_out, n_put = (size_t)m->n_vr_in,
               n_get = (size_t)m->n_vr_out;
  if (!bad && n_in)
    bad = two ? BAD(((fmi2SetRealTYPE *)m->set)(m->self, m->vr_in, n_put, m->u))
              : BAD(((fmi3SetFloat64TYPE *)m->set)(m->self, m->vr_in, n_put, m->u, n_in));
  if (!bad)
    bad = two ? BAD(CALL(fmi2ExitInitializationModeTYPE, ExitInitializationMode)(m->self))
              : BAD(CALL(fmi3ExitInitializationModeTYPE, ExitInitializationMode)(m->self));
  double *y = values + m->first;
  if (!bad && n_out)
    bad = two ? BAD(((fmi2GetRealTYPE *)m->get)(m->self, m->vr_out, n_get, y))
              : BAD(((fmi3GetFloat64TYPE *)m->get)(m->self, m->vr_out, n_get, y, n_out));
  return bad ? refuse(u, why, size, "refuses the initialisation") : 0;
}

void unit_close(unit *u) {
  if (u->loaded && u->master->self) {
    if (u->master->kind == MASTER_FMI2) CALL(fmi2FreeInstanceTYPE, FreeInstance)(u->master->self);
    else CALL(fmi3FreeInstanceTYPE, FreeInstance)(u->master->self);
  }
  if (u->loaded) library_close(u->loaded);
  free(u->callbacks);
  u->master->self = u->loaded = u->callbacks = NULL;
}
