/* Runs the FMI layer under the sanitizers with random calls from a seed.
 *   drive_fmi RESOURCES TOKEN REFERENCES CALLS SEED
 * Exit 0: no crash, no leak, every status is one of the standard. */
#include "core/elementary/random.h"
#include "random_calls.h"

static uint64_t seed, drawn;
static uint64_t draw(uint64_t n) { return hyst_random_bits(seed, drawn++) % n; }

int main(int argc, char **argv) {
  if (argc != 6) return 2;
  const uint32_t references = (uint32_t)strtoul(argv[3], NULL, 10);
  const long calls = strtol(argv[4], NULL, 10);
  seed = strtoul(argv[5], NULL, 10);
  for (long k = 0; k < calls; k++) one_call(references, argv[1], argv[2]);
  close_units();
  return 0;
}
