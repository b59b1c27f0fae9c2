/* unit.h - one FMU in a container: its library, its instance, and what it is told before the run.
 *
 * The master calls every unit through three functions of unit.c, which set and read variables by their types. */
#ifndef HYST_CONTAINER_UNIT_H
#define HYST_CONTAINER_UNIT_H
#include "container/value.h"
#include "master/system.h"

enum { UNIT_TEXT = 512 };

/* a value that an FMU is told once: a parameter before, an input in its initialisation */
typedef struct {
  const value_type *type;
  uint32_t reference;
  int64_t n;
  void *values; /* of the type; strings point into the text of the file */
} told;

/* consecutive variables of one type, set or read by one call */
typedef struct {
  const value_type *type;
  int64_t reference, n_references; /* first one in the references of the unit */
  int64_t first, n;                /* elements */
  void (*call)(void);
} batch;

typedef struct {
  char *name, *library, *resources, *token; /* paths within the resources of the container */
  int fmi;
  int64_t n_structural, n_parameters, n_inputs, n_sets, n_gets;
  told *structural, *parameters, *inputs;
  batch *sets, *gets; /* connected inputs, outputs */
  char **names;       /* of the connected elements, for messages */
  void *room;         /* for the values of the longest batch */
  master_unit *master;
  void *loaded, *callbacks, *component;
  void (*step)(void);
  char said[UNIT_TEXT]; /* the last message of the FMU, or about it */
} unit;

/* Loads the library, makes an instance and sets its parameters; `root` ends with '/'.  true with the reason: failed. */
bool unit_open(unit *u, const char *root, char *why, size_t size);
/* Initialises it at t = 0 with the present values, and writes its outputs. */
bool unit_start(unit *u, double *values, char *why, size_t size);
bool unit_end(unit *u); /* tells it that the run is over; true if it refuses */
void unit_close(unit *u);
#endif
