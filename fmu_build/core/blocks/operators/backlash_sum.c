/* Sum of backlash (play) operators with one plain state each: the independent reference plant.
 * It deliberately does not use the turning-point machine, so that the two can be compared.
 * A "deadband width" is the full width, as in Simulink: r = width / 2.  Zhao & Tan 2008, section II (ten widths). */
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
HYST_SENSITIVITY_FN(sensitivity) {
  HYST_OPEN_SENSITIVITY
  const int64_t dense = columns_->dense;
  for (int64_t c = 0; c < n_columns; c++) t_y[c] = c < dense ? *w0 * s_u[c] : 0;
  for (const hyst_change *e = s_w0; e < end_w0; e++) t_y[e->column] += e->size * *u;
  double *row = s_z;
  for (int i = 0; i < n; i++, row += n_columns) {
    const int side = hyst_play_side(z[i], *u, r[i]);
    z[i] = hyst_play(z[i], *u, r[i]);
    for (int64_t c = 0; side != 0 && c < dense; c++) row[c] = s_u[c];
    for (; s_r < end_r && s_r->element == i; s_r++) {
      const int64_t c = s_r->column;
      if (side != 0) row[c] = (c < dense ? row[c] : 0) + side * s_r->size;
      if (c >= dense) t_y[c] += w[i] * row[c];
    }
    for (; s_z0 < end_z0 && s_z0->element == i; s_z0++) {
      const int64_t c = s_z0->column;
      if (side != 0 && c >= dense) row[c] = 0;
      if (c >= dense) t_y[c] += w[i] * row[c];
    }
    for (; s_w < end_w && s_w->element == i; s_w++) t_y[s_w->column] += s_w->size * z[i];
    for (int64_t c = 0; c < dense; c++) t_y[c] += w[i] * row[c];
  }
}
HYST_BLOCK(backlash_sum,
           (.text = "Weighted sum of backlash (play) operators, plain states",
            .equation = "z_i = max(u - r_i, min(u + r_i, z_i)), y = w0 u + sum_i w_i z_i",
            .source = "Zhao & Tan 2008, section II; Krejci & Kuhnen 2001, eq. 3", .family = "operators",
            .tolerance = "rounding", .sensitivity = sensitivity),
           .rate = HYST_HYSTERETIC, .init = init, .output = output, .tangent = tangent, .update = update)
