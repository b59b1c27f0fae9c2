/* Multilayer perceptron with one hidden layer and a linear output layer: the readout of an expanded input space.
 * Zhao & Tan 2008, section IV (2-12-1, sigmoid and linear); Shen & Ma 2017 (2-5-1).
 * Hidden values are computed and added to all outputs in groups, so the hidden layer needs no storage. */
#include "core/elementary/elementary_lanes.h"
#include "core/hyst.h"

#define DIMS(D)                                         \
  D(n_in, 1, 1, 10000, "number of inputs")              \
  D(n_hidden, 12, 1, 10000, "number of hidden neurons") \
  D(n_out, 1, 1, 10000, "number of outputs")
#define VARS(V)                                                                                                    \
  V(W1, PARAM, n_hidden *n_in, "real", "1", 1.0, -HYST_INF, HYST_INF, "hidden weights, one row per hidden neuron") \
  V(b1, PARAM, n_hidden, "real", "1", 0.0, -HYST_INF, HYST_INF, "hidden biases")                                   \
  V(W2, PARAM, n_out *n_hidden, "real", "1", 1.0, -HYST_INF, HYST_INF, "output weights, one row per output")       \
  V(b2, PARAM, n_out, "real", "1", 0.0, -HYST_INF, HYST_INF, "output biases")                                      \
  V(activation, FIXED, 1, "sigmoid|tanh|relu", "1", 0, 0, 2, "activation of the hidden neurons")                   \
  V(u, INPUT, n_in, "real", "1", 0.0, -HYST_INF, HYST_INF, "inputs")                                               \
  V(y, OUTPUT, n_out, "real", "1", 0.0, -HYST_INF, HYST_INF, "outputs")

enum { SIGMOID, TANH, RELU };
enum { SIDE_BY_SIDE = 4 };

static inline void relu(hyst_lanes *a, int n) {
  const hyst_lanes zero = hyst_lanes_all(0);
  for (int i = 0; i < n; i++) a[i] = hyst_lanes_choose((hyst_lanes_bits)(a[i] > zero), a[i], zero);
}

/* computes b + W u for m HYST_LANES neurons in parallel, because a single sum waits for each addition */
static inline void weighted(hyst_lanes *a, const double *b, const double *W, const double *u, int n, int m) {
  hyst_lanes sum[SIDE_BY_SIDE];
  for (int i = 0; i < m; i++) sum[i] = hyst_lanes_of(b[HYST_LANES * i], b[HYST_LANES * i + HYST_LANES - 1]);
  for (int k = 0; k < n; k++)
    for (int i = 0; i < m; i++) {
      const double *w = W + (ptrdiff_t)HYST_LANES * i * n + k;
      sum[i] += hyst_lanes_of(w[0], w[(HYST_LANES - 1) * n]) * u[k];
    }
  for (int i = 0; i < m; i++) a[i] = sum[i];
}

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const int kind = (int)*activation, most = HYST_LANES * HYST_LANES_MOST;
  for (int first = 0; first < n_hidden; first += most) {
    const int n = n_hidden - first < most ? n_hidden - first : most, n_a = (n + HYST_LANES - 1) / HYST_LANES;
    const double *w = W1 + (ptrdiff_t)first * n_in, *b = b1 + first;
    hyst_lanes a[HYST_LANES_MOST];
    int i = 0;
    for (; i + SIDE_BY_SIDE <= n / HYST_LANES; i += SIDE_BY_SIDE)
      weighted(a + i, b + HYST_LANES * i, w + (ptrdiff_t)HYST_LANES * i * n_in, u, n_in, SIDE_BY_SIDE);
    const double *b_rest = b + HYST_LANES * i, *w_rest = w + (ptrdiff_t)HYST_LANES * i * n_in;
    switch (n / HYST_LANES - i) {
      case 3: weighted(a + i, b_rest, w_rest, u, n_in, 3); break;
      case 2: weighted(a + i, b_rest, w_rest, u, n_in, 2); break;
      case 1: weighted(a + i, b_rest, w_rest, u, n_in, 1);
    }
    if (n % HYST_LANES) { /* an unused lane */
      double sum = b[n - 1];
      for (int k = 0; k < n_in; k++) sum += w[(ptrdiff_t)(n - 1) * n_in + k] * u[k];
      a[n_a - 1] = hyst_lanes_all(sum);
    }
    if (kind == SIGMOID) hyst_lanes_sigmoid(a, n_a);
    else if (kind == TANH) hyst_lanes_tanh(a, n_a);
    else relu(a, n_a);
    for (int j = 0; j < n_out; j++) {
      const double *w = W2 + (ptrdiff_t)j * n_hidden + first;
      double sum = first == 0 ? b2[j] : y[j];
      for (int i = 0; i < n / HYST_LANES; i++, w += HYST_LANES) {
        const hyst_lanes product = hyst_lanes_of(w[0], w[HYST_LANES - 1]) * a[i];
        for (int l = 0; l < HYST_LANES; l++) sum += HYST_LANE(product, l);
      }
      y[j] = n % HYST_LANES ? sum + w[0] * HYST_LANE(a[n_a - 1], 0) : sum;
    }
  }
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const int kind = (int)*activation;
  for (int j = 0; j < n_out; j++) t_y[j] = 0;
  for (int i = 0; i < n_hidden; i++, W1 += n_in) {
    double a = b1[i], da = 0;
    for (int k = 0; k < n_in; k++) a += W1[k] * u[k], da += W1[k] * s_u[k];
    const double f = kind == SIGMOID ? hyst_sigmoid(a) : kind == TANH ? hyst_tanh(a) : 0;
    if (kind == SIGMOID) da *= f * (1 - f);
    else if (kind == TANH) da *= 1 - f * f;
    else if (a < 0 || (a == 0 && da < 0)) da = 0;
    for (int j = 0; j < n_out; j++) t_y[j] += W2[(ptrdiff_t)j * n_hidden + i] * da;
  }
}
HYST_BLOCK(mlp,
           (.text = "Multilayer perceptron: one hidden layer, linear outputs",
            .equation = "y = b2 + W2 f(b1 + W1 u), f the activation", .source = "Zhao & Tan 2008, section IV",
            .family = "networks", .tolerance = "rounding"),
           .rate = HYST_FUNCTION, .output = output, .tangent = tangent)
