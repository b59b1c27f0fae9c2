/* instance.h - one running FMU, the same for FMI 2.0 and 3.0: fmi2.c and fmi3.c only translate types.
 *
 * A call that is refused (wrong phase, unknown reference, value out of range, bad step) says so in one sentence,
 * returns Error and changes nothing: the next good call works.  The standards let an importer give up after Error; they
 * do not ask the FMU to break.  Memory is allocated when an instance or a saved state is made, never in a step. */
#ifndef FMI_INSTANCE_H
#define FMI_INSTANCE_H
#include "core/graph/graph.h"

/* the first five values of fmi2Status and fmi3Status */
typedef enum { FMI_OK, FMI_WARNING, FMI_DISCARD, FMI_ERROR, FMI_FATAL } fmi_status;

/* interfaces and phases, as bits: a call lists those it is allowed in.  Step Mode belongs to Co-Simulation,
 * Continuous-Time Mode to Model Exchange, Event Mode to both (in FMI 2.0 to Model Exchange alone). */
enum { CO_SIMULATION = 1, MODEL_EXCHANGE = 2, BOTH = 3 };
enum { INSTANTIATED = 1, INITIALIZATION = 2, EVENT = 4, STEPPING = 8, CONTINUOUS = 16, TERMINATED = 32, ANY = 63 };

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
  unsigned interfaces, phases;
} fmi_call;

#define FMI_MOST_STEP 1e9 /* seconds */
static inline int fmi_is_finite(double v) { return v - v == 0; }

/* sends a finished message to the importer in the form of its standard */
typedef struct fmi_logger fmi_logger;
struct fmi_logger {
  void (*send)(const fmi_logger *to, const char *instance, fmi_status status, const char *category, const char *text);
  void (*callback)(void); /* the importer's function, cast back by send() */
  void *environment;
};

/* what a run changes besides the memory of the graph; no padding: it is saved as bytes */
typedef struct {
  int32_t interface, event_mode; /* never change: a state of the other kind is refused */
  int32_t phase, stop_defined;
  int32_t stale;   /* values were set since the outputs were computed; does not matter in Step Mode */
  int32_t changed; /* hyst_graph.changed */
  double t, stop, dt;
  double start;   /* Model Exchange: time of the first sample */
  double samples; /* periods from there to the last sample */
  double pending; /* Co-Simulation with Event Mode: time since the last sample */
} fmi_run;

typedef struct fmi_saved fmi_saved; /* a state handed out; lives in the instance's list until it is freed */

/* what the importer asks for when it makes an instance */
typedef struct {
  int interface;  /* CO_SIMULATION or MODEL_EXCHANGE */
  int by_element; /* FMI 2.0: every element of an array is a variable of its own */
  int event_mode; /* Co-Simulation with Event Mode */
} fmi_kind;

typedef struct {
  char *name;
  fmi_logger logger;
  unsigned categories; /* bits of the categories that are sent */
  fmi_kind kind;
  hyst_graph *graph;
  int64_t n_continuous;
  hyst_port *continuous; /* the states, then the derivatives, as variables that can be read */
  double *derivatives;
  double *before;        /* the memory of the graph before an event that is being tried; NULL: nothing to try */
  double *work;          /* of derivatives */
  int tried;             /* the graph holds the outcome of the event, `before` what was */
  void *memory;          /* of the graph */
  unsigned char *broken; /* inputs of the graph whose last value was NaN or infinite */
  int64_t n_broken;
  fmi_run run;
  fmi_saved *saved;
} instance;

/* NULL after a message.  `location` is the resources folder: a file URI or a path. */
instance *fmi_instantiate(const char *name, const char *token, const char *location, int logging_on, fmi_kind kind,
                          const fmi_logger *logger);
void fmi_free(instance *i);
void fmi_reset(instance *i);

void fmi_log(const instance *i, fmi_status status, int category, const char *format, ...);
fmi_status fmi_set_logging(instance *i, const fmi_call *call, int on, size_t n, const char *const names[]);
fmi_status fmi_refuse(const instance *i, const char *format, ...); /* logs an error, returns FMI_ERROR */
fmi_status fmi_refuse_graph(const instance *i, const hyst_error *e);
/* 1 if the call is allowed in the present phase; else a message, and the caller returns Error.  Here and below, what
 * happens at every step stands in this header, and what is refused in a .c file: a small model takes less time than
 * the calls around it. */
int fmi_refuse_phase(const instance *i, const fmi_call *call); /* 0 */
static inline int fmi_allowed(const instance *i, const fmi_call *call) {
  const int good = i && call->phases & (unsigned)i->run.phase && call->interfaces & (unsigned)i->run.interface;
  return good ? 1 : fmi_refuse_phase(i, call);
}
/* a function of the standard that this unit does not have */
fmi_status fmi_absent(const instance *i, const char *name, const char *why);

