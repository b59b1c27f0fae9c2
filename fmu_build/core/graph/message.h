/* message.h - one sentence for every error, the same for FMU logs and for Python. */
#ifndef HYST_MESSAGE_H
#define HYST_MESSAGE_H
#include "core/graph/error.h"

int hyst_message(const hyst_error *e, char *text, size_t size);
const char *hyst_number(char *to, size_t size, double v);         /* as a person writes it; never a decimal comma; to */
void hyst_interval(const hyst_var *row, char *text, size_t size); /* its legal values in words */
#endif
