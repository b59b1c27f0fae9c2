/* return_point.h - a block that is the turning-point machine and nothing else: init(), output() and update() from
 *   memory   the row of the table that holds the extrema      out    the output
 *   input    what they are extrema of                         TURN   the hyst_turn to the present input
 *   ...      input and output at which the memory starts
 * written with the names of the block's table. */
#ifndef HYST_RETURN_POINT_H
#define HYST_RETURN_POINT_H
#include "core/memory/turning_points.h"

/* clang-format off */
#define HYST_RETURN_POINT(memory, input, out, TURN, ...)                                       \
  HYST_INIT_FN(init) { HYST_OPEN_INIT hyst_tp_init(memory, depth, __VA_ARGS__); }              \
  HYST_OUTPUT_FN(output) {                                                                     \
    HYST_OPEN_OUTPUT *out = input == memory[HYST_TP_X] ? memory[HYST_TP_H] : (TURN).h;         \
  }                                                                                            \
  HYST_UPDATE_FN(update) { HYST_OPEN_UPDATE hyst_tp_commit(memory, depth, input, TURN); }
/* clang-format on */
#endif