fmi_status fmi_setup(instance *i, double start, int stop_defined, double stop);
fmi_status fmi_enter_initialization(instance *i);
fmi_status fmi_exit_initialization(instance *i);
fmi_status fmi_terminate(instance *i);
fmi_status fmi_step(instance *i, double t, double h);
double fmi_slack(double t, double h); /* how far the times of an importer may be off */

/* event.c: Event Mode and Continuous-Time Mode */
fmi_status fmi_enter_event(instance *i);
fmi_status fmi_update_discrete(instance *i);      /* the event happens: samples are taken, memories take their inputs */
int fmi_next_event(const instance *i, double *t); /* 1: at *t */
fmi_status fmi_leave_event(instance *i);          /* to Step Mode or Continuous-Time Mode */
void fmi_undo_event(instance *i);                 /* what was only tried did not happen */
fmi_status fmi_try_event(instance *i);            /* outputs as if it happened now */
fmi_status fmi_evaluate(instance *i);             /* outputs for the present time, inputs and continuous states */
fmi_status fmi_set_time(instance *i, double t);
fmi_status fmi_completed_step(instance *i);
fmi_status fmi_set_states(instance *i, const fmi_call *call, const double *x, size_t n);
fmi_status fmi_get_states(instance *i, const fmi_call *call, double *x, size_t n);
fmi_status fmi_get_derivatives(instance *i, const fmi_call *call, double *dx, size_t n);
fmi_status fmi_get_nominals(instance *i, const fmi_call *call, double *nominals, size_t n);
fmi_status fmi_get_indicators(instance *i, const fmi_call *call, size_t n);

/* derivative.c: value references and the number of their elements */
typedef struct {
  const uint32_t *references;
  size_t n, count;
} fmi_references;
size_t fmi_derivative_work(const hyst_graph *g); /* doubles */
fmi_status fmi_directional(instance *i, const fmi_call *call, const fmi_references *unknowns,
                           const fmi_references *knowns, const double *seed, double *sensitivity);
fmi_status fmi_adjoint(instance *i, const fmi_call *call, const fmi_references *unknowns, const fmi_references *knowns,
                       const double *seed, double *sensitivity);

/* values.c: variables by value reference.  In both standards the graph's own come first; the next reference is the
 * time (FMI 3.0), then come the continuous states and their derivatives. */
/* The variable behind a reference; NULL if there is none. */
const hyst_port *fmi_find_continuous(const instance *i, uint32_t reference);
static inline const hyst_port *fmi_find(const instance *i, uint32_t reference) {
  const hyst_port *p = hyst_graph_port(i->graph, reference);
  if (!p) return fmi_find_continuous(i, reference);
  return i->kind.by_element || p->reference == reference ? p : NULL;
}
/* The same if it has one of the types, a derivative with its present value; NULL after a message. */
const hyst_port *fmi_seek_port(const instance *i, const fmi_call *call, uint32_t reference, unsigned types);
static inline const hyst_port *fmi_port(const instance *i, const fmi_call *call, uint32_t reference, unsigned types) {
  const hyst_port *p = hyst_graph_port(i->graph, reference);
  const int good = p && (unsigned)p->type & types && (i->kind.by_element || p->reference == reference);
  return good ? p : fmi_seek_port(i, call, reference, types);
}
/* That again, which fmi_port() has found: without its checks. */
static inline const hyst_port *fmi_found(const instance *i, uint32_t reference) {
  const hyst_graph *g = i->graph;
  return reference < g->n_references ? g->ports + g->port_of[reference] : fmi_find_continuous(i, reference);
}
/* parameters that were set take effect, for the step in use */
fmi_status fmi_prepare(instance *i);
/* before values are read: outputs that belong to the present inputs; in Step Mode they are those of the last step */
fmi_status fmi_refresh(instance *i);
static inline fmi_status fmi_fresh(instance *i) {
  return i->run.phase & (INITIALIZATION | EVENT | CONTINUOUS) && i->run.stale ? fmi_refresh(i) : FMI_OK;
}
/* May the element be set to this value now?  fmi_set() then does it: a call with several values sets all or none. */
fmi_status fmi_examine(instance *i, const hyst_port *p, int64_t element, double value);
static inline fmi_status fmi_accept(instance *i, const hyst_port *p, int64_t element, double value) {
  return p->kind == HYST_INPUT && !hyst_check_port(p, value) ? FMI_OK : fmi_examine(i, p, element, value);
}
static inline void fmi_set(instance *i, const hyst_port *p, int64_t element, double value) {
  p->value[element] = value;
  i->run.stale = 1;
  if (p->kind == HYST_PARAM || p->kind == HYST_FIXED) {
    i->graph->changed = 1;
  } else if (p->kind == HYST_INPUT && i->n_broken) {
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
