/* system.h - the system of a master loop: units with several rates in a given order, recorded on the fine grid.
 *
 * A unit is a graph of the core, or a foreign FMU called by function pointers.  `values` holds the outputs of all
 * units; a unit copies its inputs from there, steps, and writes its outputs there.
 *   Gauss-Seidel  units copy, step and write in the given order: they read the newest values
 *   Jacobi        all units that are due copy, then all step, then all write: they read the values of the last step
 *   iterative     Gauss-Seidel sweeps from the same saved states until early values (read before their unit has
 *                 stepped) agree with the outputs: by Newton's method if units have tangents (newton.h), else with
 *                 Aitken relaxation (Irons & Tuck 1969), which for one value is the secant method
 * A fine step that contains an event is cut there: units with variable steps make it in pieces, others as a whole.
 * No allocation, no lock, no call into Python, so that threads run in parallel. */
#ifndef HYST_MASTER_SYSTEM_H
#define HYST_MASTER_SYSTEM_H
#include "core/graph/graph.h"

typedef enum { MASTER_GRAPH, MASTER_FMI2, MASTER_FMI3 } master_kind;
typedef enum { MASTER_GAUSS_SEIDEL, MASTER_JACOBI, MASTER_ITERATIVE } master_scheme;

typedef struct {
  int32_t kind, rollback;                         /* rollback: the state of an FMU must be saved first (iterative) */
  int64_t any_step;                               /* steps may be cut; the period is then 1 */
  int64_t period;                                 /* in fine steps */
  int64_t substeps;                               /* steps in each period */
  double h;                                       /* length of a substep (s) */
  void *self;                                     /* hyst_graph or component */
  void (*set)(void), (*step)(void), (*get)(void); /* of an FMU: Set..., DoStep, Get... */
  void (*save)(void), (*restore)(void);           /* of an FMU, iterative: Get...State, Set...State */
  void (*tangent)(void);                          /* of an FMU in a loop, with newton: GetDirectionalDerivative */
  int64_t n_in, n_out, first;                     /* elements; index of the first output in the values */
  const int64_t *source;          /* per input: index in the values; -1: a constant element of an array of an FMU */
  double *u;                      /* of an FMU: room for its inputs */
  const uint32_t *vr_in, *vr_out; /* value references; of a graph one per element */
  int64_t n_vr_in, n_vr_out;
  const double *ahead; /* inputs as straight lines: position of the newest value in the step, 1: at its end; NULL:
                          inputs are held */
  double *line;        /* with ahead: newest values, previous ones, those of a substep; then the first two as saved */
  void **at;           /* of a graph: room for n_in + n_out pointers */
  double *saved;       /* of a graph, iterative: room for its state */
  void *state;         /* of an FMU, iterative: its saved state; the caller frees it */
  double *seeds; /* of a graph in a loop, with newton: room for inputs, twice the continuous states, and its state */
  double t;      /* time at which the last step ended */
} master_unit;

typedef struct {
  int32_t scheme, most_sweeps;
  double tolerance; /* iterative: largest remaining disagreement, relative to 1 + |value| */
  int64_t n_units;
  master_unit *units; /* in the given order */
  double *values;
  int64_t n_values;
  int64_t n_early; /* early values: read by a unit before their own unit has stepped */
  const int64_t *early;
  double *begin, *guess, *residual; /* iterative: room for n_values and twice n_early */
  const int64_t *makers;            /* iterative: the unit of each early value */
  double *newton;    /* iterative: room for 2 n_values, the most inputs of a unit, and n_early * (2 n_early + 3), if all
                        units in loops have directional derivatives; else NULL */
  int64_t n_columns; /* recorded values */
  const int64_t *columns;
  int64_t n_cuts; /* fine steps that are cut, not decreasing, and the times of the cuts */
  const int64_t *cut_rows;
  const double *cuts;
  double base, h; /* the step and the fine step (s); a step has `ripple` fine steps.  Times are computed from both,
                     so that samples do not drift */
  int64_t ripple;
  int64_t row, cut; /* position of the run: the next row and the next cut, initially 0 */
  double now;       /* time of the last row, initially 0 */
  int64_t unit;     /* after a failure: unit, -1: values not finite, -2: sweeps do not converge */
  double t;         /* and the time: start of the step of the unit, or time of the wrong values or sweeps */
  int64_t sweeps, most_in_step, steps; /* iterative: sum of sweeps, maximum per step, number of steps */
} master;
#endif
