/* value.h - types of FMI variables: a value as a double of the master, as an argument of a call, and as a word of text.
 *
 * A letter stands for a type, as in Python's `struct`: d Real or Float64, f Float32, b B h H i I q Q Int8 to UInt64
 * (i is also Integer and Enumeration of FMI 2.0), e Enumeration of FMI 3.0, ? Boolean, s String. */
#ifndef HYST_CONTAINER_VALUE_H
#define HYST_CONTAINER_VALUE_H
#include <stdbool.h>
#include <stddef.h>

typedef struct {
  char letter;
  size_t size;
  const char *name; /* of its functions: Set<name>, Get<name> */
} value_type;

/* NULL if this version of FMI has no such type */
const value_type *value_type_of(char letter, int fmi);
/* The rules of `carried.py`: whole numbers are rounded to the nearest, a boolean is true from one half on.  true if x
 * does not fit. */
bool value_from_double(const value_type *t, double x, void *to);
double value_to_double(const value_type *t, const void *from);
/* a number from its decimal digits or, of a real number, from the 16 hexadecimal digits of the bits of a double; true
 * if it is none */
bool value_from_text(const value_type *t, const char *word, void *to);
#endif
