/* error.h - how the core says what went wrong, and where; which values a row of a table allows. */
#ifndef HYST_ERROR_H
#define HYST_ERROR_H
#include "core/hyst.h"

/* What went wrong, and where; hyst_message() makes the sentence. */
typedef struct {
  hyst_status status;
  char block[64], variable[64], text[192]; /* instance, name, rule; "" where it does not apply */
  const hyst_var *row;                     /* whose range was violated, or NULL */
  double value;
} hyst_error;
void hyst_append(char *to, size_t size, const char *text); /* as much as fits */
/* both fill *e (names and rule may be NULL) and return its status */
hyst_status hyst_fail(hyst_error *e, hyst_status status, const char *block, const char *variable, const char *text);
hyst_status hyst_fail_value(hyst_error *e, const char *block, const hyst_var *row, double value);

/* types of the table, as bits */
enum { HYST_REAL = 1, HYST_INT = 2, HYST_BOOL = 4, HYST_CHOICE = 8 };
int hyst_type(const hyst_var *row); /* one of the bits */
/* Is the value legal for this variable?  Refuses NaN, infinities, values out of range, fractions of an int. */
hyst_status hyst_check(const hyst_var *row, double value);
#endif
