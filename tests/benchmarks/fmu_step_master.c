/* fmu_step_master.c - times setReal(2) + doStep + getReal of FMI 2.0 FMUs against the bare function, in turns.
 *   main STEPS REPEATS {LIBRARY GUID RESOURCES u_1 u_2 y}...
 * Prints, for the bare function and each FMU, the least time of a step (ns) and the largest difference of y. */
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"
#include "fmu_step_net.h"

typedef struct {
  fmi2Component c;
  fmi2SetRealTYPE *set;
  fmi2DoStepTYPE *step;
  fmi2GetRealTYPE *get;
  fmi2ValueReference u[2], y;
  double t;
} fmu;

static void say(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category, fmi2String text,
                ...) {
  (void)e, (void)name, (void)category;
  if (status > fmi2Warning) fprintf(stderr, "%s\n", text);
}
static const fmi2CallbackFunctions CALLBACKS = {say, calloc, free, NULL, NULL};

static void *find(void *library, const char *name) {
  void *f = library ? dlsym(library, name) : NULL;
  if (!f) fprintf(stderr, "%s\n", dlerror()), exit(2);
  return f;
}

static fmu load(char **a) {
  void *l = dlopen(a[0], RTLD_NOW | RTLD_GLOBAL); /* an embedded Python interpreter needs global symbols */
  fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)find(l, "fmi2Instantiate");
  fmu f = {instantiate("unit", fmi2CoSimulation, a[1], a[2], &CALLBACKS, fmi2False, fmi2False),
           (fmi2SetRealTYPE *)find(l, "fmi2SetReal"),
           (fmi2DoStepTYPE *)find(l, "fmi2DoStep"),
           (fmi2GetRealTYPE *)find(l, "fmi2GetReal"),
           {(fmi2ValueReference)atoi(a[3]), (fmi2ValueReference)atoi(a[4])},
           (fmi2ValueReference)atoi(a[5]),
           0};
  if (!f.c) fprintf(stderr, "fmi2Instantiate failed\n"), exit(2);
  ((fmi2SetupExperimentTYPE *)find(l, "fmi2SetupExperiment"))(f.c, fmi2False, 0, 0, fmi2False, 0);
  ((fmi2EnterInitializationModeTYPE *)find(l, "fmi2EnterInitializationMode"))(f.c);
  ((fmi2ExitInitializationModeTYPE *)find(l, "fmi2ExitInitializationMode"))(f.c);
  return f;
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

/* a volatile pointer to the function prevents that the compiler computes results in advance */
static double (*volatile bare)(const double *) = net;

static void run(fmu *f, int n, const double *u, double *y) {
  const double h = 1e-3;
  double (*const function)(const double *) = bare;
  for (int i = 0; i < n; i++, u += 2) {
    if (f) {
      f->set(f->c, f->u, 2, u);
      if (f->step(f->c, f->t, h, fmi2True) != fmi2OK) exit(3);
      f->t += h;
      f->get(f->c, &f->y, 1, y + i);
    } else {
      y[i] = function(u);
    }
  }
}

int main(int argc, char **argv) {
  enum { MOST = 16 };
  const int n = atoi(argv[1]), repeats = atoi(argv[2]), n_fmus = (argc - 3) / 6;
  static fmu f[MOST];
  double least[MOST + 1], error[MOST + 1];
  double *u = malloc(2 * sizeof(double) * (size_t)n), *y = malloc(sizeof(double) * (size_t)n);
  double *expected = malloc(sizeof(double) * (size_t)n);
  uint32_t random = 1;
  if (!u || !y || !expected || n_fmus > MOST) return 1;
  for (int i = 0; i < 2 * n; i++) u[i] = (double)(random = random * 1664525u + 1013904223u) / 2147483648.0 - 1;
  for (int k = 0; k < n_fmus; k++) f[k] = load(argv + 3 + 6 * k);
  run(NULL, n, u, expected);
  for (int r = 0; r < repeats; r++)
    for (int k = 0; k <= n_fmus; k++) {
      const double begin = now();
      run(k ? f + k - 1 : NULL, n, u, y);
      const double ns = (now() - begin) / n;
      if (r == 0 || ns < least[k]) least[k] = ns;
      if (r == 0) error[k] = 0;
      for (int i = 0; i < n; i++)
        if (!(fabs(y[i] - expected[i]) <= error[k])) error[k] = fabs(y[i] - expected[i]);
    }
  for (int k = 0; k <= n_fmus; k++) printf("%.2f %.3g\n", least[k], error[k]);
  return 0;
}
