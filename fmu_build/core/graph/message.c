/* message.c - texts of errors, numbers and ranges. */
#include "core/graph/message.h"

#include <stdio.h>
#include <string.h>

#define E(id, text) text,
static const char *const TEXTS[] = {HYST_ERRORS(E)};
#undef E

/* formats a number with a decimal point; printf may use a decimal comma, which would read as two numbers */
const char *hyst_number(char *to, size_t size, double v) {
  if (v == HYST_INF || v == -HYST_INF) snprintf(to, size, v > 0 ? "inf" : "-inf");
  else if (v != v) snprintf(to, size, "nan");
  else snprintf(to, size, "%.10g", v);
  for (char *c = strchr(to, ','); c; c = NULL) *c = '.';
  return to;
}

/* "a float in [0, inf)", "an int in [1, 9]", "a bool (0 or 1)", "one of zoh|foh (0, 1, ...)" */
void hyst_interval(const hyst_var *row, char *to, size_t size) {
  char lo[32], hi[32];
  const int open = row->lo == HYST_POSITIVE;
  hyst_number(lo, sizeof lo, open ? 0 : row->lo);
  hyst_number(hi, sizeof hi, row->hi);
  if (!strcmp(row->type, "real") || !strcmp(row->type, "int"))
    snprintf(to, size, "%s in %s%s, %s%s", *row->type == 'r' ? "a float" : "an int",
             open || row->lo == -HYST_INF ? "(" : "[", lo, hi, row->hi == HYST_INF ? ")" : "]");
  else if (!strcmp(row->type, "bool")) snprintf(to, size, "a bool (0 or 1)");
  else snprintf(to, size, "one of %s (0, 1, ...)", row->type);
}

int hyst_message(const hyst_error *e, char *text, size_t size) {
  char interval[160], value[32];
  if (e->row) { /* HYST_E_VALUE */
    hyst_interval(e->row, interval, sizeof interval);
    hyst_number(value, sizeof value, e->value);
    const char *role = e->row->kind == HYST_INPUT ? "input" : "parameter";
    return snprintf(text, size, "The '%s' %s of %s must be %s. Got %s instead.", e->variable, role, e->block, interval,
                    value);
  }
  return snprintf(text, size, "%s%s%s%s%s%s%s", TEXTS[e->status], *e->block ? " at " : "", e->block,
                  *e->variable ? "." : "", e->variable, *e->text ? ": " : "", e->text);
}
