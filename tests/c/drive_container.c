/* Runs a container under the sanitizers: random sequences of calls, of good and of damaged files.
 *   drive_container RESOURCES TOKEN SYSTEM_FILE OUTPUTS CALLS SEED
 * Exit 0: no crash, no leak, every status is one of the standard.  Prints how many instances and steps succeeded. */
#define _POSIX_C_SOURCE 200809L /* fmemopen */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/elementary/random.h"
#include "fmi/files/open_file.h"
#include "fmi2Functions.h"

enum { INSTANCES = 3, MOST = 1 << 20 };
static uint64_t seed, drawn;
static uint64_t draw(uint64_t n) { return hyst_random_bits(seed, drawn++) % n; }

static int environment; /* every message returns its address */
static void tell(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text, ...) {
  if (e != &environment || !name || s > fmi2Fatal || !strlen(category) || !strlen(text)) abort();
}

static char whole[MOST], text[MOST];
static size_t length;
static int damaged;

/* replaces fmi/files/open_file.c: every path opens the system file, or a damaged copy */
FILE *fmi_open_file(const char *path) {
  (void)path;
  size_t n = length;
  memcpy(text, whole, length);
  if (damaged) {
    if (draw(4) == 0) n = 1 + draw(length);
    for (uint64_t k = draw(4) + 1; k > 0; k--) {
      static const char SIGNS[] = " \n%-0123456789abcdefghiqxsBHIQ?";
      text[draw(n)] = draw(4) ? SIGNS[draw(sizeof SIGNS - 1)] : (char)draw(256);
    }
  }
  return fmemopen(text, n, "rb");
}

static struct {
  fmi2Component c;
  double t;
} box[INSTANCES];
static long made, stepped;

/* mostly: some calls find an instance that is not initialised */
static void start(int i) {
  if (!box[i].c || draw(8) == 0) return;
  if (fmi2SetupExperiment(box[i].c, 0, 0, 0, 0, 0) == fmi2OK && fmi2EnterInitializationMode(box[i].c) == fmi2OK)
    fmi2ExitInitializationMode(box[i].c);
}

static void open_box(int i, const char *location, const char *token) {
  const fmi2CallbackFunctions functions = {tell, NULL, NULL, NULL, &environment};
  damaged = draw(3) == 0;
  box[i].t = 0;
  box[i].c = fmi2Instantiate("a", draw(20) ? fmi2CoSimulation : fmi2ModelExchange, draw(9) ? token : "another",
                             draw(19) ? location : "file:///%", draw(9) ? &functions : NULL, 0, draw(2) == 0);
  made += box[i].c != NULL;
  start(i);
}

static void check(int status) {
  if (status < 0 || status > fmi2Fatal) abort();
}

static void step(int i, double t, double h) {
  const int status = (int)fmi2DoStep(box[i].c, t, h, (fmi2Boolean)draw(2));
  check(status);
  if (status == fmi2OK) fmi2GetRealStatus(box[i].c, fmi2LastSuccessfulTime, &box[i].t), stepped++;
}

static void one_call(uint32_t outputs, const char *location, const char *token) {
  const int i = (int)draw(INSTANCES);
  if (!box[i].c) open_box(i, location, token);
  fmi2Component c = box[i].c;
  fmi2ValueReference vr[4];
  fmi2Real real[4] = {NAN, 1e300, -1, 0};
  fmi2Integer whole_number[4] = {INT32_MAX, INT32_MIN, -1, 7};
  fmi2Boolean truth[4] = {0, 1, 7, -1};
  fmi2String string[4] = {"", "a", "b", "c"};
  fmi2FMUstate state = NULL;
  fmi2Byte bytes[8] = {0};
  size_t size = 0, n = draw(5);
  for (int k = 0; k < 4; k++) vr[k] = (uint32_t)draw(outputs + 2);
  switch (draw(40)) {
    case 0: check(fmi2SetupExperiment(c, 0, 0, draw(4) ? 0 : 1, draw(4) == 0, 1)); break;
    case 1: check(fmi2EnterInitializationMode(c)); break;
    case 2: check(fmi2ExitInitializationMode(c)); break;
    case 3: check(draw(20) ? 0 : fmi2Terminate(c)); break;
    case 4:
      if (draw(8)) break;
      damaged = draw(3) == 0, box[i].t = 0;
      check(fmi2Reset(c));
      start(i);
      break;
    case 5:
      if (draw(8)) break;
      fmi2FreeInstance(c);
      box[i].c = NULL;
      break;
    case 6: check(fmi2SetReal(c, vr, n, real)); break;
    case 7: check(fmi2SetInteger(c, vr, n, whole_number)); break;
    case 8: check(fmi2SetBoolean(c, vr, n, truth)); break;
    case 9: check(fmi2SetString(c, vr, n, string)); break;
    case 10: check(fmi2GetString(c, vr, n, string)); break;
    case 11: check(fmi2GetFMUstate(c, &state)); break;
    case 12: check(fmi2SetFMUstate(c, state)); break;
    case 13: check(fmi2FreeFMUstate(c, &state)); break;
    case 14: check(fmi2SerializedFMUstateSize(c, state, &size) | fmi2SerializeFMUstate(c, state, bytes, size)); break;
    case 15: check(fmi2DeSerializeFMUstate(c, bytes, sizeof bytes, &state)); break;
    case 16: check(fmi2GetDirectionalDerivative(c, vr, n, vr, n, real, real)); break;
    case 17: check(fmi2SetDebugLogging(c, draw(2) == 0, 0, NULL)); break;
    case 18: check(fmi2GetBooleanStatus(c, fmi2Terminated, truth)); break;
    case 19: check(fmi2CancelStep(c)); break;
    case 20: step(i, draw(2) ? box[i].t : real[draw(4)], draw(2) ? 1e-3 : real[draw(4)]); break;
    case 21: step(i, box[i].t, 3e-3); break;
    case 22:
    case 23:
    case 24: check(fmi2GetInteger(c, vr, n, whole_number)); break;
    case 25:
    case 26:
    case 27: check(fmi2GetBoolean(c, vr, n, truth)); break;
    case 28:
    case 29:
    case 30: check(fmi2GetReal(c, vr, n, real)); break;
    default: step(i, box[i].t, 1e-3);
  }
}

int main(int argc, char **argv) {
  if (argc != 7) return 2;
  FILE *file = fopen(argv[3], "rb");
  if (!file) return 2;
  length = fread(whole, 1, MOST, file);
  fclose(file);
  if (length == 0 || length == MOST) return 2;
  const uint32_t outputs = (uint32_t)strtoul(argv[4], NULL, 10);
  const long calls = strtol(argv[5], NULL, 10);
  seed = strtoul(argv[6], NULL, 10);
  for (long k = 0; k < calls; k++) one_call(outputs, argv[1], argv[2]);
  for (int i = 0; i < INSTANCES; i++) fmi2FreeInstance(box[i].c);
  printf("%ld instances, %ld steps\n", made, stepped);
  return 0;
}
