/* random_calls.h - random sequences of FMI calls, good and bad, on several instances at once.
 * The including file defines draw(n), a random number below n.  Aborts on a status outside the standard or an
 * incomplete message; the sanitizers detect memory errors. */
#ifndef RANDOM_CALLS_H
#define RANDOM_CALLS_H
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/elementary/crc.h"
#include "fmi2Functions.h"
#include "fmi3Functions.h"

static uint64_t draw(uint64_t n);
static int environment; /* every message returns its address */

static void tell2(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text,
                  ...) {
  if (e != &environment || !name || s > fmi2Fatal || !strlen(category) || !strlen(text)) abort();
}
static void tell3(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String text) {
  if (e != &environment || s > fmi3Fatal || !strlen(category) || !strlen(text)) abort();
}

enum { INSTANCES = 3, STATES = 4 };
enum { more = 7 }; /* value references behind those of the graph: time, states, derivatives, none */
static struct {
  void *c, *state[STATES];
  double t;
  int open;
} unit[2][INSTANCES];

static double value(void) {
  static const double odd[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, 5e-324, 1e18, -1};
  return draw(8) ? (double)draw(2000) / 1000 - 1 : odd[draw(sizeof odd / sizeof *odd)];
}

/* a pointer to a state: usually valid, sometimes freed, of another instance, or invalid */
static void **any_state(int v, int i) {
  static void *nonsense;
  if (draw(8) == 0) return unit[v][draw(INSTANCES)].state + draw(STATES);
  nonsense = (void *)(uintptr_t)draw(100);
  return draw(20) ? unit[v][i].state + draw(STATES) : &nonsense;
}

static void check(int status) {
  if (status < 0 || status > fmi2Fatal) abort();
}

/* a new instance: usually valid, sometimes refused and then NULL */
static void open_unit(int v, int i, const char *location, const char *token) {
  const fmi2CallbackFunctions functions = {tell2, NULL, NULL, NULL, &environment};
  memset(unit[v] + i, 0, sizeof unit[v][i]);
  if (v == 0)
    unit[v][i].c = fmi2Instantiate(draw(19) ? "a" : "", draw(2) ? fmi2CoSimulation : fmi2ModelExchange, token,
                                   draw(19) ? location : "file:///%", &functions, 0, draw(4) == 0);
  else if (draw(2))
    unit[v][i].c = fmi3InstantiateModelExchange("a", token, location, 0, 0, &environment, draw(3) ? tell3 : NULL);
  else
    unit[v][i].c = fmi3InstantiateCoSimulation("a", draw(19) ? token : NULL, draw(19) ? location : NULL, 0, 0,
                                               draw(2) == 0, 0, NULL, 0, &environment, draw(3) ? tell3 : NULL, NULL);
  unit[v][i].open = 1;
}

static unsigned char bytes[1 << 20];

/* Damage a saved state: refused by its checksum, or, with a valid one, read as an untrusted state. */
static void damage(size_t size) {
  enum { CHECKSUM = 12, COVERED = 16 };
  for (uint64_t k = draw(4); k > 0; k--) bytes[draw(size)] ^= (unsigned char)(1 << draw(8));
  if (size <= COVERED || draw(2)) return;
  const uint32_t checksum = hyst_crc32(bytes + COVERED, size - COVERED);
  for (int k = 0; k < 4; k++) bytes[CHECKSUM + k] = (unsigned char)(checksum >> 8 * k);
}

