/* master.h - the master loop of a scenario in C. */
#ifndef HYST_MASTER_H
#define HYST_MASTER_H
#include "master/system.h"

/* The next n rows of n_columns each, none of a cut, into `record`.  Row 0 are the first outputs of the initialised
 * units, which `values` hold; a run may come in any number of calls.  0, or 1 with unit and t in *m. */
int master_run(master *m, int64_t n, double *record);
#endif
