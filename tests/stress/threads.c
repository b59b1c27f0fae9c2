/* Eight threads make, run and free their own instances of every model in both standards at the same time.  All must get
 * the same numbers; the thread sanitizer reports data that they share.    threads MODELS */
#include <pthread.h>

#include "binary.h"

enum { THREADS = 8, MOST = 200, STEPS = 400 };
static model models[MOST];
static int n_models;

static void *work(void *result) {
  const binary b = load(NULL); /* the FMI layer is linked into this program */
  uint64_t hash = 0;
  for (int k = 0; k < n_models; k++)
    for (int fmi = 2; fmi <= 3; fmi++) {
      void *c = start(&b, models + k, fmi);
      for (int s = 0; s < STEPS; s++) DEMAND(!advance(&b, models + k, c, fmi, s, &hash));
      stop(&b, c, fmi);
    }
  *(uint64_t *)result = hash;
  return NULL;
}

int main(int argc, char **argv) {
  pthread_t thread[THREADS];
  uint64_t hash[THREADS];
  DEMAND(argc == 2 && (n_models = read_models(argv[1], models, MOST)) > 0);
  for (int i = 0; i < THREADS; i++) DEMAND(!pthread_create(thread + i, NULL, work, hash + i));
  for (int i = 0; i < THREADS; i++) {
    DEMAND(!pthread_join(thread[i], NULL));
    DEMAND(hash[i] == hash[0] && hash[0] != 0);
  }
  return 0;
}
