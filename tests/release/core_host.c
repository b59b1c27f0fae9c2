/* Runs graphs in the core of a wheel: core_host LIBRARY CASES RESULTS.
 * CASES holds, per graph: 4 int64, bytes of the block file, rows, inputs, outputs; 2 doubles, start time and step; the
 * inputs of all rows; the block file, padded to 8 bytes.  RESULTS receives the outputs of all rows as doubles. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#ifdef _WIN32
#include <windows.h>
#define OPEN(path) (void *)LoadLibraryA(path)
#define FIND(library, name) (void *)GetProcAddress((HMODULE)(library), name)
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(library, name) dlsym(library, name)
#endif

typedef int measure_fn(const void *file, size_t n, size_t *size, void *error);
typedef int open_fn(const void *file, size_t n, void *memory, size_t size, void **graph, void *error);
typedef int run_fn(void *graph, int64_t n, double t0, double h, const double *u, double *y);

static void *take(FILE *f, size_t n) {
  void *p = malloc(n + 16);
  if (!p || fread(p, 1, n, f) != n) exit(3);
  return p;
}

int main(int argc, char **argv) {
  if (argc != 4) return 2;
  void *library = OPEN(argv[1]);
  FILE *in = fopen(argv[2], "rb"), *out = fopen(argv[3], "wb");
  if (!library || !in || !out) return fprintf(stderr, "%s cannot be loaded, or no files\n", argv[1]), 4;
  measure_fn *measure = (measure_fn *)FIND(library, "hyst_graph_measure");
  open_fn *open = (open_fn *)FIND(library, "hyst_graph_open");
  run_fn *run = (run_fn *)FIND(library, "hyst_graph_run");
  if (!measure || !open || !run) return 5;
  int64_t head[4];
  char error[1024]; /* hyst_error is smaller */
  while (fread(head, sizeof head, 1, in) == 1) {
    double *when = take(in, 16), *u = take(in, (size_t)(head[1] * head[2]) * 8);
    void *file = take(in, (size_t)((head[0] + 7) / 8 * 8)), *graph = NULL;
    double *y = malloc((size_t)(head[1] * head[3]) * 8 + 8);
    size_t size = 0;
    if (!y || measure(file, (size_t)head[0], &size, error)) return 6;
    void *memory = malloc(size + 16);
    if (!memory || open(file, (size_t)head[0], memory, size + 16, &graph, error)) return 7;
    if (run(graph, head[1], when[0], when[1], u, y)) return 8;
    fwrite(y, 8, (size_t)(head[1] * head[3]), out);
    free(when), free(u), free(file), free(y), free(memory);
  }
  return fclose(out);
}
