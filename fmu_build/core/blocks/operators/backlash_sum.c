/* Sum of backlash (play) operators with one plain state each: the independent reference plant.
 * It deliberately does not use the turning-point machine, so that the two can be compared.
 * A "deadband width" is the full width, as in Simulink: r = width / 2.  Zhao & Tan 2008, section II (ten widths). */
#include <string.h>

#include "core/hyst.h"
#include "core/memory/play.h"

#define DIMS(D) D(n, 10, 1, 100000, "number of backlash operators")
#define VARS(V)                                                                       \
  V(w0, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "weight of the linear term") \
  V(r, PARAM, n, "real", "=u", 0.1, 0.0, HYST_INF, "half-widths of the plays")        \
  V(w, PARAM, n, "real", "1", 0.1, -HYST_INF, HYST_INF, "weights of the plays")       \
  V(z0, FIXED, n, "real", "=u", 0.0, -HYST_INF, HYST_INF, "initial play states")      \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                      \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                    \
  V(z, STATE, n, "real", "1", 0.0, -HYST_INF, HYST_INF, "play states")

HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  for (int i = 0; i < n; i++) z[i] = z0[i];
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  double sum = *w0 * *u;
  for (int i = 0; i < n; i++) sum += w[i] * hyst_play(z[i], *u, r[i]);
  *y = sum;
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  for (int i = 0; i < n; i++) z[i] = hyst_play(z[i], *u, r[i]);
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  double sum = *w0 * *s_u;
  for (int i = 0; i < n; i++) sum += w[i] * hyst_play_tangent(z[i], *u, r[i], *s_u);
  *t_y = sum;
}
/* While a play moves, its output depends on u and r; at rest, it is constant. So a column of one element changes y only
 * while the play moves, and the rows of its states are not needed. */
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  const int64_t dense = columns_->dense;
  for (int i = 0; i < n && dense > 0; i++)
    if (hyst_play_side(z[i], *u, r[i]) != 0) memcpy(s_z + i * n_columns, s_u, (size_t)dense * sizeof *s_u);
  for (; s_r < end_r; s_r++) {
    const int i = s_r->element, side = hyst_play_side(z[i], *u, r[i]);
    const int64_t c = s_r->column;
    if (c < dense) s_z[i * n_columns + c] += side * s_r->size;
    else if (side != 0 || dt == 0) t_y[c] = w[i] * side * s_r->size;
  }
  for (; s_z0 < end_z0; s_z0++) {
    const int64_t i = s_z0->element, c = s_z0->column;
    if (c >= dense && (dt == 0 || t_y[c] != 0)) /* valid until the play moves */
      t_y[c] = hyst_play_side(z[i], *u, r[i]) != 0 ? 0 : w[i] * s_z0->size;
  }
  HYST_ADVANCE(update);
  for (int64_t c = 0; c < dense; c++) t_y[c] = *w0 * s_u[c];
  for (int i = 0; i < n && dense > 0; i++)
    for (int64_t c = 0; c < dense; c++) t_y[c] += w[i] * s_z[i * n_columns + c];
  for (; s_w < end_w; s_w++) {
    double *const to = t_y + s_w->column, by = s_w->size * z[s_w->element];
    *to = s_w->column < dense ? *to + by : by;
  }
  for (; s_w0 < end_w0; s_w0++) {
    double *const to = t_y + s_w0->column, by = s_w0->size * *u;
    *to = s_w0->column < dense ? *to + by : by;
  }
}
HYST_BLOCK(backlash_sum,
           (.text = "Weighted sum of backlash (play) operators, plain states",
            .equation = "z_i = max(u - r_i, min(u + r_i, z_i)), y = w0 u + sum_i w_i z_i",
            .source = "Zhao & Tan 2008, section II; Krejci & Kuhnen 2001, eq. 3", .family = "operators",
            .tolerance = "rounding", .sensitivity = sensitivity),
           .rate = HYST_HYSTERETIC, .init = init, .output = output, .tangent = tangent, .update = update)
