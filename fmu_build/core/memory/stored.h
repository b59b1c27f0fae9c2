/* stored.h - counts and indices in the memory of a block.  A saved state is untrusted: no number in it leads outside of
 * an array. */
#ifndef HYST_STORED_H
#define HYST_STORED_H

/* returns the integer if it is in 0..most, else 0 */
static inline int hyst_stored(double value, int most) { return value >= 0 && value <= most ? (int)value : 0; }

#endif
