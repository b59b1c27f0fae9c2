/* The foreign FMU of bad_fmu.py: what a test adds stands in the place of EXTRA. */
#include <stdlib.h>
#include <unistd.h>

#include "fmi2FunctionTypes.h"
#include "fmi2TypesPlatform.h"
static double u, y;
static fmi2Status got = fmi2OK; /* what reading returns */
/* EXTRA */
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Component fmi2Instantiate(fmi2String a, fmi2Type b, fmi2String c, fmi2String d, const fmi2CallbackFunctions *e,
                              fmi2Boolean f, fmi2Boolean g) {
  (void)a, (void)b, (void)c, (void)d, (void)e, (void)f, (void)g;
  return &u;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Real x[]) {
  (void)c, (void)v;
  if (n) u = x[0];
  return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2Real x[]) {
  (void)c;
  if (n) x[0] = v[0] ? y : u;
  return got;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean b) {
  (void)c, (void)h, (void)b;
  if (t > 0.004 && u > LIMIT) DEFECT;
  y = u;
  return fmi2OK;
}
#ifndef FREE
#define FREE
#endif
void fmi2FreeInstance(fmi2Component c) {
  (void)c;
  FREE
}
