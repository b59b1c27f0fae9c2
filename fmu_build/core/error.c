/* error.c - errors of the core, and the check of one value against its row of the table. */
#include "error.h"

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

hyst_status hyst_check(const hyst_var *row, double value) {
  if (!(value - value == 0)) return HYST_E_VALUE; /* NaN or infinite */
  if (value < row->lo || value > row->hi) return HYST_E_VALUE;
  if (strcmp(row->type, "real") != 0) {
    if (value > 2147483647.0 || value < -2147483648.0 || value != (double)(int32_t)value) return HYST_E_VALUE;
    double choices = 1; /* of an enumeration: the bars plus one */
    for (const char *s = row->type; *s; s++) choices += *s == '|';
    if (!strcmp(row->type, "bool")) choices = 2;
    if (strcmp(row->type, "int") != 0 && (value < 0 || value >= choices)) return HYST_E_VALUE;
  }
  return HYST_E_OK;
}
