/* messages.h - messages to the importer: log categories, refused calls. */
#ifndef FMI_MESSAGES_H
#define FMI_MESSAGES_H
#include "fmi/instance.h"

/* log categories, as bits; their names are predefined by the standards */
#define FMI_CATEGORIES(C)        \
  C(EVENTS, "logEvents")         \
  C(WARNING, "logStatusWarning") \
  C(ERROR, "logStatusError")
#define FMI_CATEGORY(id, name) FMI_LOG_##id,
enum { FMI_CATEGORIES(FMI_CATEGORY) FMI_N_CATEGORIES };
#undef FMI_CATEGORY

void fmi_log(const instance *i, fmi_status status, int category, const char *format, ...);
fmi_status fmi_set_logging(instance *i, const fmi_call *call, int on, size_t n, const char *const names[]);
fmi_status fmi_refuse(const instance *i, const char *format, ...); /* logs an error, returns FMI_ERROR */
fmi_status fmi_refuse_graph(const instance *i, const hyst_error *e);
/* 1 if the call is allowed in the current phase; else 0 after a message, and the caller returns Error.  Here and below,
 * checks of every step are in a header and their failures in a .c file, because a small model takes less time than the
 * function calls around it. */
int fmi_refuse_phase(const instance *i, const fmi_call *call); /* 0 */
static inline int fmi_allowed(const instance *i, const fmi_call *call) {
  const int good = i && call->phases & (unsigned)i->run.phase && call->interfaces & (unsigned)i->run.interface;
  return good ? 1 : fmi_refuse_phase(i, call);
}
/* 1 if an importer gave an array of n values; else 0 after a message, as "fmi2GetReal: the pointer to the values is
 * NULL."  No array is needed for 0 values. */
int fmi_refuse_null(const instance *i, const fmi_call *call, const char *values); /* 0 */
static inline int fmi_given(const instance *i, const fmi_call *call, const void *at, size_t n, const char *values) {
  return at || n == 0 ? 1 : fmi_refuse_null(i, call, values);
}
/* refuses a function that this FMU does not support */
fmi_status fmi_absent(const instance *i, const char *name, const char *why);
#endif
