/* Checks that an FMU has no side effects on its process.
 *   process steps|instances|reload|endurance|neighbours|environment BINARY MODELS [BINARY OF THE NEIGHBOUR] */
#include <fenv.h>
#include <locale.h>
#include <malloc.h>
#include <stdint.h>

#include "binary.h"

enum { MOST = 200 };
static model models[MOST];
static int n_models;

/* times as importers compute them, t = start + i h and t += h, in long runs */
static void steps(const binary *b) {
  static const double sizes[] = {1e-3, 1.0 / 60, 1.0 / 44100, 0.1}, starts[] = {0, 1e6};
  const long n = getenv("STEPS") ? strtol(getenv("STEPS"), NULL, 10) : 10000;
  for (int k = 0; k < 16; k++) {
    const double h = sizes[k % 4], from = starts[k / 4 % 2];
    const int summed = k / 8;
    void *c = b->fmi2Instantiate("a", fmi2CoSimulation, models->token, models->location, &CALLBACKS, 0, 0);
    DEMAND(c && !b->fmi2SetupExperiment(c, 0, 0, from, 0, 0) && !b->fmi2EnterInitializationMode(c));
    DEMAND(!b->fmi2ExitInitializationMode(c));
    double t = from;
    for (long i = 0; i < n; i++) {
      if (!summed) t = from + (double)i * h;
      DEMAND(b->fmi2DoStep(c, t, h, 1) == fmi2OK);
      if (summed) t += h;
    }
    DEMAND(b->fmi2DoStep(c, t + 0.5 * h, h, 1) == fmi2Error); /* an error beyond rounding is refused at any time */
    b->fmi2FreeInstance(c);
    printf("%ld steps of %.17g s from %g s, t %s: none refused\n", n, h, from, summed ? "+= h" : "= i h");
  }
}

/* steps instances in turns: each gives the same result as alone */
static void instances(const binary *b) {
  enum { N = 1000, STEPS = 20 };
  static void *c[N];
  static uint64_t hash[N];
  for (int k = 0; k < n_models && k < 8; k++)
    for (int fmi = 2; fmi <= 3; fmi++) {
      memset(hash, 0, sizeof hash);
      for (int i = 0; i < N; i++) c[i] = start(b, models + k, fmi);
      for (int s = 0; s < STEPS; s++)
        for (int i = 0; i < N; i++) DEMAND(!advance(b, models + k, c[i], fmi, s, hash + i));
      for (int i = 0; i < N; i++) {
        DEMAND(hash[i] == hash[0] && hash[0] != 0);
        stop(b, c[i], fmi);
      }
    }
}

/* memory in use: heap bytes and mapped ranges.  Both are exact, while the kernel counts resident pages in batches. */
typedef struct {
  size_t bytes;
  int ranges;
} held;

static held now_held(void) {
  FILE *f = fopen("/proc/self/maps", "r");
  held h = {0, 0};
  DEMAND(f);
  for (int c; (c = fgetc(f)) != EOF;) h.ranges += c == '\n';
  fclose(f);
  h.bytes = mallinfo2().uordblks;
  return h;
}

static void reload(const char *path) {
  held before = {0, 0};
  uint64_t hash = 0, first = 0;
  for (int i = 0; i < 1000; i++) {
    const binary b = load(path);
    hash = 0;
    for (int fmi = 2; fmi <= 3; fmi++) {
      void *c = start(&b, models + i % n_models, fmi);
      DEMAND(!advance(&b, models + i % n_models, c, fmi, 0, &hash));
      stop(&b, c, fmi);
    }
    dlclose(b.handle);
    if (i == 0) first = hash;
    if (i == 100) before = now_held();
  }
  DEMAND(first != 0);
  const held after = now_held();
  printf("after 100 cycles %zu bytes, %d ranges; after 1000 %zu, %d\n", before.bytes, before.ranges, after.bytes,
         after.ranges);
  DEMAND(after.bytes == before.bytes && after.ranges == before.ranges);
}

