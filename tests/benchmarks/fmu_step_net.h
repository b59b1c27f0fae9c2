/* fmu_step_net.h - the net of bench_fmu.py in plain C with libm; the benchmark generates fmu_step_weights.h
 * (W1, b1, W2, b2, TANH). */
#include <math.h>

#include "fmu_step_weights.h"

static double net(const double *u) {
  double y = b2;
  for (int i = 0; i < 12; i++) {
    const double a = b1[i] + W1[2 * i] * u[0] + W1[2 * i + 1] * u[1];
    y += W2[i] * (TANH ? tanh(a) : 1 / (1 + exp(-a)));
  }
  return y;
}
