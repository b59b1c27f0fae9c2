/* state.h - saved states. */
#ifndef FMI_STATE_H
#define FMI_STATE_H
#include "fmi/instance.h"

fmi_status fmi_save(instance *i, void **state);
fmi_status fmi_restore(instance *i, void *state);
fmi_status fmi_forget(instance *i, void **state);
fmi_status fmi_saved_size(instance *i, void *state, size_t *size);
fmi_status fmi_serialize(instance *i, void *state, unsigned char *bytes, size_t size);
fmi_status fmi_deserialize(instance *i, const unsigned char *bytes, size_t size, void **state);
#endif
