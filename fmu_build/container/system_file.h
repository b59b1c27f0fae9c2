/* system_file.h - reads resources/system.txt: the units of a container and how they are coupled.
 *
 * Words separated by blanks; doubles are the 16 hexadecimal digits of their bits, strings are percent-encoded, "" is
 * "%", TYPE is a letter of value.h.
 *
 *   hystfmu-system 2 token STRING
 *   coupling SCHEME RIPPLE STEP FINE_STEP    0 Gauss-Seidel, 1 Jacobi
 *   values N { TYPE START }                  outputs of all units, side by side; d, i or ?, by which they are read
 *   units N
 * and for each unit
 *   unit NAME FMI LIBRARY RESOURCES TOKEN PERIOD SUBSTEPS LENGTH FIRST_VALUE
 *   structural N { TYPE REFERENCE N VALUE... }   set in Configuration Mode; one string is one value
 *   parameters N { the same }
 *   inputs N { the same }                        constant inputs
 *   connected N_REFERENCES N_ELEMENTS { TYPE NAME REFERENCE N { SOURCE START } }
 *                                                SOURCE: index of a value, -1: constant
 *   outputs N_REFERENCES N_ELEMENTS { TYPE NAME REFERENCE N } */
#ifndef HYST_SYSTEM_FILE_H
#define HYST_SYSTEM_FILE_H
#include "container/unit.h"

enum { MOST_UNITS = 200, MOST_VALUES = 100000 };

typedef struct {
  char *token;
  master m;
  char *types; /* of the values */
  unit *units;
} system_file;

/* `text` ends with 0 and is written to.  true with what is wrong; system_free() in both cases. */
bool system_read(char *text, system_file *s, char *why, size_t size);
void system_free(system_file *s);
#endif
