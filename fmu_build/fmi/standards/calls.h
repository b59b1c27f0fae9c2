/* calls.h - the checks at the start of every function of a standard: is the call allowed now, are its arrays there?
 * The file that includes it defines CALLS(C): C(name, interfaces, phases) for each of its functions; FMI, the prefix of
 * the names; REFUSED, the status Error of the standard. */
#ifndef FMI_CALLS_H
#define FMI_CALLS_H
#include "fmi/messages.h"

#define FMI_CALL_ID(name, interfaces, phases) CALL_##name,
#define FMI_CALL_ROW(name, interfaces, phases) {FMI #name, interfaces, phases},
enum { CALLS(FMI_CALL_ID) };
static const fmi_call TABLE[] = {CALLS(FMI_CALL_ROW)};

#define BEGIN(name)            \
  instance *i = (instance *)c; \
  if (!fmi_allowed(i, TABLE + CALL_##name)) return REFUSED;
#define NEED(name, at, n, values) \
  if (!fmi_given(i, TABLE + CALL_##name, at, n, values)) return REFUSED
#endif
