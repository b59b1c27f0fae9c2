/* unit.h - one FMU in a container: its library, its instance, and what it is told before the run. */
#ifndef HYST_CONTAINER_UNIT_H
#define HYST_CONTAINER_UNIT_H
#include "master/system.h"

enum { UNIT_TEXT = 512 };

/* a value that an FMU is told once: a parameter before, an input in its initialisation */
typedef struct {
  char type; /* of FMI 2.0: r, i, b, s; of FMI 3.0: r Float64, i Int32, l Int64, b Boolean, s String */
  uint32_t reference;
  int64_t n;
  double *values;
  char *text;
} told;

typedef struct {
  char *name, *library, *resources, *token; /* paths within the resources of the container */
  int64_t n_parameters, n_inputs;
  told *parameters, *inputs;
  master_unit *master; /* kind, references, sources: filled by the reader of the file; functions and instance here */
  void *loaded, *callbacks;
  char said[UNIT_TEXT]; /* the last message of the FMU */
} unit;

/* Loads the library, makes an instance and sets its parameters; `root` ends with '/'.  0, or 1 with the reason. */
int unit_open(unit *u, const char *root, char *why, size_t size);
/* Initialises it at t = 0 with the present values, and writes its outputs. */
int unit_start(unit *u, double *values, char *why, size_t size);
void unit_close(unit *u);
#endif
