/* blocks.c - the registry: one word per block.  CMake compiles every file in blocks/; a block that is not listed here
 * is not part of the library (a test compares the two lists). */
#include "core/blocks.h"

#include <string.h>

#ifndef HYST_BLOCKS /* a source FMU contains only the blocks of its graph */
/* every word has its own line, so that a new word adds one line at any place */
/* clang-format off */
#define HYST_BLOCKS(B) \
  B(adaptive_inverse) \
  B(amplifier) \
  B(backlash_sum) \
  B(bouc_wen) \
  B(bouc_wen_oscillator) \
  B(bumpless_transfer) \
  B(coleman_hodgdon) \
  B(constraint_factor) \
  B(constraint_factor_inverse) \
  B(creep) \
  B(creep_inverse) \
  B(dead_zones) \
  B(delay) \
  B(differentiator) \
  B(disturbance) \
  B(disturbance_observer) \
  B(duhem) \
  B(duhem_oscillator) \
  B(feedforward) \
  B(implicit_inverse) \
  B(in_range) \
  B(iterative_learning) \
  B(jiles_atherton) \
  B(krasnoselskii_pokrovskii) \
  B(lead_lag) \
  B(lugre) \
  B(maxwell_slip_oscillator) \
  B(mlp) \
  B(modes) \
  B(modified_bouc_wen) \
  B(narx_network) \
  B(noise) \
  B(pid) \
  B(play_bank) \
  B(polynomial_narx) \
  B(prandtl_ishlinskii) \
  B(prandtl_ishlinskii_inverse) \
  B(preisach) \
  B(product) \
  B(quantiser) \
  B(recursive_least_squares) \
  B(reference) \
  B(repetitive) \
  B(scaling) \
  B(sliding_mode) \
  B(sum) \
  B(super_twisting) \
  B(transfer_function) \
  B(zhao_tan) \
  B(zhao_tan_inverse) \
  B(zhao_tan_inverse_reconstructed) \
  /* end of the list */
/* clang-format on */
#endif

#define B(id) extern const hyst_block hyst_##id;
HYST_BLOCKS(B)
#undef B
#define B(id) &hyst_##id,
const hyst_block *const hyst_blocks[] = {HYST_BLOCKS(B) NULL};
#undef B

const hyst_block *hyst_find(const char *name) {
  for (int i = 0; hyst_blocks[i]; i++)
    if (!strcmp(name, hyst_blocks[i]->name)) return hyst_blocks[i];
  return NULL;
}
