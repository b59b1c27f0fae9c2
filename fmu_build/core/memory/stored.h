/* stored.h - counts and places that a block keeps in its memory.  A saved state may come from anywhere: whatever number
 * stands there, it never leads outside. */
#ifndef HYST_STORED_H
#define HYST_STORED_H

/* the whole number 0..most; another one, or none: 0 */
static inline int hyst_stored(double value, int most) { return value >= 0 && value <= most ? (int)value : 0; }

#endif
