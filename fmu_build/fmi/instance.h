/* instance.h - one running FMU, the same for FMI 2.0 and 3.0.
 *
 * Layers, each with its header and based on the earlier ones: instance (this struct), messages, values, event, state
 * and derivative, life; then standards/, which translates types only.
 *
 * A refused call (wrong phase, unknown reference, value out of range, invalid step) logs one sentence, returns Error
 * and changes nothing; the next valid call works.  The standards allow an importer to give up after Error, but do not
 * require that the FMU is unusable.  Memory is allocated when an instance or a saved state is made, never in a step. */
#ifndef FMI_INSTANCE_H
#define FMI_INSTANCE_H
#include "core/graph/graph.h"

/* the first five values of fmi2Status and fmi3Status */
typedef enum { FMI_OK, FMI_WARNING, FMI_DISCARD, FMI_ERROR, FMI_FATAL } fmi_status;

/* interfaces and phases, as bits: a call lists those in which it is allowed.  Step Mode belongs to Co-Simulation,
 * Continuous-Time Mode to Model Exchange, Event Mode to both (in FMI 2.0 to Model Exchange alone). */
enum { CO_SIMULATION = 1, MODEL_EXCHANGE = 2, BOTH = 3 };
enum {
  INSTANTIATED = 1,
  INITIALIZATION = 2,
  EVENT = 4,
  STEPPING = 8,
  CONTINUOUS = 16,
  TERMINATED = 32,
  ANY = 63,
  INTERMEDIATE = 64 /* Intermediate Update Mode of FMI 3.0, inside of a step: not in ANY */
};

/* types of the table, as bits: a getter or setter lists those it accepts */
enum { REAL = HYST_REAL, INTEGER = HYST_INT, BOOLEAN = HYST_BOOL, ENUMERATION = HYST_CHOICE };

typedef struct {
  const char *name;
  unsigned interfaces, phases;
} fmi_call;

#define FMI_MOST_STEP 1e9    /* seconds */
#define FMI_MOST_SAMPLES 1e6 /* of a step */
static inline int fmi_is_finite(double v) { return v - v == 0; }

/* passes a message to the importer in the form of its standard */
typedef struct fmi_logger fmi_logger;
struct fmi_logger {
  void (*send)(const fmi_logger *to, const char *instance, fmi_status status, const char *category, const char *text);
  void (*callback)(void); /* logger of the importer, cast back by send() */
  void *environment;
};

/* what a run changes besides the memory of the graph; without padding, because it is saved as bytes */
typedef struct {
  int32_t interface, event_mode; /* constant: a state of another kind is refused */
  int32_t phase, stop_defined;
  int32_t stale;   /* values were set since the outputs were computed; ignored in Step Mode */
  int32_t changed; /* hyst_graph.changed */
  int32_t moving;  /* a derivative of an input is set for the next step */
  int32_t jump;    /* Model Exchange: what the solver knows of the inputs since the last accepted step, see event.c */
  double t, stop, dt;
  double clock;   /* of the importer: t with the rounding of its additions, see hyst_graph_end_of_step */
  double start;   /* of the first step of the model; Model Exchange: time of the first sample */
  double samples; /* periods from there to the last sample */
  double redo;    /* Co-Simulation with Event Mode: length of the last step, which an event repeats; 0: the start */
} fmi_run;

typedef struct fmi_saved fmi_saved; /* a saved state; stays in the list of the instance until it is freed */

/* options of the importer for an instance */
typedef struct {
  int interface;  /* CO_SIMULATION or MODEL_EXCHANGE */
  int by_element; /* FMI 2.0: every element of an array is a separate variable */
  int event_mode; /* Co-Simulation with Event Mode */
} fmi_kind;

typedef struct instance instance;
struct instance {
  char *name;
  fmi_logger logger;
  unsigned categories; /* bits of the categories that are sent */
  fmi_kind kind;
  hyst_graph *graph;
  int64_t n_continuous;
  hyst_port *continuous; /* the states, then the derivatives, as readable variables */
  double *derivatives;
  double period;         /* sample time (s), of which every step is a multiple; 0: none */
  double *before;        /* memory of the graph before an event that is being tried; NULL if no trial is needed */
  double *begin;         /* Co-Simulation with Event Mode: that before the last step; NULL if no step is repeated */
  double *work;          /* of derivatives */
  int tried;             /* the graph holds the result of the trial, `before` the memory before it */
  void *memory;          /* of the graph */
  unsigned char *broken; /* inputs of the graph whose last value was NaN or infinite */
  int64_t n_broken;
  fmi_run run;
  fmi_saved *saved;
  double *slopes; /* FMI 2.0 for Co-Simulation: see ahead.h; else NULL */
  /* FMI 3.0 for Co-Simulation: asks the importer, by its own callback, for the inputs at a time; NULL: it wants none */
  void (*ask)(instance *, double t);
  void (*update)(void);
};
/* numbers of the memory that a step changes: the inputs, at the end of the state, keep their values */
static inline int64_t fmi_n_memory(const instance *i) { return i->graph->n_state - i->graph->n_external; }
#endif
