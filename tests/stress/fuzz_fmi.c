/* libFuzzer target: the first byte selects a graph, the others a sequence of FMI calls. */
#define _POSIX_C_SOURCE 200809L /* fmemopen */
#include "../c/random_calls.h"
#include "core/block_file/graph_open.h"
#include "core/graph/graph.h"
#include "embedded.h"
#include "fmi/files/open_file.h"

static const unsigned char *at, *end;

/* one byte if sufficient; 0 at the end of the input */
static uint64_t draw(uint64_t n) {
  uint64_t v = 0;
  for (uint64_t room = 1; room < n && at < end; room <<= 8) v = v << 8 | *at++;
  return v % n;
}

static const embedded_file *chosen;

/* replaces fmi/files/open_file.c: every path opens the selected graph */
FILE *fmi_open_file(const char *path) {
  (void)path;
  return fmemopen((void *)chosen->bytes, chosen->length, "rb"); /* read only: the bytes stay unchanged */
}

/* data of modelDescription.xml */
static uint32_t references(char *token) {
  size_t bytes;
  hyst_error e;
  hyst_graph *g;
  if (hyst_graph_measure(chosen->bytes, chosen->length, &bytes, &e)) abort();
  void *memory = malloc(bytes);
  if (!memory || hyst_graph_open(chosen->bytes, chosen->length, memory, bytes, &g, &e)) abort();
  memcpy(token, g->token, HYST_TOKEN);
  const uint32_t n = (uint32_t)g->n_references;
  free(memory);
  return n;
}

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t length);
int LLVMFuzzerTestOneInput(const unsigned char *data, size_t length) {
  enum { MOST = 256 };
  static struct {
    uint32_t references;
    char token[HYST_TOKEN];
  } known[MOST]; /* cached: opening a graph costs as much as the calls */
  size_t n = 0;
  while (embedded_files[n].name && n < MOST) n++;
  if (length == 0) return 0;
  const size_t k = *data % n;
  chosen = embedded_files + k;
  if (!known[k].references) known[k].references = references(known[k].token);
  at = data + 1, end = data + length;
  while (at < end) one_call(known[k].references, "/model", known[k].token);
  close_units();
  return 0;
}
