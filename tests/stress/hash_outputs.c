/* Prints one hash per embedded graph: over the outputs of each step and, at intervals, derivatives, tangents and the
 * whole memory.  Equal hashes of two compilers or processors mean equal bits.
 *   hash_outputs STEPS */
#include <stdio.h>
#include <stdlib.h>

#include "core/block_file/graph_open.h"
#include "core/elementary/random.h"
#include "core/graph/continuous.h"
#include "core/graph/run.h"
#include "core/graph/tangent.h"
#include "embedded.h"

static uint64_t hash; /* FNV-1a over the bytes of a double from the lowest, independent of the byte order */

static void feed(const double *v, int64_t n) {
  for (; n > 0; n--, v++) {
    const union {
      double value;
      uint64_t bits;
    } as = {*v == *v ? *v : 0.5}; /* the sign of a NaN depends on the processor */
    for (int k = 0; k < 64; k += 8) hash = (hash ^ (as.bits >> k & 255)) * 0x100000001b3u;
  }
}

/* nested reversals, eight steps per level, different for every input */
static double excitation(int64_t input, int64_t step) {
  const uint64_t seed = 1 + (uint64_t)input, k = (uint64_t)step / 8;
  const double a = 2.6 * hyst_random_uniform(seed, k) - 1.3, b = 2.6 * hyst_random_uniform(seed, k + 1) - 1.3;
  return a + (b - a) * ((double)(step % 8) / 8);
}

static void feed_outputs(const hyst_graph *g) {
  for (int k = 0; k < g->n_ports; k++)
    if (g->ports[k].kind == HYST_OUTPUT) feed(g->ports[k].value, g->ports[k].size);
}

/* adds derivatives and tangents at the current point, which have no side effects */
static void feed_tangents(hyst_graph *g, double t, double *room) {
  const int64_t n = hyst_graph_n_continuous(g);
  double *const dx = room, *const seeds = dx + n, *const dy = seeds + n + g->n_external;
  int64_t n_outputs = 0;
  for (int k = 0; k < g->n_ports; k++)
    if (g->ports[k].kind == HYST_OUTPUT) n_outputs += g->ports[k].size;
  hyst_graph_evaluate(g, t);
  hyst_graph_derivatives(g, dx);
  feed(dx, n);
  for (int64_t k = 0; k < n + g->n_external; k++) seeds[k] = k % 2 ? -0.7 : 1.0;
  hyst_graph_tangent(g, seeds, seeds + g->n_external, dy, dx);
  feed(dy, n_outputs);
  feed(dx, n);
}

static const char *run(const embedded_file *file, int64_t steps) {
  const double h = 0.05;
  size_t bytes;
  hyst_error error;
  hyst_graph *g;
  if (hyst_graph_measure(file->bytes, file->length, &bytes, &error)) return "measure";
  void *const memory = malloc(bytes);
  double *const room = malloc(bytes); /* more than all seeds and tangents */
  if (!memory || !room) return "memory";
  if (hyst_graph_open(file->bytes, file->length, memory, bytes, &g, &error)) return "open";
  int64_t n_state;
  const double *const state = hyst_graph_state(g, &n_state);
  hash = 0xcbf29ce484222325u;
  for (int64_t i = 0; i <= steps; i++) {
    const double dt = i * 4 < steps * 3 ? h : 0.5 * h; /* STEP blocks recompute their derived values */
    for (int64_t k = 0; k < g->n_external; k++) g->external[k] = excitation(k, i);
    if (i == 0 ? hyst_graph_start(g, 0) : hyst_graph_step(g, (double)i * h, dt)) return "step";
    feed_outputs(g);
    if (i % 64 == 63) feed_tangents(g, (double)i * h, room);
    if (i % 512 == 511) feed(state, n_state);
  }
  for (int64_t i = 0; i < steps / 8; i++) { /* as in Model Exchange */
    for (int64_t k = 0; k < g->n_external; k++) g->external[k] = excitation(k + 7, i);
    hyst_graph_commit(g, (double)i * h);
    if (hyst_graph_is_sampled(g) && hyst_graph_sample(g, (double)i * h, g->step)) return "sample";
    feed_outputs(g);
  }
  free(memory);
  free(room);
  return NULL;
}

int main(int argc, char **argv) {
  if (argc != 2) return 2;
  for (const embedded_file *f = embedded_files; f->name; f++) {
    const char *wrong = run(f, strtol(argv[1], NULL, 10));
    printf("%s %08lx%08lx\n", wrong ? wrong : f->name, (unsigned long)(hash >> 32),
           (unsigned long)(hash & 0xffffffffu));
    if (wrong) return 1;
  }
  return 0;
}
