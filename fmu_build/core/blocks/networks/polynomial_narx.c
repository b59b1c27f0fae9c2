/* Polynomial NFIR (n_y = 0) or NARX model on the expanded input space, the basis function network of the IPMC paper:
 * y_k = theta' phi(k), phi all monomials up to degree q of the p = n_u + n_f + n_y variables
 *   z = u_(k-n_k) .. u_(k-n_k-n_u+1), f_(k-n_k) .. f_(k-n_k-n_f+1), y_(k-1) .. y_(k-n_y),
 * f an auxiliary function (a hysteretic operator of u).  n_k = 1 is that of the paper; n_k = 0 adds direct
 * feed-through of u_k.  Order of theta (eq. 11): z_i, then z_i z_j with i <= j row by row, z_i z_j z_l with i <= j <=
 * l, .., at last the constant.  Evaluated nested, z_i (theta_i + sum_j z_j (theta_ij + ..)): one product and sum per
 * monomial.  Before the first input, u and f are equal to it and y is y0. */
#include "core/hyst.h"

/* (p + q)! / (p! q!), or more than the limit of a graph */
static inline int64_t monomials(int64_t p, int64_t q) {
  int64_t n = 1;
  for (int64_t i = 1; i <= q && n < 1000000000000; i++) n = n * (p + i) / i;
  return n;
}

#define DIMS(D)                                  \
  D(n_u, 1, 1, 1000, "number of lags of u")      \
  D(n_f, 1, 0, 1000, "number of lags of f")      \
  D(n_y, 1, 0, 1000, "number of lags of y")      \
  D(q, 2, 1, 20, "highest degree of a monomial") \
  D(n_k, 1, 0, 1, "first lag of u and f; 0: direct feed-through")
#define VARS(V)                                                                                          \
  V(theta, PARAM, monomials(n_u + n_f + n_y, q), "real", "1", 0.05, -HYST_INF, HYST_INF,                 \
    "weights of the monomials by degree; the constant is last")                                          \
  V(y0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output before the first input")                \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                         \
  V(f, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "auxiliary function of the input")               \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                       \
  V(past, STATE, n_u + n_f + n_y, "real", "1", 0.0, -HYST_INF, HYST_INF, "variables z of the last step") \
  V(now, STATE, 2 * n_k, "real", "1", 0.0, -HYST_INF, HYST_INF, "u_k and f_k if n_k = 1")

enum { MOST_DEGREE = 20 };

typedef struct {
  double u, f;     /* for n_k = 0, in place of the first elements of z for u and f */
  const double *z; /* lags of u, f and y */
  int n_u, n_f, p, q, n_k;
  const double *next[MOST_DEGREE + 1]; /* next weight of each degree */
} network;

static double variable(const network *n, int i) {
  if (n->n_k > 0) return n->z[i];
  return i == 0 ? n->u : i == n->n_u && n->n_f > 0 ? n->f : n->z[i];
}

/* four sums in parallel, because a single sum waits for each product */
static inline double product(const double *a, const double *b, int n) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  int i = 0;
  for (; i + 4 <= n; i += 4) {
    s0 += a[i] * b[i];
    s1 += a[i + 1] * b[i + 1];
    s2 += a[i + 2] * b[i + 2];
    s3 += a[i + 3] * b[i + 3];
  }
  if (i + 2 <= n) {
    s0 += a[i] * b[i];
    s1 += a[i + 1] * b[i + 1];
    i += 2;
  }
  if (i < n) s2 += a[i] * b[i];
  return (s0 + s2) + (s1 + s3);
}

/* weights of the highest degree times z_first, .., z_(p-1) */
static inline double innermost(network *n, int first) {
  const double *weight = n->next[n->q] - first; /* weights that z_0 would have */
  n->next[n->q] += n->p - first;
  if (n->n_k > 0) return product(weight + first, n->z + first, n->p - first);
  double sum = 0;
  if (first == 0) sum += weight[first++] * n->u;
  if (first < n->n_u) sum += product(weight + first, n->z + first, n->n_u - first);
  if (first < n->n_u) first = n->n_u;
  if (first == n->n_u && n->n_f > 0) sum += weight[first++] * n->f;
  return sum + product(weight + first, n->z + first, n->p - first);
}

