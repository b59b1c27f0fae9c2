/* Bank of play operators, each with an output: the expanded input space of a network (features, not a weighted sum).
 * Its states determine the whole return-point memory, so a network on it can represent every sum of plays. */
#include "core/hyst.h"
#include "core/memory/play.h"

#define DIMS(D) D(n, 10, 1, 100000, "number of plays")
#define VARS(V)                                                                  \
  V(r, PARAM, n, "real", "=u", 0.1, 0.0, HYST_INF, "half-widths of the plays")   \
  V(z0, FIXED, n, "real", "=u", 0.0, -HYST_INF, HYST_INF, "initial play states") \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                 \
  V(z, OUTPUT, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "outputs of the plays") \
  V(held, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "play states")

HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  for (int i = 0; i < n; i++) held[i] = z0[i];
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  for (int i = 0; i < n; i++) z[i] = hyst_play(held[i], *u, r[i]);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  for (int i = 0; i < n; i++) held[i] = hyst_play(held[i], *u, r[i]);
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  for (int i = 0; i < n; i++) t_z[i] = hyst_play_tangent(held[i], *u, r[i], *s_u);
}
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  double *row = s_held;
  for (int i = 0; i < n; i++, row += n_columns) {
    const int side = hyst_play_side(held[i], *u, r[i]);
    held[i] = hyst_play(held[i], *u, r[i]);
    for (int64_t c = 0; side != 0 && c < n_columns; c++) row[c] = s_u[c];
    for (; s_r < end_r && s_r->element == i; s_r++)
      if (side != 0) row[s_r->column] += side * s_r->size;
    for (int64_t c = 0; c < n_columns; c++) t_z[i * n_columns + c] = row[c];
  }
}
HYST_BLOCK(play_bank,
           (.text = "Bank of play (backlash) operators", .equation = "z_i = max(u - r_i, min(u + r_i, z_i))",
            .source = "Krejci & Kuhnen 2001, eq. 3", .family = "operators", .tolerance = "rounding",
            .sensitivity = sensitivity),
           .rate = HYST_HYSTERETIC, .init = init, .output = output, .tangent = tangent, .update = update)
