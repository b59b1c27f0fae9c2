/* blocks.h - the blocks of this library by name. */
#ifndef HYST_BLOCKS_H
#define HYST_BLOCKS_H
#include "core/hyst.h"

extern const hyst_block *const hyst_blocks[]; /* ends with NULL */
const hyst_block *hyst_find(const char *name);
#endif