/* every model in both standards: memory in use does not change after the first steps */
static void endurance(const binary *b) {
  const int n = getenv("STEPS") ? (int)strtol(getenv("STEPS"), NULL, 10) : 10000;
  for (int k = 0; k < n_models; k++)
    for (int fmi = 2; fmi <= 3; fmi++) {
      uint64_t hash = 0;
      const held none = now_held();
      void *c = start(b, models + k, fmi);
      held before = {0, 0};
      for (int s = 0; s < n; s++) {
        DEMAND(!advance(b, models + k, c, fmi, s, &hash));
        if (s == 10) before = now_held();
      }
      const held after = now_held();
      DEMAND(after.bytes == before.bytes && after.ranges == before.ranges);
      stop(b, c, fmi);
      DEMAND(now_held().bytes == none.bytes);
      printf("%s, FMI %d: %d steps, %zu bytes held\n", strrchr(models[k].location, '/') + 1, fmi, n,
             after.bytes - none.bytes);
    }
}

/* two FMUs with their own binaries at once give the same results as alone */
static void neighbours(const binary *a, const binary *b) {
  DEMAND(a->handle != b->handle && a->fmi2DoStep != b->fmi2DoStep);
  for (int k = 0; k < n_models; k++) {
    const model *const own = models + k, *const other = models + (k + 1) % n_models;
    uint64_t alone = 0, together = 0, aside = 0;
    void *c = start(a, own, 2);
    for (int s = 0; s < 50; s++) DEMAND(!advance(a, own, c, 2, s, &alone));
    stop(a, c, 2);
    void *x = start(a, own, 2), *y = start(b, other, 3);
    for (int s = 0; s < 50; s++) DEMAND(!advance(a, own, x, 2, s, &together) && !advance(b, other, y, 3, s, &aside));
    stop(b, y, 3), stop(a, x, 2);
    DEMAND(alone == together);
  }
}

static unsigned control_words(void) {
#if defined(__x86_64__)
  unsigned short x87;
  unsigned sse;
  __asm__ volatile("fnstcw %0" : "=m"(x87));
  __asm__ volatile("stmxcsr %0" : "=m"(sse));
  return (unsigned)x87 << 16 | (sse & 0xffc0); /* without the exception flags, which may be set */
#else
  return (unsigned)fegetround();
#endif
}

static void tell(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text, ...) {
  (void)e, (void)name, (void)s, (void)category;
  printf("%s\n", text);
}

/* rounding mode, exception masks and locale of the importer stay unchanged */
static void environment(const binary *b) {
  static const int modes[] = {FE_TONEAREST, FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
  const fmi2CallbackFunctions callbacks = {tell, NULL, NULL, NULL, NULL};
  DEMAND(setlocale(LC_ALL, ""));
  char name[500], text[16];
  snprintf(name, sizeof name, "%s", setlocale(LC_ALL, NULL));
  snprintf(text, sizeof text, "%g", 0.5);
  printf("locale %s writes %s\n", name, text);
  for (int r = 0; r < 4; r++) {
    DEMAND(!fesetround(modes[r]));
    const unsigned words = control_words();
    for (int k = 0; k < n_models; k++)
      for (int fmi = 2; fmi <= 3; fmi++) {
        uint64_t hash = 0;
        void *c = start(b, models + k, fmi);
        for (int s = 0; s < 20; s++) DEMAND(!advance(b, models + k, c, fmi, s, &hash) && control_words() == words);
        stop(b, c, fmi);
      }
    void *c = b->fmi2Instantiate("a", fmi2CoSimulation, models->token, models->location, &callbacks, 0, 1);
    DEMAND(c && b->fmi2SetupExperiment(c, 0, 0, NAN, 0, 0) == fmi2Error);
    DEMAND(!b->fmi2EnterInitializationMode(c) && !b->fmi2ExitInitializationMode(c));
    DEMAND(b->fmi2DoStep(c, 0.25, 0.5, 1) == fmi2Error); /* its message has numbers */
    b->fmi2FreeInstance(c);
    DEMAND(control_words() == words && !strcmp(name, setlocale(LC_ALL, NULL)));
  }
  fesetround(FE_TONEAREST);
}

int main(int argc, char **argv) {
  DEMAND(argc >= 4);
  n_models = read_models(argv[3], models, MOST);
  DEMAND(n_models > 0);
  if (!strcmp(argv[1], "reload")) return reload(argv[2]), 0;
  const binary b = load(argv[2]);
  if (!strcmp(argv[1], "steps")) steps(&b);
  else if (!strcmp(argv[1], "instances")) instances(&b);
  else if (!strcmp(argv[1], "endurance")) endurance(&b);
  else if (!strcmp(argv[1], "environment")) environment(&b);
  else {
    DEMAND(!strcmp(argv[1], "neighbours") && argc == 5);
    const binary other = load(argv[4]);
    neighbours(&b, &other);
  }
  return 0;
}
