/* return_point.h - init(), output() and update() of a block that consists of the turning-point machine only, from
 *   memory   the row of the table with the extrema            out    the output
 *   input    the signal of the extrema                        TURN   the hyst_turn to the current input
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
