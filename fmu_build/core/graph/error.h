/* error.h - how the core says what went wrong, and where. */
#ifndef HYST_ERROR_H
#define HYST_ERROR_H
#include "core/graph/graph.h"

void hyst_append(char *to, size_t size, const char *text); /* as much as fits */
/* both fill *e (names and rule may be NULL) and return its status */
hyst_status hyst_fail(hyst_error *e, hyst_status status, const char *block, const char *variable, const char *text);
hyst_status hyst_fail_value(hyst_error *e, const char *block, const hyst_var *row, double value);
#endif