static void call2(int i, uint32_t references, const char *location, const char *token) {
  void *c = unit[0][i].c, **state = any_state(0, i), *copy = *state;
  fmi2ValueReference vr[4];
  fmi2Real real[4];
  fmi2Integer integer[4];
  fmi2EventInfo info;
  size_t size = 0;
  const size_t n = draw(4) + 1;
  for (int k = 0; k < 4; k++)
    vr[k] = (uint32_t)draw(references + more), real[k] = value(), integer[k] = (int)draw(5) - 1;
  switch (draw(31)) {
    case 30: check(fmi2GetDirectionalDerivative(c, vr, n, vr + 4 - n, n, real, real)); break;
    case 21: check(fmi2EnterEventMode(c)); break;
    case 22: check(fmi2NewDiscreteStates(c, &info)); break;
    case 23: check(fmi2EnterContinuousTimeMode(c)); break;
    case 24: check(fmi2CompletedIntegratorStep(c, 1, integer, integer + 1)); break;
    case 25: check(fmi2SetTime(c, draw(9) ? unit[0][i].t += draw(3) * 5e-4 : value())); break;
    case 26: check(fmi2SetContinuousStates(c, real, draw(4))); break;
    case 27: check(fmi2GetDerivatives(c, real, draw(4))); break;
    case 28: check(fmi2GetContinuousStates(c, real, draw(4))); break;
    case 29:
      check(fmi2GetNominalsOfContinuousStates(c, real, draw(4)) | fmi2GetEventIndicators(c, real, draw(2)));
      break;
    case 0: check(fmi2SetupExperiment(c, 0, 0, value(), draw(4) == 0, value())); break;
    case 1: check(fmi2EnterInitializationMode(c)); break;
    case 2: check(fmi2ExitInitializationMode(c)); break;
    case 3: check(draw(10) ? 0 : fmi2Terminate(c)); break;
    case 4: check(draw(10) ? 0 : fmi2Reset(c)); break;
    case 5:
    case 6: check(fmi2SetReal(c, vr, n, real)); break;
    case 7: check(fmi2SetInteger(c, vr, n, integer)); break;
    case 8: check(fmi2SetBoolean(c, vr, n, integer)); break;
    case 9: check(fmi2GetReal(c, vr, n, real)); break;
    case 10: check(fmi2GetInteger(c, vr, n, integer)); break;
    case 11: {
      if (state >= unit[0][i].state && state < unit[0][i].state + STATES) check(fmi2GetFMUstate(c, state));
      break;
    }
    case 12: check(fmi2SetFMUstate(c, copy)); break;
    case 13: check(fmi2FreeFMUstate(c, draw(2) ? &copy : state)); break;
    case 14:
      if (fmi2SerializedFMUstateSize(c, copy, &size) != fmi2OK || size > sizeof bytes) break;
      size -= draw(3) == 0;
      check(fmi2SerializeFMUstate(c, copy, (fmi2Byte *)bytes, size));
      damage(size);
      copy = NULL;
      check(fmi2DeSerializeFMUstate(c, (const fmi2Byte *)bytes, size - (draw(4) == 0), &copy));
      if (copy) check(fmi2SetFMUstate(c, copy)), check(fmi2FreeFMUstate(c, &copy));
      break;
    case 15:
      if (draw(20)) break;
      fmi2FreeInstance(c);
      open_unit(0, i, location, token);
      break;
    case 16: check(fmi2SetDebugLogging(c, draw(2) == 0, 0, NULL)); break;
    case 17: check(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &unit[0][i].t)); break;
    case 18:
      fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &unit[0][i].t);
      check(fmi2DoStep(c, draw(5) ? unit[0][i].t : value(), draw(5) ? 1e-3 : value(), 0));
      break;
    default: {
      const double h = draw(9) ? 1e-3 : 2e-3;
      if (fmi2DoStep(c, unit[0][i].t, h, 0) == fmi2OK) unit[0][i].t += h;
    }
  }
}

