/* Duhem operator: the slope of the output depends on input, output and direction, y = k u + w,
 *   dw/du = sum_{i=0..m} B_i(u) (a_i + sum_{j=1..q} (b_ij w^j + c_ij |w| w^(j-1))),
 * with one set of coefficients for rising and one for falling u.  It is linear in them, and a Bouc-Wen operator of
 * whole n <= q is the case m = 0, a = A, b_n, c_n = -+beta, -gamma for odd n and -gamma, -+beta for even n (rising,
 * falling): no return-point memory, unlike the operators of the turning-point machine.
 *
 * The B_i are uniform B-splines of degree min(m, 2) on [-1, 1] with the sum 1, and constant outside.  With q = 1 and
 * b_i = -+r_i, a_i = +-r_i W_i, the output approaches the bound W(u) at the rate r(u), as in magnets and shape-memory
 * alloys (Tellinen, IEEE Trans. Magn. 34 (1998) 2200-2206; Likhachev & Koval, Scripta Metall. Mater. 27 (1992) 223).
 *
 * It is rate-independent, so it is integrated in u by Runge-Kutta steps of order 4, shorter than du_max, at most 10000
 * per call.  A step across w = 0, where |w| has a kink, is divided there: u at w = 0 follows from one step of du/dw =
 * 1 / f, so the order stays 4.  |w| is limited to w_max, because a polynomial is unbounded.
 * Oh & Bernstein, IEEE Trans. Autom. Control 50 (2005) 631-645 (semilinear Duhem model, m = 0, q = 1). */
#include "core/elementary/elementary.h"
#include "core/elementary/limit.h"
#include "core/hyst.h"

#define DIMS(D)                                                 \
  D(m, 0, 0, 100, "number of B-splines of the input u, less 1") \
  D(q, 1, 1, 20, "degree in the state w")
#define VARS(V)                                                                                                        \
  V(k, PARAM, 1, "real", "1", 0.5, -HYST_INF, HYST_INF, "slope of the linear term")                                    \
  V(a_rise, PARAM, m + 1, "real", "1", 0.5, -HYST_INF, HYST_INF, "rising u: weights of B_i(u)")                        \
  V(b_rise, PARAM, (m + 1) * q, "real", "1", -0.5, -HYST_INF, HYST_INF, "rising u: weights of B_i w^j, one row per i") \
  V(c_rise, PARAM, (m + 1) * q, "real", "1", -0.5, -HYST_INF, HYST_INF, "rising u: weights of B_i |w| w^(j-1)")        \
  V(a_fall, PARAM, m + 1, "real", "1", 0.5, -HYST_INF, HYST_INF, "falling u: weights of B_i(u)")                       \
  V(b_fall, PARAM, (m + 1) * q, "real", "1", 0.5, -HYST_INF, HYST_INF, "falling u: weights of B_i w^j, one row per i") \
  V(c_fall, PARAM, (m + 1) * q, "real", "1", -0.5, -HYST_INF, HYST_INF, "falling u: weights of B_i |w| w^(j-1)")       \
  V(w_max, PARAM, 1, "real", "1", 1e100, HYST_POSITIVE, 1e100, "bound of |w|")                                         \
  V(du_max, PARAM, 1, "real", "1", 0.02, HYST_POSITIVE, HYST_INF, "longest integration step in u")                     \
  V(w0, FIXED, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "w at u0")                                                    \
  V(u0, FIXED, 1, "real", "=u", 0.0, -HYST_INF, HYST_INF, "input that belongs to w0, before the first input")          \
  V(u, INPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "input")                                                       \
  V(y, OUTPUT, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "output")                                                     \
  V(u_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "last input")                                             \
  V(w_last, STATE, 1, "real", "1", 0.0, -HYST_INF, HYST_INF, "w at the last input")

#define MOST_STEPS 10000

typedef struct {
  const double *a, *b, *c;
  int m, q;
} law;

static law law_of(const double *a, const double *b, const double *c, int m, int q) {
  const law l = {a, b, c, m, q};
  return l;
}

/* the B-splines at u that are not 0, and their derivatives: numbers first to first + last */
typedef struct {
  int first, last;
  double value[3], rate[3];
} splines;

