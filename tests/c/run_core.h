/* run_core.h - opens a block file, however damaged, and runs what it holds through every function of the core.
 * Exits with a distinct number for each violated guarantee; the sanitizers detect memory errors. */
#ifndef RUN_CORE_H
#define RUN_CORE_H
#include <stdlib.h>
#include <string.h>

#include "core/block_file/graph_open.h"
#include "core/elementary/crc.h"
#include "core/elementary/random.h"
#include "core/graph/continuous.h"
#include "core/graph/graph.h"
#include "core/graph/message.h"
#include "core/graph/run.h"
#include "core/graph/tangent.h"

static uint64_t drawn;
static uint64_t draw(void) { return hyst_random_bits(1, drawn++); }

static void put_u32(unsigned char *to, uint32_t v) {
  for (int k = 0; k < 4; k++) to[k] = (unsigned char)(v >> 8 * k);
}

/* correct length and checksum, so that the damage behind them is reached */
static void seal(unsigned char *file, size_t length) {
  if (length < 20) return;
  put_u32(file + 12, (uint32_t)length);
  put_u32(file + 16, hyst_crc32(file + 20, length - 20));
}

/* inputs: usually moderate, sometimes the largest finite numbers */
static double input(int extreme) {
  const double u = 4 * hyst_random_uniform(2, drawn++) - 2;
  if (!extreme || draw() % 50) return u;
  return u * (draw() % 2 ? 1e300 : 1e-300);
}

/* the continuous-time passes, from the present state */
static void continuous(hyst_graph *g, int extreme) {
  const int64_t n = hyst_graph_n_continuous(g);
  int64_t n_outputs = 0;
  for (int k = 0; k < g->n_ports; k++)
    if (g->ports[k].kind == HYST_OUTPUT) n_outputs += g->ports[k].size;
  /* each of its exact length, so that a write past the end is detected */
  double *dx = malloc((size_t)(n + !n) * sizeof *dx), *seeds = malloc((size_t)(n + g->n_external + 1) * sizeof *seeds);
  double *dy = malloc((size_t)(n_outputs + !n_outputs) * sizeof *dy);
  if (!dx || !seeds || !dy) exit(3);
  for (int i = 0; i < 20; i++) {
    for (int64_t k = 0; k < g->n_external; k++) g->external[k] = input(extreme);
    for (int64_t k = 0; k < n; k++) {
      const hyst_node *node;
      const hyst_var *row = hyst_graph_continuous_row(g, k, &node);
      if (row->kind != HYST_CSTATE || node->n_c == 0) exit(10);
      *hyst_graph_continuous(g, k) = input(extreme);
    }
    hyst_graph_evaluate(g, i);
    hyst_graph_derivatives(g, dx);
    for (int64_t k = 0; k < n + g->n_external; k++) seeds[k] = input(extreme);
    hyst_graph_tangent(g, seeds, seeds + g->n_external, dy, dx);
    hyst_graph_commit(g, i);
    if (hyst_graph_is_sampled(g)) (void)hyst_graph_sample(g, i, g->step > 0 ? g->step : 1);
  }
  free(dx);
  free(seeds);
  free(dy);
}

/* open, run, save and restore; returns the status of opening */
static hyst_status run(const unsigned char *file, size_t length, int steps, double h, int extreme) {
  size_t bytes = 0;
  hyst_error error;
  char text[512];
  unsigned char *copy = malloc(length ? length : 1); /* of the exact length: a read past the end is detected */
  if (!copy) exit(3);
  if (length) memcpy(copy, file, length);
  hyst_status s = hyst_graph_measure(copy, length, &bytes, &error);
  if (s) {
    hyst_message(&error, text, sizeof text);
    hyst_graph *none = NULL;
    if (hyst_graph_open(copy, length, NULL, 0, &none, &error) != s || none) exit(11); /* it checks the file itself */
    free(copy);
    return s;
  }
  void *memory = malloc(bytes);
  if (!memory) exit(3);
  hyst_graph *g = NULL;
  if (hyst_graph_open(copy, length, memory, bytes - 1, &g, &error) != HYST_E_MEMORY) exit(4);
  s = hyst_graph_open(copy, length, memory, bytes, &g, &error);
  free(copy); /* an open graph must not need the file */
  if (s) {
    hyst_message(&error, text, sizeof text);
    free(memory);
    return s;
  }
  int64_t n = 0, past = 0;
  double *state = hyst_graph_state(g, &n), *saved = malloc(((size_t)n + 1) * sizeof *saved);
  if (!saved) exit(3);
  for (int i = 0; i <= steps; i++) {
    for (int k = 0; k < g->n_ports; k++)
      for (int64_t j = 0; g->ports[k].kind == HYST_INPUT && j < g->ports[k].size; j++)
        (void)hyst_graph_set(g, g->ports[k].reference + j, input(extreme));
    if (i == 0 ? hyst_graph_start(g, 0) : hyst_graph_step(g, i * h, h)) {
      hyst_message(hyst_graph_error(g), text, sizeof text);
      break;
    }
    if (i == steps / 2) memcpy(saved, state, (size_t)n * sizeof *state);
  }
  continuous(g, extreme);
  memcpy(state, saved, (size_t)n * sizeof *state);
  (void)hyst_graph_step(g, (steps + 1) * h, h);
  for (int k = 0; k < g->n_ports; k++) past = g->ports[k].reference + g->ports[k].size;
  for (int64_t r = -1; r <= past; r++) { /* one before and one after all references are refused */
    const int outside = r < 0 || r == past;
    if (outside != (hyst_graph_value(g, r) == NULL)) exit(5);
    if (r < 2 || r > past - 3 || draw() % 16 == 0) (void)hyst_graph_set(g, r, 2 * input(1));
  }
  if (!hyst_graph_step(g, (steps + 2) * h, h)) (void)hyst_graph_step(g, (steps + 3) * h, 0.5 * h);
  hyst_graph_defaults(g);
  for (int i = 0; i < 3; i++) { /* extreme times and steps */
    static const double odd[] = {1e300, -1e300, 1e-300};
    (void)hyst_graph_start(g, odd[i]);
    (void)hyst_graph_step(g, odd[i], 1e300);
    (void)hyst_graph_step(g, odd[i], 1e-300);
  }
  free(saved);
  free(memory);
  return HYST_E_OK;
}
#endif