static void call3(int i, uint32_t references, const char *location, const char *token) {
  void *c = unit[1][i].c, **state = any_state(1, i), *copy = *state;
  fmi3ValueReference vr[2] = {(uint32_t)draw(references + more), (uint32_t)draw(references + more)};
  static fmi3Float64 real[64];
  fmi3Int64 integer[4] = {(int64_t)draw(5) - 1, -1, INT64_MAX, INT64_MIN};
  fmi3Boolean flag[4] = {0};
  size_t size = 0;
  const size_t n = draw(2) + 1;
  for (int k = 0; k < 64; k++) real[k] = value();
  switch (draw(29)) {
    case 27: check(fmi3GetDirectionalDerivative(c, vr, n, vr, 2, real, draw(4), real + 32, draw(12))); break;
    case 28: check(fmi3GetAdjointDerivative(c, vr, n, vr, 2, real, draw(4), real + 32, draw(12))); break;
    case 16: check(fmi3EnterEventMode(c)); break;
    case 17: check(fmi3UpdateDiscreteStates(c, flag, flag, flag, flag, flag, real)); break;
    case 18: check(fmi3EnterContinuousTimeMode(c)); break;
    case 19: check(fmi3CompletedIntegratorStep(c, 1, flag, flag + 1)); break;
    case 20: check(fmi3SetTime(c, draw(9) ? unit[1][i].t += draw(3) * 5e-4 : value())); break;
    case 21: check(fmi3SetContinuousStates(c, real, draw(4))); break;
    case 22: check(fmi3GetContinuousStateDerivatives(c, real, draw(4))); break;
    case 23: check(fmi3GetContinuousStates(c, real, draw(4))); break;
    case 24:
      check(fmi3GetNominalsOfContinuousStates(c, real, draw(4)) | fmi3GetEventIndicators(c, real, draw(2)));
      break;
    case 25: check(fmi3GetNumberOfContinuousStates(c, &size)); break;
    case 26: check(fmi3EnterStepMode(c)); break;
    case 0: check(fmi3EnterInitializationMode(c, 0, 0, value(), draw(4) == 0, value())); break;
    case 1: check(fmi3ExitInitializationMode(c)); break;
    case 2: check(draw(10) ? 0 : fmi3Terminate(c)); break;
    case 3: check(draw(10) ? 0 : fmi3Reset(c)); break;
    case 4:
    case 5: check(fmi3SetFloat64(c, vr, n, real, draw(3) ? n : draw(64))); break;
    case 6: check(fmi3SetInt64(c, vr, n, integer, draw(4))); break;
    case 7: check(fmi3SetBoolean(c, vr, n, flag, draw(4))); break;
    case 8: check(fmi3GetFloat64(c, vr, n, real, draw(3) ? n : draw(64))); break;
    case 9: check(fmi3GetInt64(c, vr, n, integer, draw(4))); break;
    case 10:
      if (state >= unit[1][i].state && state < unit[1][i].state + STATES) check(fmi3GetFMUState(c, state));
      break;
    case 11: check(fmi3SetFMUState(c, copy)); break;
    case 12: check(fmi3FreeFMUState(c, draw(2) ? &copy : state)); break;
    case 13:
      if (fmi3SerializedFMUStateSize(c, copy, &size) != fmi3OK || size > sizeof bytes) break;
      check(fmi3SerializeFMUState(c, copy, bytes, size));
      damage(size);
      copy = NULL;
      check(fmi3DeserializeFMUState(c, bytes, size, &copy));
      if (copy) check(fmi3SetFMUState(c, copy)), check(fmi3FreeFMUState(c, &copy));
      break;
    case 14:
      if (draw(20)) break;
      fmi3FreeInstance(c);
      open_unit(1, i, location, token);
      break;
    default: check(fmi3DoStep(c, unit[1][i].t, draw(9) ? 1e-3 : value(), 0, flag, flag + 1, flag + 2, &unit[1][i].t));
  }
}

static void one_call(uint32_t references, const char *location, const char *token) {
  const int i = (int)draw(INSTANCES), v = (int)draw(2);
  if (!unit[v][i].open) open_unit(v, i, location, token); /* on first use: most sequences use few */
  if (v) call3(i, references, location, token);
  else call2(i, references, location, token);
}

static void close_units(void) {
  for (int i = 0; i < INSTANCES; i++) fmi2FreeInstance(unit[0][i].c), fmi3FreeInstance(unit[1][i].c);
  memset(unit, 0, sizeof unit);
}
#endif
