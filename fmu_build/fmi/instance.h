/* instance.h - one running FMU, the same for FMI 2.0 and 3.0: fmi2.c and fmi3.c only translate types.
 *
 * A call that is refused (wrong phase, unknown reference, value out of range, bad step) says so in one sentence,
 * returns Error and changes nothing: the next good call works.  The standards let an importer give up after Error; they
 * do not ask the FMU to break.  Memory is allocated when an instance or a saved state is made, never in a step. */
#ifndef FMI_INSTANCE_H
#define FMI_INSTANCE_H
#include "graph.h"

/* the first five values of fmi2Status and fmi3Status */
typedef enum { FMI_OK, FMI_WARNING, FMI_DISCARD, FMI_ERROR, FMI_FATAL } fmi_status;

/* phases, as bits: a call lists those it is allowed in */
enum { INSTANTIATED = 1, INITIALIZATION = 2, STEPPING = 4, TERMINATED = 8, ANY = 15 };

/* types of the table, as bits: a getter or setter lists those it carries */
enum { REAL = HYST_REAL, INTEGER = HYST_INT, BOOLEAN = HYST_BOOL, ENUMERATION = HYST_CHOICE };

/* categories of messages, as bits; the names are those that the standards predefine */
#define FMI_CATEGORIES(C)        \
  C(EVENTS, "logEvents")         \
  C(WARNING, "logStatusWarning") \
  C(ERROR, "logStatusError")
#define FMI_CATEGORY(id, name) FMI_LOG_##id,
enum { FMI_CATEGORIES(FMI_CATEGORY) FMI_N_CATEGORIES };
#undef FMI_CATEGORY

typedef struct {
  const char *name;
  unsigned phases;
} fmi_call;

/* sends a finished message to the importer in the form of its standard */
typedef struct fmi_logger fmi_logger;
struct fmi_logger {
  void (*send)(const fmi_logger *to, const char *instance, fmi_status status, const char *category, const char *text);
  void (*callback)(void); /* the importer's function, cast back by send() */
  void *environment;
};

/* what a run changes besides the memory of the graph; no padding: it is saved as bytes */
typedef struct {
  int32_t phase, stop_defined;
  int32_t stale;   /* initialisation: values were set since the outputs were computed */
  int32_t changed; /* hyst_graph.changed */
  double t, stop, dt;
} fmi_run;

typedef struct fmi_saved fmi_saved; /* a state handed out; lives in the instance's list until it is freed */

typedef struct {
  char *name;
  fmi_logger logger;
  unsigned categories; /* bits of the categories that are sent */
  int by_element;      /* FMI 2.0: every element of an array is a variable of its own */
  hyst_graph *graph;
  void *memory;          /* of the graph */
  unsigned char *broken; /* inputs of the graph whose last value was NaN or infinite */
  int64_t n_broken;
  fmi_run run;
  fmi_saved *saved;
} instance;

/* NULL after a message.  `location` is the resources folder: a file URI or a path. */
instance *fmi_instantiate(const char *name, const char *token, const char *location, int logging_on, int by_element,
                          const fmi_logger *logger);
void fmi_free(instance *i);
void fmi_reset(instance *i);

void fmi_log(const instance *i, fmi_status status, int category, const char *format, ...);
fmi_status fmi_set_logging(instance *i, const fmi_call *call, int on, size_t n, const char *const names[]);
fmi_status fmi_refuse(const instance *i, const char *format, ...); /* logs an error, returns FMI_ERROR */
/* 1 if the call is allowed in the present phase; else a message, and the caller returns Error.  Here and below, what
 * happens at every step stands in this header, and what is refused in instance.c: a small model takes less time than
 * the calls around it. */
int fmi_refuse_phase(const instance *i, const fmi_call *call); /* 0 */
static inline int fmi_allowed(const instance *i, const fmi_call *call) {
  return i && call->phases & (unsigned)i->run.phase ? 1 : fmi_refuse_phase(i, call);
}
/* a function of the standard that this unit does not have */
fmi_status fmi_absent(const instance *i, const char *name, const char *why);

fmi_status fmi_setup(instance *i, double start, int stop_defined, double stop);
fmi_status fmi_exit_initialization(instance *i);
fmi_status fmi_step(instance *i, double t, double h);

/* The variable behind a reference if it has one of the types; NULL after a message. */
const hyst_port *fmi_refuse_port(const instance *i, const fmi_call *call, uint32_t reference);
static inline const hyst_port *fmi_port(const instance *i, const fmi_call *call, uint32_t reference, unsigned types) {
  const hyst_port *p = hyst_graph_port(i->graph, reference);
  const int good = p && (unsigned)p->type & types && (i->by_element || p->reference == reference);
  return good ? p : fmi_refuse_port(i, call, reference);
}
fmi_status fmi_refresh(instance *i);
static inline fmi_status fmi_fresh(
    instance *i) { /* before values are read: outputs that belong to the present inputs */
  return i->run.phase == INITIALIZATION && i->run.stale ? fmi_refresh(i) : FMI_OK;
}
/* May the element be set to this value now?  fmi_set() then does it: a call with several values sets all or none. */
fmi_status fmi_examine(instance *i, const hyst_port *p, int64_t element, double value);
static inline fmi_status fmi_accept(instance *i, const hyst_port *p, int64_t element, double value) {
  return p->kind == HYST_INPUT && !hyst_check_port(p, value) ? FMI_OK : fmi_examine(i, p, element, value);
}
static inline void fmi_set(instance *i, const hyst_port *p, int64_t element, double value) {
  p->value[element] = value;
  i->run.stale = 1;
  if (p->kind != HYST_INPUT) {
    i->graph->changed = 1;
  } else if (i->n_broken) {
    const int64_t at = p->value - i->graph->external + element;
    i->n_broken -= i->broken[at];
    i->broken[at] = 0;
  }
}

fmi_status fmi_save(instance *i, void **state);
fmi_status fmi_restore(instance *i, void *state);
fmi_status fmi_forget(instance *i, void **state);
fmi_status fmi_saved_size(instance *i, void *state, size_t *size);
fmi_status fmi_serialize(instance *i, void *state, unsigned char *bytes, size_t size);
fmi_status fmi_deserialize(instance *i, const unsigned char *bytes, size_t size, void **state);

/* resource.c: the whole of <location>/block.bin, or NULL and what went wrong in `why` */
unsigned char *fmi_read_block_file(const char *location, size_t *length, char *why, size_t size);
#endif
