/* master.h - the master loop of a scenario in C. */
#ifndef HYST_MASTER_H
#define HYST_MASTER_H
#include "master/system.h"

/* Writes the next n rows of n_columns each to `record`, without rows for cuts.  Row 0 holds the outputs of the
 * initialised units, which are in `values`; a run may be divided into any number of calls.  Returns 0, or 1 with unit
 * and t in *m. */
int master_run(master *m, int64_t n, double *record);
#endif
