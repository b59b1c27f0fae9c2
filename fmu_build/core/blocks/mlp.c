/* Multilayer perceptron with one hidden layer and a linear output layer: the readout of an expanded input space.
 * Zhao & Tan 2008, section IV (2-12-1, sigmoid and linear); Shen & Ma 2017 (2-5-1).
 * Every hidden value is added to all outputs as soon as it is known, so no room for the hidden layer is needed. */
#include "../elementary.h"
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

static double activate(int kind, double a) {
  return kind == SIGMOID ? hyst_sigmoid(a) : kind == TANH ? hyst_tanh(a) : a > 0 ? a : 0;
}

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const int kind = (int)*activation;
  for (int j = 0; j < n_out; j++) y[j] = b2[j];
  for (int i = 0; i < n_hidden; i++, W1 += n_in) {
    double a = b1[i];
    for (int k = 0; k < n_in; k++) a += W1[k] * u[k];
    a = activate(kind, a);
    for (int j = 0; j < n_out; j++) y[j] += W2[(ptrdiff_t)j * n_hidden + i] * a;
  }
}
HYST_BLOCK(mlp, .text = "Multilayer perceptron: one hidden layer, linear outputs",
           .equation = "y = b2 + W2 f(b1 + W1 u), f the activation", .source = "Zhao & Tan 2008, section IV",
           .flags = HYST_RATE_INDEPENDENT, .output = output)