static splines splines_at(int m, double u) {
  const int cells = m < 2 ? 1 : m - 1;
  const double place = 0.5 * (hyst_clamp(u, -1, 1) + 1) * cells, inside = u > -1 && u < 1 ? 0.5 * cells : 0;
  const int first = place < cells ? (int)place : cells - 1;
  const double t = place - first;
  const splines constant = {0, 0, {1}, {0}}, line = {0, 1, {1 - t, t}, {-inside, inside}};
  const splines parabola = {first,
                            2,
                            {0.5 * (1 - t) * (1 - t), 0.5 + t * (1 - t), 0.5 * t * t},
                            {(t - 1) * inside, (1 - 2 * t) * inside, t * inside}};
  return m == 0 ? constant : m == 1 ? line : parabola;
}

static double slope(const law *l, double u, double w) {
  const double size = hyst_fabs(w);
  const splines s = splines_at(l->m, u);
  double f = 0;
  for (int k = 0; k <= s.last; k++) {
    const ptrdiff_t i = s.first + k;
    const double *b = l->b + i * l->q, *c = l->c + i * l->q;
    double inner = 0;
    for (int j = l->q - 1; j >= 0; j--) inner = inner * w + (b[j] * w + c[j] * size);
    f += s.value[k] * (l->a[i] + inner);
  }
  return f;
}

static double runge_kutta(const law *l, double u, double w, double h) {
  const double k1 = slope(l, u, w), k2 = slope(l, u + 0.5 * h, w + 0.5 * h * k1),
               k3 = slope(l, u + 0.5 * h, w + 0.5 * h * k2), k4 = slope(l, u + h, w + h * k3);
  return w + h / 6 * (k1 + 2 * (k2 + k3) + k4);
}

/* returns the change of u at which w reaches 0: one Runge-Kutta step with w as the independent variable */
static double way_to_zero(const law *l, double u, double w) {
  const double k1 = 1 / slope(l, u, w), k2 = 1 / slope(l, u - 0.5 * w * k1, 0.5 * w),
               k3 = 1 / slope(l, u - 0.5 * w * k2, 0.5 * w), k4 = 1 / slope(l, u - w * k3, 0);
  return -w / 6 * (k1 + 2 * (k2 + k3) + k4);
}

static double step(const law *l, double u, double w, double h) {
  const double next = runge_kutta(l, u, w, h);
  if (next != next) return hyst_copysign(HYST_INF, h * slope(l, u, w)); /* the step overflowed before the bound */
  if (!(w * next < 0)) return next;
  const double way = way_to_zero(l, u, w);
  return way * h > 0 && hyst_fabs(way) < hyst_fabs(h) ? runge_kutta(l, u + way, 0, h - way) : next;
}

static int n_steps(double du, double du_max) {
  const double steps = hyst_fabs(du) / du_max;
  return steps < MOST_STEPS ? (int)steps + 1 : MOST_STEPS;
}

static double advance(law rise, law fall, double w_max, double du_max, double u_last, double w, double u) {
  if (u == u_last) return w;
  const law *l = u > u_last ? &rise : &fall;
  const double du = u - u_last;
  const int m = n_steps(du, du_max);
  for (int i = 0; i < m; i++) w = hyst_clamp(step(l, u_last + i * (du / m), w, du / m), -w_max, w_max);
  return w;
}

HYST_PREPARE_FN(prepare) {
  HYST_OPEN_PREPARE
  return hyst_fabs(*w0) > *w_max ? "|w0| must be at most w_max" : NULL;
}
HYST_INIT_FN(init) {
  HYST_OPEN_INIT
  *u_last = *u0;
  *w_last = *w0;
}
HYST_OUTPUT_FN(output) {
  HYST_OPEN_OUTPUT
  const law rise = law_of(a_rise, b_rise, c_rise, m, q), fall = law_of(a_fall, b_fall, c_fall, m, q);
  *y = *k * *u + advance(rise, fall, *w_max, *du_max, *u_last, *w_last, *u);
}
HYST_UPDATE_FN(update) {
  HYST_OPEN_UPDATE
  const law rise = law_of(a_rise, b_rise, c_rise, m, q), fall = law_of(a_fall, b_fall, c_fall, m, q);
  *w_last = advance(rise, fall, *w_max, *du_max, *u_last, *w_last, *u);
  *u_last = *u;
}

/* ---- the derivative of the steps ----------------------------------------------------------------------------------
 * The slope of the law at the end is the derivative of the exact curve. For steep laws and long steps, it differs by
 * some tenths of a percent from the derivative of output(). */
typedef struct {
  double value, tangent;
} dual;

