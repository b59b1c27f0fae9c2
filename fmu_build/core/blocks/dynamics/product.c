/* Product of signals over a product of others: a gain that another signal sets, and its inverse.  A divisor nearer to 0
 * than `least` counts as least, with its sign. */
#include "core/hyst.h"

#define DIMS(D)                         \
  D(n, 2, 1, 1000, "number of factors") \
  D(m, 1, 0, 1000, "number of divisors")
#define VARS(V)                                                                                    \
  V(least, PARAM, 1, "real", "1", 0.001, 1e-150, HYST_INF, "smallest absolute value of a divisor") \
  V(u, INPUT, n + m, "real", "1", 0.0, -HYST_INF, HYST_INF, "the factors, then the divisors")      \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "product of the factors / product of the divisors")

static double divisor(double v, double least) { return v >= least || v <= -least ? v : v < 0 ? -least : least; }

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  double product = 1;
  for (int i = 0; i < n; i++) product *= u[i];
  for (int i = n; i < n + m; i++) product /= divisor(u[i], *least);
  *y = product;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  double product = 1, slope = 0;
  for (int i = 0; i < n; i++) {
    slope = slope * u[i] + product * s_u[i];
    product *= u[i];
  }
  for (int i = n; i < n + m; i++) {
    const double d = divisor(u[i], *least);
    const int free = u[i] > *least || u[i] < -*least || (d == u[i] && d * s_u[i] > 0); /* one-sided at the limit */
    product /= d;
    slope = (slope - (free ? product * s_u[i] : 0)) / d;
  }
  *t_y = slope;
}
HYST_BLOCK(product,
           (.text = "Product of signals, divided by a product of other signals",
            .equation = "y = u_1 .. u_n / (u_(n+1) .. u_(n+m)), each |divisor| at least `least`",
            .source = "gain scheduling (Rugh & Shamma 2000)", .family = "dynamics", .tolerance = "rounding"),
           .rate = HYST_FUNCTION, .output = output, .tangent = tangent)
