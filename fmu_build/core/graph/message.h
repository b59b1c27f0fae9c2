/* message.h - one sentence per error, the same in FMU logs and in Python. */
#ifndef HYST_MESSAGE_H
#define HYST_MESSAGE_H
#include "core/graph/error.h"

int hyst_message(const hyst_error *e, char *text, size_t size);
const char *hyst_number(char *to, size_t size, double v); /* with a decimal point in every locale; returns `to` */
void hyst_interval(const hyst_var *row, char *text, size_t size); /* writes the allowed values in words */
#endif
