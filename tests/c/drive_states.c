/* Restores forged saved states under the sanitizers: bytes with a valid checksum that no unit has written.
 *   drive_states RESOURCES TOKEN REFERENCES ROUNDS SEED
 * Exit 0: each was refused, or the unit continued without an out-of-bounds access, hang or leak. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/elementary/crc.h"
#include "core/elementary/random.h"
#include "fmi3Functions.h"

static uint64_t seed, drawn;
static uint64_t draw(uint64_t n) { return hyst_random_bits(seed, drawn++) % n; }

/* layout of fmu_build/fmi/state.c: magic, version, checksum, length, token; then 6 int32 and numbers */
enum { CHECKSUM = 12, COVERED = 16, FIRST = 64, NUMBERS = FIRST + 6 * 4, WORD = 8 };

static double hostile(void) {
  static const double odd[] = {NAN, INFINITY, -INFINITY, -1, 0.5, 1e300, -1e300, 5e-324, 2147483648.0, 1e9, -0.0};
  if (draw(2)) return (double)draw(20);
  return draw(2) ? odd[draw(sizeof odd / sizeof *odd)] : hyst_random_normal(seed, drawn++) * 10;
}

static void forge(unsigned char *bytes, size_t size) {
  const size_t words = (size - NUMBERS) / WORD;
  const size_t most = draw(3) ? 4 : words;
  for (size_t k = 0; k < most; k++) {
    const double v = hostile();
    memcpy(bytes + NUMBERS + WORD * draw(words), &v, WORD);
  }
  if (draw(4) == 0) bytes[FIRST + draw(24)] ^= (unsigned char)(1u << draw(8));
  const uint32_t sum = hyst_crc32(bytes + COVERED, size - COVERED);
  memcpy(bytes + CHECKSUM, &sum, sizeof sum);
}

static void move_inputs(void *c, uint32_t references) {
  for (uint32_t r = 0; r < references; r++) {
    const double v = (double)draw(4000) / 1000 - 2;
    fmi3SetFloat64(c, &r, 1, &v, 1); /* refused unless it is a scalar input */
  }
}

enum { STATES = 64 };
static double t; /* time of the state; a forged state may differ */

static void go_on(void *c, int kind, uint32_t references) {
  double x[STATES], seeds[1] = {1}, slopes[1];
  fmi3Boolean flag[5];
  const uint32_t known = (uint32_t)draw(references), unknown = (uint32_t)draw(references);
  size_t n = 0;
  for (int k = 0; k < 4; k++, t += 1e-3) {
    move_inputs(c, references);
    fmi3GetDirectionalDerivative(c, &unknown, 1, &known, 1, seeds, 1, slopes, 1);
    if (kind == 2) {
      fmi3SetTime(c, t + 1e-3);
      fmi3GetNumberOfContinuousStates(c, &n);
      if (n <= STATES) fmi3GetContinuousStateDerivatives(c, x, n), fmi3GetContinuousStates(c, x, n);
      fmi3CompletedIntegratorStep(c, 1, flag, flag + 1);
    } else {
      fmi3DoStep(c, t, 1e-3, 1, flag, flag + 1, flag + 2, x);
    }
    if (kind > 0) {
      fmi3EnterEventMode(c);
      fmi3UpdateDiscreteStates(c, flag, flag + 1, flag + 2, flag + 3, flag + 4, x);
      kind == 2 ? fmi3EnterContinuousTimeMode(c) : fmi3EnterStepMode(c);
    }
  }
}

static void *begin(int kind, const char *resources, const char *token) {
  void *c = kind == 2
                ? fmi3InstantiateModelExchange("a", token, resources, 0, 0, NULL, NULL)
                : fmi3InstantiateCoSimulation("a", token, resources, 0, 0, kind == 1, 0, NULL, 0, NULL, NULL, NULL);
  if (!c || fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0) || fmi3ExitInitializationMode(c)) exit(3);
  if (kind == 1) fmi3EnterStepMode(c);
  if (kind == 2) fmi3EnterContinuousTimeMode(c);
  return c;
}

static int taken;
static void drive(int kind, uint32_t references, long rounds, const char *resources, const char *token) {
  void *c = begin(kind, resources, token), *good = NULL, *forged = NULL;
  size_t size = 0;
  t = 0;
  for (int k = 0; k < 10; k++) go_on(c, kind, references);
  const double saved_at = t;
  if (fmi3GetFMUState(c, &good) || fmi3SerializedFMUStateSize(c, good, &size)) exit(4);
  unsigned char *bytes = malloc(size), *copy = malloc(size);
  if (!bytes || !copy || fmi3SerializeFMUState(c, good, bytes, size)) exit(5);
  for (long k = 0; k < rounds; k++) {
    memcpy(copy, bytes, size);
    forge(copy, size);
    if (fmi3DeserializeFMUState(c, copy, size, &forged) == fmi3OK) {
      t = saved_at;
      taken++;
      if (fmi3SetFMUState(c, forged)) exit(6);
      go_on(c, kind, references);
      if (fmi3FreeFMUState(c, &forged)) exit(7);
    }
    if (forged) exit(8);
    if (fmi3SetFMUState(c, good)) exit(9);
  }
  free(bytes);
  free(copy);
  fmi3FreeInstance(c);
}

int main(int argc, char **argv) {
  if (argc != 6) return 2;
  const uint32_t references = (uint32_t)strtoul(argv[3], NULL, 10);
  seed = strtoul(argv[5], NULL, 10);
  for (int kind = 0; kind < 3; kind++) drive(kind, references, strtol(argv[4], NULL, 10), argv[1], argv[2]);
  return taken ? 0 : 10;
}
