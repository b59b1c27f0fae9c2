/* layout.h - places of the elements of variables in the arrays p, u, y and x of a block. */
#ifndef HYST_LAYOUT_H
#define HYST_LAYOUT_H
#include "core/hyst.h"

static inline int hyst_is_parameter(hyst_kind k) { return k == HYST_PARAM || k == HYST_FIXED; }

/* place of a variable in its array */
static inline int64_t hyst_place(const hyst_block *b, const int *dim, int var) {
  int64_t at = 0;
  for (int v = 0; v < var; v++) {
    const hyst_kind k = b->vars[v].kind, own = b->vars[var].kind;
    const int same = own <= HYST_DERIVED  ? k <= HYST_DERIVED
                     : own <= HYST_TIME   ? k == HYST_INPUT || k == HYST_TIME
                     : own == HYST_OUTPUT ? k == HYST_OUTPUT
                                          : k >= HYST_CSTATE;
    if (same) at += b->size(dim, v);
  }
  return at;
}
#endif
