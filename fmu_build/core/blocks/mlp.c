/* Multilayer perceptron with one hidden layer and a linear output layer: the readout of an expanded input space.
 * Zhao & Tan 2008, section IV (2-12-1, sigmoid and linear); Shen & Ma 2017 (2-5-1).
 * Every hidden value is added to all outputs as soon as it is known, so no room for the hidden layer is needed. */
#include "../elementary_pair.h"
#include "../hyst.h"

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

enum { PAIRS = 8 }; /* hidden neurons are computed in groups of so many pairs */

/* One stage of the function for the whole group, then the next: a single pair would wait for itself most of the time.
 * Outside the range of the formula each number alone. */
static inline void sigmoid(hyst_pair *a, int n) {
  hyst_pair_exp_parts e[PAIRS];
  int ordinary = 1;
  for (int i = 0; i < n; i++) ordinary &= hyst_sigmoid_is_ordinary(a[i][0]) & hyst_sigmoid_is_ordinary(a[i][1]);
  if (ordinary) {
    for (int i = 0; i < n; i++) e[i] = hyst_pair_exp_reduce(-a[i]);
    for (int i = 0; i < n; i++) a[i] = hyst_pair_sigmoid_ordinary(e[i]);
  } else {
    for (int i = 0; i < n; i++) a[i] = hyst_pair_of(hyst_sigmoid(a[i][0]), hyst_sigmoid(a[i][1]));
  }
}

static inline void hyperbolic_tangent(hyst_pair *a, int n) {
  hyst_pair_exp_parts e[PAIRS];
  int ordinary = 1;
  for (int i = 0; i < n; i++) ordinary &= hyst_tanh_is_ordinary(a[i][0]) & hyst_tanh_is_ordinary(a[i][1]);
  if (ordinary) {
    for (int i = 0; i < n; i++) e[i] = hyst_pair_exp_reduce(2.0 * hyst_pair_fabs(a[i]));
    for (int i = 0; i < n; i++) a[i] = hyst_pair_tanh_ordinary(e[i], a[i]);
  } else {
    for (int i = 0; i < n; i++) a[i] = hyst_pair_of(hyst_tanh(a[i][0]), hyst_tanh(a[i][1]));
  }
}

static inline void relu(hyst_pair *a, int n) {
  for (int i = 0; i < n; i++) a[i] = hyst_pair_choose((hyst_pair_bits)(a[i] > 0.0), a[i], hyst_pair_all(0.0));
}

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const int kind = (int)*activation;
  for (int first = 0; first < n_hidden; first += 2 * PAIRS) {
    const int n = n_hidden - first < 2 * PAIRS ? n_hidden - first : 2 * PAIRS, pairs = (n + 1) / 2;
    hyst_pair a[PAIRS];
    const double *w0 = W1 + (ptrdiff_t)first * n_in, *b = b1 + first;
    for (int i = 0; i < pairs; i++, w0 += 2 * n_in, b += 2) {
      const int next = 2 * i + 1 < n; /* an odd one is computed twice */
      const double *w1 = next ? w0 + n_in : w0;
      hyst_pair sum = hyst_pair_of(b[0], b[next]);
      for (int k = 0; k < n_in; k++) sum += hyst_pair_of(w0[k], w1[k]) * u[k];
      a[i] = sum;
    }
    if (kind == SIGMOID) sigmoid(a, pairs);
    else if (kind == TANH) hyperbolic_tangent(a, pairs);
    else relu(a, pairs);
    for (int j = 0; j < n_out; j++) {
      const double *w = W2 + (ptrdiff_t)j * n_hidden + first;
      double sum = first == 0 ? b2[j] : y[j];
      for (int i = 0; i < n / 2; i++, w += 2) {
        const hyst_pair product = hyst_pair_of(w[0], w[1]) * a[i];
        sum += product[0];
        sum += product[1];
      }
      y[j] = n % 2 ? sum + w[0] * a[n / 2][0] : sum;
    }
  }
}
HYST_BLOCK(mlp, .text = "Multilayer perceptron: one hidden layer, linear outputs",
           .equation = "y = b2 + W2 f(b1 + W1 u), f the activation", .source = "Zhao & Tan 2008, section IV",
           .flags = HYST_RATE_INDEPENDENT, .output = output)
