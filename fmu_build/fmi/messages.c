/* messages.c - one sentence for each refused call, in the log categories that the importer selects. */
#include "fmi/messages.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/graph/message.h"

#define NAME(id, name) name,
static const char *const CATEGORIES[] = {FMI_CATEGORIES(NAME)};
#undef NAME

static void log_list(const instance *i, fmi_status status, int category, const char *format, va_list list) {
  char text[768];
  if (!(i->categories & 1u << category) || !i->logger.callback) return;
  vsnprintf(text, sizeof text, format, list);
  i->logger.send(&i->logger, i->name, status, CATEGORIES[category], text);
}

void fmi_log(const instance *i, fmi_status status, int category, const char *format, ...) {
  va_list list;
  va_start(list, format);
  log_list(i, status, category, format, list);
  va_end(list);
}

fmi_status fmi_refuse(const instance *i, const char *format, ...) {
  va_list list;
  va_start(list, format);
  log_list(i, FMI_ERROR, FMI_LOG_ERROR, format, list);
  va_end(list);
  return FMI_ERROR;
}

fmi_status fmi_refuse_graph(const instance *i, const hyst_error *e) {
  char text[512];
  hyst_message(e, text, sizeof text);
  return fmi_refuse(i, "%s", text);
}

fmi_status fmi_set_logging(instance *i, const fmi_call *call, int on, size_t n, const char *const names[]) {
  if (!fmi_given(i, call, names, n, "log categories")) return FMI_ERROR;
  unsigned bits = n ? 0 : (1u << FMI_N_CATEGORIES) - 1;
  for (size_t k = 0; k < n; k++) {
    int c = 0;
    if (names[k] && !strcmp(names[k], "logAll")) {
      bits = (1u << FMI_N_CATEGORIES) - 1;
      continue;
    }
    while (c < FMI_N_CATEGORIES && names[k] && strcmp(names[k], CATEGORIES[c]) != 0) c++;
    if (c == FMI_N_CATEGORIES || !names[k])
      return fmi_refuse(i, "%s: no log category '%s'.", call->name, names[k] ? names[k] : "");
    bits |= 1u << c;
  }
  i->categories = on ? bits : i->categories & ~bits;
  return FMI_OK;
}

static const char *phase_name(int phase) {
  return phase == INSTANTIATED     ? "Instantiated"
         : phase == INITIALIZATION ? "Initialization Mode"
         : phase == EVENT          ? "Event Mode"
         : phase == STEPPING       ? "Step Mode"
         : phase == CONTINUOUS     ? "Continuous-Time Mode"
         : phase == INTERMEDIATE   ? "Intermediate Update Mode"
                                   : "Terminated";
}

int fmi_refuse_phase(const instance *i, const fmi_call *call) {
  if (!i) return 0;
  fmi_refuse(i, "%s is not allowed in the state '%s' of %s.", call->name, phase_name(i->run.phase),
             i->run.interface == CO_SIMULATION ? "Co-Simulation" : "Model Exchange");
  return 0;
}

int fmi_refuse_null(const instance *i, const fmi_call *call, const char *values) {
  fmi_refuse(i, "%s: the pointer to the %s is NULL.", call->name, values);
  return 0;
}

fmi_status fmi_absent(const instance *i, const char *name, const char *why) {
  return i ? fmi_refuse(i, "%s is not available: %s.", name, why) : FMI_ERROR;
}
