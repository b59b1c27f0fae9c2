/* error.h - errors of the core with their place, and the check of values against rows of a table. */
#ifndef HYST_ERROR_H
#define HYST_ERROR_H
#include "core/hyst.h"

/* An error and its place; hyst_message() writes the sentence. */
typedef struct {
  hyst_status status;
  char block[64], variable[64], text[192]; /* instance, name, rule; "" if not applicable */
  const hyst_var *row;                     /* variable whose range is violated, or NULL */
  double value;
} hyst_error;
void hyst_append(char *to, size_t size, const char *text); /* truncated if necessary */
/* both fill *e (names and rule may be NULL) and return its status */
hyst_status hyst_fail(hyst_error *e, hyst_status status, const char *block, const char *variable, const char *text);
hyst_status hyst_fail_value(hyst_error *e, const char *block, const hyst_var *row, double value);

/* types of the table, as bits */
enum { HYST_REAL = 1, HYST_INT = 2, HYST_BOOL = 4, HYST_CHOICE = 8 };
int hyst_type(const hyst_var *row); /* returns one of the bits */
/* Checks a value of a variable: refuses NaN, infinities, values out of range, fractional values of an int. */
hyst_status hyst_check(const hyst_var *row, double value);
#endif
