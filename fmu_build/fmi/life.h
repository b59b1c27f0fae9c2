/* life.h - instantiate, initialise, step, reset, free. */
#ifndef FMI_LIFE_H
#define FMI_LIFE_H
#include "fmi/instance.h"

/* NULL after a message.  `location` is the resources folder: a file URI or a path. */
instance *fmi_instantiate(const char *name, const char *token, const char *location, int logging_on, fmi_kind kind,
                          const fmi_logger *logger);
void fmi_free(instance *i);
void fmi_reset(instance *i);

fmi_status fmi_setup(instance *i, double start, int stop_defined, double stop);
fmi_status fmi_enter_initialization(instance *i);
fmi_status fmi_exit_initialization(instance *i);
fmi_status fmi_terminate(instance *i);
fmi_status fmi_step(instance *i, double t, double h);
#endif
