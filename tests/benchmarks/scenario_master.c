/* scenario_master.c - P2 in plain C, and a container FMU 2.0 stepped from C, as references for the native engine.
 *
 * Two units, each a function with its state behind a pointer: a first-order plant y(t+h) = a y + (1 - a) u, and a P
 * controller u = K (r - y), Gauss-Seidel in this order. */
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"

typedef struct {
  double a, u, y;
} plant;
typedef struct {
  double k, r, y, u;
} controller;

static void plant_step(void *unit) {
  plant *p = unit;
  p->y = p->a * p->y + (1 - p->a) * p->u;
}
static void controller_step(void *unit) {
  controller *c = unit;
  c->u = c->k * c->r - c->k * c->y;
}
/* volatile pointers: a master knows its units at run time only */
static void (*volatile steps[])(void *) = {plant_step, controller_step};

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* makes n steps, writes n + 1 values of the plant to y, returns seconds */
double bare(int n, double a, double k, double *y) {
  plant p = {a, 0, 0};
  controller c = {k, 1, 0, 0};
  void (*const step_plant)(void *) = steps[0], (*const step_controller)(void *) = steps[1];
  step_controller(&c);
  const double begin = now();
  y[0] = p.y;
  for (int i = 1; i <= n; i++) {
    p.u = c.u;
    step_plant(&p);
    c.y = p.y;
    step_controller(&c);
    y[i] = p.y;
  }
  return now() - begin;
}

/* ignores the log of the container, which reports progress as errors; failures show in the status */
static void say(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category, fmi2String text,
                ...) {
  (void)e, (void)name, (void)status, (void)category, (void)text;
}
static const fmi2CallbackFunctions CALLBACKS = {say, calloc, free, NULL, NULL};

/* makes n steps of h of a container with one output; returns seconds, or a negative value on failure */
double container(const char *library, const char *guid, const char *resources, unsigned reference, int n, double h,
                 double *y) {
  void *l = dlopen(library, RTLD_NOW);
  if (!l) return fprintf(stderr, "%s\n", dlerror()), -1;
  fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)dlsym(l, "fmi2Instantiate");
  fmi2DoStepTYPE *step = (fmi2DoStepTYPE *)dlsym(l, "fmi2DoStep");
  fmi2GetRealTYPE *get = (fmi2GetRealTYPE *)dlsym(l, "fmi2GetReal");
  const fmi2Component c = instantiate("loop", fmi2CoSimulation, guid, resources, &CALLBACKS, fmi2False, fmi2False);
  if (!c) return -1;
  ((fmi2SetupExperimentTYPE *)dlsym(l, "fmi2SetupExperiment"))(c, fmi2False, 0, 0, fmi2False, 0);
  ((fmi2EnterInitializationModeTYPE *)dlsym(l, "fmi2EnterInitializationMode"))(c);
  ((fmi2ExitInitializationModeTYPE *)dlsym(l, "fmi2ExitInitializationMode"))(c);
  get(c, &reference, 1, y);
  const double begin = now();
  for (int i = 0; i < n; i++)
    if (step(c, i * h, h, fmi2True) != fmi2OK || get(c, &reference, 1, y + i + 1) != fmi2OK) return -1;
  const double seconds = now() - begin;
  ((fmi2FreeInstanceTYPE *)dlsym(l, "fmi2FreeInstance"))(c);
  dlclose(l);
  return seconds;
}
