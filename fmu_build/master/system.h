/* system.h - what the master loop of a scenario runs: units of several rates in a stated order, recorded on the fine
 * grid.
 *
 * A unit is a graph of the core, or a foreign FMU that is called by its function pointers.  All outputs of all
 * units lie side by side in `values`; a unit copies what it reads from there, steps, and writes its own outputs there.
 *   Gauss-Seidel  every unit in the stated order copies, steps and writes: it reads the newest values there are
 *   Jacobi        all units that are due copy, then all step, then all write: they read the values of the last step
 *   iterative     Gauss-Seidel sweeps from the same saved states until what was read too early agrees with what came
 *                 out: by Newton's method where units give derivatives (newton.h), else relaxed after Aitken (Irons &
 *                 Tuck 1969), which for one value is the secant method
 * A fine step with an event inside is cut there: units that take any step do so in pieces, the others as a whole.
 * No allocation, no lock, no call into Python: threads run in parallel. */
#ifndef HYST_MASTER_SYSTEM_H
#define HYST_MASTER_SYSTEM_H
#include "core/graph/graph.h"

typedef enum { MASTER_GRAPH, MASTER_FMI2, MASTER_FMI3 } master_kind;
typedef enum { MASTER_GAUSS_SEIDEL, MASTER_JACOBI, MASTER_ITERATIVE } master_scheme;

typedef struct {
  int32_t kind, rollback;                         /* rollback: an FMU must be ready to be restored (iterative) */
  int64_t any_step;                               /* its steps may be cut; its period is 1 then */
  int64_t period;                                 /* in fine steps */
  int64_t substeps;                               /* steps in each period */
  double h;                                       /* its step, a substep (s) */
  void *self;                                     /* hyst_graph or component */
  void (*set)(void), (*step)(void), (*get)(void); /* of an FMU: Set..., DoStep, Get... */
  void (*save)(void), (*restore)(void);           /* of an FMU, iterative: Get...State, Set...State */
  void (*slope)(void);                            /* of an FMU in a loop, with newton: GetDirectionalDerivative */
  int64_t n_in, n_out, first;                     /* elements; place of its first output among the values */
  const int64_t *source;          /* per input: place among the values; -1: a constant element of an array of an FMU */
  double *u;                      /* of an FMU: room for its inputs */
  const uint32_t *vr_in, *vr_out; /* value references; of a graph one per element */
  int64_t n_vr_in, n_vr_out;
  const double *ahead; /* inputs on straight lines: how far into the step the newest value lies, 1: at its end; NULL:
                          inputs are held */
  double *line;        /* with ahead: newest values, those before them, values of a substep; the first two as saved */
  void **at;           /* of a graph: room for n_in + n_out pointers */
  double *saved;       /* of a graph, iterative: room for its state */
  void *state;         /* of an FMU, iterative: its saved state; the caller frees it */
  double *slopes; /* of a graph in a loop, with newton: room for inputs, twice the continuous states, and its state */
  double t;       /* at which its last step ended */
} master_unit;

typedef struct {
  int32_t scheme, most_sweeps;
  double tolerance; /* iterative: largest remaining disagreement, relative to 1 + |value| */
  int64_t n_units;
  master_unit *units; /* in the stated order */
  double *values;
  int64_t n_values;
  int64_t n_early; /* values that a unit reads before the unit that makes them has stepped */
  const int64_t *early;
  double *begin, *guess, *residual; /* iterative: room for n_values and twice n_early */
  const int64_t *makers;            /* iterative: the unit that makes each early value */
  double *newton;    /* iterative: room for 2 n_values, the most inputs of a unit, and n_early * (2 n_early + 3), if all
                        units in loops have directional derivatives; else NULL */
  int64_t n_columns; /* values that are recorded */
  const int64_t *columns;
  int64_t n_cuts; /* fine steps that are cut, not decreasing, and at which times: events between two fine steps */
  const int64_t *cut_rows;
  const double *cuts;
  double base, h; /* the step, and the fine step: `ripple` of them (s).  The time of a row is made of both, so that
                     samples do not drift */
  int64_t ripple;
  int64_t row, cut; /* where the run is: the next row and the next cut, 0 at first */
  double now;       /* time of the last row, 0 at first */
  int64_t unit;     /* after a failure: unit, -1: values not finite, -2: sweeps do not agree */
  double t;         /* and the time: at which the step of the unit begins, or at which the values or sweeps are wrong */
  int64_t sweeps, most_in_step, steps; /* iterative: all together, the most in a step, in how many steps */
} master;
#endif
