/* error.c - errors of the core, and the check of a value against its row of the table. */
#include "core/graph/error.h"

#include <string.h>

void hyst_append(char *to, size_t size, const char *text) {
  const size_t have = strlen(to), more = strlen(text), room = size - 1 - have;
  memcpy(to + have, text, more < room ? more : room);
  to[have + (more < room ? more : room)] = 0;
}

hyst_status hyst_fail(hyst_error *e, hyst_status status, const char *block, const char *variable, const char *text) {
  memset(e, 0, sizeof *e);
  e->status = status;
  if (block) hyst_append(e->block, sizeof e->block, block);
  if (variable) hyst_append(e->variable, sizeof e->variable, variable);
  if (text) hyst_append(e->text, sizeof e->text, text);
  return status;
}

hyst_status hyst_fail_value(hyst_error *e, const char *block, const hyst_var *row, double value) {
  hyst_fail(e, HYST_E_VALUE, block, row->name, NULL);
  e->row = row;
  e->value = value;
  return HYST_E_VALUE;
}

int hyst_type(const hyst_var *row) {
  return !strcmp(row->type, "real")   ? HYST_REAL
         : !strcmp(row->type, "int")  ? HYST_INT
         : !strcmp(row->type, "bool") ? HYST_BOOL
                                      : HYST_CHOICE;
}

hyst_status hyst_check(const hyst_var *row, double value) {
  if (!(value - value == 0)) return HYST_E_VALUE; /* NaN or infinite */
  if (value < row->lo || value > row->hi) return HYST_E_VALUE;
  const int type = hyst_type(row);
  if (type == HYST_REAL) return HYST_E_OK;
  if (value > 2147483647.0 || value < -2147483648.0 || value != (double)(int32_t)value) return HYST_E_VALUE;
  double choices = type == HYST_BOOL ? 2 : 1; /* number of choices of an enumeration: bars plus one */
  for (const char *s = row->type; *s; s++) choices += *s == '|';
  return type != HYST_INT && (value < 0 || value >= choices) ? HYST_E_VALUE : HYST_E_OK;
}
