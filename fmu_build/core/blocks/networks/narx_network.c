/* NARX network: one hidden layer of tanh and a linear part, on lags of the input and of the own output,
 *   y_k = a'z + W2 tanh(W1 z + b1) + b2,   z = u_k .. u_(k-n_u+1), y_(k-1) .. y_(k-n_y).
 * The memory of a hysteresis lies in the fed-back outputs.  Before the first input, u equals it and y is y0. */
#include "core/elementary/elementary.h"
#include "core/hyst.h"

#define DIMS(D)                                                \
  D(n_u, 2, 1, 1000, "number of inputs u_k to u_(k-n_u+1)")    \
  D(n_y, 1, 0, 1000, "number of outputs y_(k-1) to y_(k-n_y)") \
  D(n_hidden, 4, 1, 10000, "number of hidden neurons")
#define VARS(V)                                                                                                      \
  V(a, PARAM, n_u + n_y, "real", "1", 0.1, -HYST_INF, HYST_INF, "linear weights of the inputs, then of the outputs") \
  V(W1, PARAM, n_hidden *(n_u + n_y), "real", "1", 0.2, -HYST_INF, HYST_INF, "hidden weights, one row per neuron")   \
  V(b1, PARAM, n_hidden, "real", "1", 0.0, -HYST_INF, HYST_INF, "hidden biases")                                     \
  V(W2, PARAM, n_hidden, "real", "1", 0.1, -HYST_INF, HYST_INF, "output weights")                                    \
  V(b2, PARAM, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output bias")                                              \
  V(y0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output before the first input")                            \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                                     \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                                   \
  V(past_u, STATE, n_u, "real", "1", 0.0, -HYST_INF, HYST_INF, "u_k and older inputs, newest first")                 \
  V(past_y, STATE, n_y, "real", "1", 0.0, -HYST_INF, HYST_INF, "y_(k-1) and older outputs, newest first")

typedef struct {
  const double *past_u, *past_y;
  double u; /* replaces the first element of past_u */
  int n_u, n_y;
} lags;

static double weighted(const lags *z, const double *w) {
  double sum = w[0] * z->u;
  for (int i = 1; i < z->n_u; i++) sum += w[i] * z->past_u[i];
  w += z->n_u;
  for (int i = 0; i < z->n_y; i++) sum += w[i] * z->past_y[i];
  return sum;
}

static double evaluate(lags z, const double *a, const double *W1, const double *b1, const double *W2, double b2,
                       int n_hidden) {
  double sum = weighted(&z, a) + b2;
  for (int i = 0; i < n_hidden; i++, W1 += z.n_u + z.n_y) sum += W2[i] * hyst_tanh(weighted(&z, W1) + b1[i]);
  return sum;
}

static void shift(double *past, int n, double now) {
  for (int i = n - 1; i > 0; i--) past[i] = past[i - 1];
  if (n > 0) past[0] = now;
}

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const lags z = {past_u, past_y, *u, n_u, n_y};
  *y = evaluate(z, a, W1, b1, W2, *b2, n_hidden);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  if (dt > 0) {
    const lags z = {past_u, past_y, past_u[0], n_u, n_y};
    if (n_y > 0) shift(past_y, n_y, evaluate(z, a, W1, b1, W2, *b2, n_hidden));
    shift(past_u, n_u, *u);
    return;
  }
  for (int i = 0; i < n_u; i++) past_u[i] = *u;
  for (int i = 0; i < n_y; i++) past_y[i] = *y0;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const lags z = {past_u, past_y, *u, n_u, n_y};
  double slope = a[0];
  for (int i = 0; i < n_hidden; i++, W1 += n_u + n_y) {
    const double t = hyst_tanh(weighted(&z, W1) + b1[i]);
    slope += W2[i] * (1 - t * t) * W1[0];
  }
  *t_y = slope * *s_u;
}
HYST_BLOCK(narx_network,
           (.text = "NARX network: one hidden layer with lags of input and output",
            .equation = "y_k = a'z + W2 tanh(W1 z + b1) + b2, z = u_k .. u_(k-n_u+1), y_(k-1) .. y_(k-n_y)",
            .source = "Narendra & Parthasarathy 1990; Leontaritis & Billings 1985 (NARX)", .family = "networks",
            .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .output = output, .tangent = tangent, .update = update)