static dual plus(dual a, double k, dual b) {
  const dual sum = {a.value + k * b.value, a.tangent + k * b.tangent};
  return sum;
}
static dual times(dual a, dual b) {
  const dual product = {a.value * b.value, a.value * b.tangent + a.tangent * b.value};
  return product;
}
static dual slope_dual(const law *l, dual u, dual w) {
  const dual size = {hyst_fabs(w.value), w.value == 0 ? hyst_fabs(w.tangent) : w.value < 0 ? -w.tangent : w.tangent};
  const splines s = splines_at(l->m, u.value);
  dual f = {0, 0};
  for (int k = 0; k <= s.last; k++) {
    const ptrdiff_t i = s.first + k;
    const dual weight = {s.value[k], s.rate[k] * u.tangent};
    dual inner = {0, 0};
    for (int j = l->q - 1; j >= 0; j--)
      inner = plus(plus(times(inner, w), l->b[i * l->q + j], w), l->c[i * l->q + j], size);
    inner.value += l->a[i];
    f = plus(f, 1, times(weight, inner));
  }
  return f;
}
static dual runge_kutta_dual(const law *l, dual u, dual w, dual h) {
  const dual middle = plus(u, 0.5, h), k1 = slope_dual(l, u, w), k2 = slope_dual(l, middle, plus(w, 0.5, times(h, k1))),
             k3 = slope_dual(l, middle, plus(w, 0.5, times(h, k2))),
             k4 = slope_dual(l, plus(u, 1, h), plus(w, 1, times(h, k3)));
  return plus(w, 1.0 / 6, times(h, plus(plus(k1, 2, plus(k2, 1, k3)), 1, k4)));
}
static dual reciprocal_slope(const law *l, dual u, dual w) {
  const dual f = slope_dual(l, u, w), r = {1 / f.value, -f.tangent / (f.value * f.value)};
  return r;
}
static dual way_to_zero_dual(const law *l, dual u, dual w) {
  const dual zero = {0, 0}, half = {0.5 * w.value, 0.5 * w.tangent}, k1 = reciprocal_slope(l, u, w),
             k2 = reciprocal_slope(l, plus(u, -1, times(half, k1)), half),
             k3 = reciprocal_slope(l, plus(u, -1, times(half, k2)), half),
             k4 = reciprocal_slope(l, plus(u, -1, times(w, k3)), zero);
  return plus(zero, -1.0 / 6, times(w, plus(plus(k1, 2, plus(k2, 1, k3)), 1, k4)));
}
static dual step_dual(const law *l, dual u, dual w, dual h) {
  const dual next = runge_kutta_dual(l, u, w, h), zero = {0, 0};
  if (next.value != next.value) { /* step to the bound */
    const dual beyond = {step(l, u.value, w.value, h.value), 0};
    return beyond;
  }
  if (!(w.value * next.value < 0)) return next;
  const dual way = way_to_zero_dual(l, u, w), rest = plus(h, -1, way);
  const int cut = way.value * h.value > 0 && hyst_fabs(way.value) < hyst_fabs(h.value);
  return cut ? runge_kutta_dual(l, plus(u, 1, way), zero, rest) : next;
}

HYST_TANGENT_FN(tangent) {
  HYST_OPEN_TANGENT
  const double du = *u - *u_last;
  const law rise = law_of(a_rise, b_rise, c_rise, m, q), fall = law_of(a_fall, b_fall, c_fall, m, q),
            *l = du > 0 || (du == 0 && *s_u > 0) ? &rise : &fall;
  const int n = n_steps(du, *du_max);
  const dual h = {du / n, *s_u / n}, from = {*u_last, 0};
  dual w = {*w_last, 0};
  for (int i = 0; i < n; i++) {
    w = step_dual(l, plus(from, i, h), w, h);
    w.tangent = hyst_clamp_tangent(w.value, -*w_max, *w_max, w.tangent);
    w.value = hyst_clamp(w.value, -*w_max, *w_max);
  }
  *t_y = *k * *s_u + w.tangent;
}
HYST_BLOCK(duhem,
           (.text = "Duhem operator with slopes for rising and falling input",
            .equation = "dw/du = sum_i B_i(u) (a_i + sum_j (b_ij w^j + c_ij |w| w^(j-1))), y = k u + w",
            .source = "Oh & Bernstein 2005; Coleman & Hodgdon 1986 (Duhem's form)", .family = "operators",
            .tolerance = "integration", .rule_error = 1e-4),
           .rate = HYST_HYSTERETIC, .prepare = prepare, .init = init, .output = output, .tangent = tangent,
           .update = update)