/* the two highest degrees from z_first on, which are nearly all products of a network */
static inline double last_two(network *n, int first) {
  const double *z = n->z, *one = n->next[n->q - 1], *two = n->next[n->q];
  double sum = 0;
  for (int i = first; i < n->p; i++) {
    sum += z[i] * (*one++ + product(two, z + i, n->p - i));
    two += n->p - i;
  }
  n->next[n->q - 1] = one;
  n->next[n->q] = two;
  return sum;
}

/* sum over i >= first of z_i times (its weight plus all longer products) */
static double nested(network *n, int degree, int first) {
  if (degree == n->q) return innermost(n, first);
  if (degree == n->q - 1 && n->n_k > 0) return last_two(n, first);
  double sum = 0;
  for (int i = first; i < n->p; i++) {
    const double weight = *n->next[degree]++;
    sum += variable(n, i) * (weight + nested(n, degree + 1, i));
  }
  return sum;
}

static double evaluate(network n, const double *theta) {
  for (int degree = 1; degree <= n.q; degree++) n.next[degree] = theta + monomials(n.p, degree - 1) - 1;
  return theta[monomials(n.p, n.q) - 1] + nested(&n, 1, 0);
}

static void shift(double *past, int n, double now) {
  for (int i = 0; i < n; i++) { /* the loop counts upwards, because compilers replace a loop downwards by memmove */
    const double before = past[i];
    past[i] = now;
    now = before;
  }
}

HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const network at = {*u, *f, past, n_u, n_f, n_u + n_f + n_y, q, n_k, {NULL}};
  *y = evaluate(at, theta);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  double *past_f = past + n_u, *past_y = past_f + n_f;
  if (dt > 0) {
    const network last = {past[0], n_f > 0 ? *past_f : 0, past, n_u, n_f, n_u + n_f + n_y, q, n_k, {NULL}};
    if (n_y > 0) shift(past_y, n_y, evaluate(last, theta));
    shift(past, n_u, n_k > 0 ? now[0] : *u);
    shift(past_f, n_f, n_k > 0 ? now[1] : *f);
  } else {
    for (int i = 0; i < n_u; i++) past[i] = *u;
    for (int i = 0; i < n_f; i++) past_f[i] = *f;
    for (int i = 0; i < n_y; i++) past_y[i] = *y0;
  }
  if (n_k > 0) {
    now[0] = *u;
    now[1] = *f;
  }
}
HYST_FEEDTHROUGH_FN(feedthrough) {
  HYST_OPEN_FEEDTHROUGH
  return n_k == 0;
}
typedef struct {
  double value, tangent;
} dual;

/* nested() with the tangent for (du, df), which only variables at the current time have */
static dual nested_tangent(network *n, double du, double df, int degree, int first) {
  dual sum = {0, 0};
  for (int i = first; i < n->p; i++) {
    dual factor = {*n->next[degree]++, 0};
    if (degree < n->q) {
      const dual inner = nested_tangent(n, du, df, degree + 1, i);
      factor.value += inner.value;
      factor.tangent = inner.tangent;
    }
    const double z = variable(n, i), dz = n->n_k > 0 ? 0 : i == 0 ? du : i == n->n_u && n->n_f > 0 ? df : 0;
    sum.value += z * factor.value;
    sum.tangent += dz * factor.value + z * factor.tangent;
  }
  return sum;
}
HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  network at = {*u, *f, past, n_u, n_f, n_u + n_f + n_y, q, n_k, {NULL}};
  for (int degree = 1; degree <= q; degree++) at.next[degree] = theta + monomials(at.p, degree - 1) - 1;
  *t_y = nested_tangent(&at, *s_u, *s_f, 1, 0).tangent;
}
HYST_BLOCK(polynomial_narx,
           (.text = "Polynomial of lagged inputs, auxiliary function and outputs (NFIR, NARX)",
            .equation = "y_k = theta' phi(k), phi the monomials up to degree q of lags of u, f and y",
            .source = "IPMC hysteresis model with basis function network, eq. 8-12; Leontaritis & Billings 1985 (NARX)",
            .family = "networks", .tolerance = "rounding"),
           .rate = HYST_SAMPLED, .output = output, .tangent = tangent, .update = update, .feedthrough = feedthrough)
