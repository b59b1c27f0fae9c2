"""Fit of a sum of plays followed by a bend, creep and given linear dynamics: weights, bend and creep.

  v = w0 x + sum_i w_i p_i[x],  b = b(v),  c = b + sum_j k_j L_{T_j}[b],  y = F[c] + offset

F is linear with static gain 1 (G0 with delay, or F = 1). L_T is a first-order lag. b is a polynomial (Legendre basis on
the range of v). The fit takes Gauss-Newton steps in the non-negative w and k. Each step is a non-negative least-squares
problem on the columns F[(1 + sum k_j L_j)[b'(v) p_i]] and F[L_j[b]]. Between the steps, linear least squares gives the
coefficients of b. This is a Wiener-Hammerstein structure that begins with a hysteresis (Giri & Bai 2010, Block-oriented
Nonlinear System Identification, ch. 1), solved as a separable problem (Golub & Pereyra 1973).

The bend may depend on covariates theta, scaled to [-1, 1], linear in each of them:

  b(v, theta) = (1 + g' theta) b(v) + sum_j theta_j b_j(v)

A covariate has one of four levels. Without a level it has no effect. With ``offset``, b_j is constant. With ``gain``,
b_j is constant and g_j is free. With ``bend``, b_j is a polynomial of the degree of b. The gains g are variables of the
Gauss-Newton steps, without bounds. With ``gain``, the inverse follows from the inverse of b(v). With ``bend``, the
inverse is found by root finding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.graph.recursion import parallel_lags
from hystfmu.identify.solvers.nonnegative import LEAST_SIZE, nonnegative

LEVELS = ("none", "offset", "gain", "bend")
STEPS = 30  # most Gauss-Newton steps
SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step, tried in turn
GAIN, HELD_GAIN = 1e-4, 1e-3  # relative reduction of the squared error below which the steps end; with penalties
LEAST_SLOPE = 0.02  # of the mean slope: a monotone bend is nowhere flatter on the range of v
GRID = np.linspace(-1.0, 1.0, 201)
Filter = Callable[[Array], Array]


@dataclass(frozen=True)
class Following:
    """Covariates theta (n, m), scaled, over all rows, each with its level of `LEVELS`."""

    theta: Array
    levels: Sequence[str]

    @property
    def gains(self) -> NDArray[np.intp]:
        """Numbers of the covariates that set the gain."""
        return np.flatnonzero([level == "gain" for level in self.levels])

    def free(self, size: int) -> NDArray[np.bool_]:
        """Return which of the coefficients of b_j are free, shape (m, size)."""
        found = np.zeros((len(self.levels), size), dtype=bool)
        for j, level in enumerate(self.levels):
            found[j, : {"none": 0, "bend": size}.get(level, 1)] = True
        return found

    def factor(self, g: Array) -> Array:
        """Return 1 + g' theta, shape (n,)."""
        return np.asarray(1 + self.theta @ g)

    def columns(self, basis: Array, g: Array) -> Array:
        """Return the columns of a regression on the coefficients of b and the free ones of b_j.

        `basis` (n, size) contains polynomials of v; g (m,) contains the gains.
        """
        rows, orders = np.nonzero(self.free(basis.shape[1]))
        return np.hstack([basis * self.factor(g)[:, None], self.theta[:, rows] * basis[:, orders]])

    def coefficients(self, found: Array, size: int) -> tuple[Array, Array]:
        """Split the weights of `columns` into the coefficients of b (size,) and of b_j (m, size)."""
        free = self.free(size)
        c = np.zeros(free.shape)
        c[free] = found[size:]
        return found[:size], c

    def value(self, v: Array, q: Array, c: Array, g: Array) -> Array:
        """Return b(v, theta), shape (n,), for coefficients q of b and c of b_j."""
        own: Array = self.factor(g) * np.asarray(legendre.legval(v, q), float)
        if not self.levels:
            return own
        return np.asarray(own + np.sum(self.theta * np.asarray(legendre.legval(v, c.T), float).T, axis=1))

    def slope(self, v: Array, q: Array, c: Array, g: Array) -> Array:
        """Return the derivative of b(v, theta) by v, shape (n,)."""
        if len(q) == 1:
            return np.zeros(len(v))
        of_q, of_c = (np.asarray(legendre.legder(each, axis=-1), float) for each in (q, c.reshape(-1, len(q))))
        return self.value(v, of_q, of_c, g)

    def started(self, y: Array, rows: NDArray[np.intp]) -> Array:
        """Return free columns (rows, ...) for offset and gain in a fit without a bend; y has shape (rows,)."""
        used = self.theta[rows][:, [level != "none" for level in self.levels]] if self.levels else np.zeros((len(y), 0))
        return np.hstack([np.ones((len(y), 1)), used, used * y[:, None]])

    def parameters(self, size: int) -> int:
        """Return the number of free coefficients and gains for polynomials with `size` coefficients."""
        return int(self.free(size).sum()) + len(self.gains)


@dataclass(frozen=True)
class BentSum:
    """Result of a fit.

    Fields: weights w (p,) of the columns, so that v lies in [-1, 1]; Legendre coefficients q of the bend, of which the
    first is the offset; weights k of the lags; RMS error on the rows of the fit; gains g (m,) of the covariates; and
    Legendre coefficients c (m, degree + 1) of the bends of the covariates.
    """

    w: Array
    q: Array
    k: Array
    rms: float = np.inf
    g: Array = field(default_factory=lambda: np.zeros(0))
    c: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def variables(self) -> tuple[Array, Array, Array]:
        """The variables of the Gauss-Newton steps."""
        return self.w, self.k, self.g

    @property
    def monotone(self) -> bool:
        """True if the bend rises, or falls, on the whole range of v and of the covariates."""
        slope = legendre.legval(GRID, legendre.legder(self.q)) if len(self.q) > 1 else np.zeros(1)
        least = slope * np.sign(slope.mean()) - np.abs(self.g).sum() * np.abs(slope)
        if self.c.shape[1] > 1:
            least = least - np.abs(legendre.legval(GRID, legendre.legder(self.c, axis=1).T)).sum(axis=0)
        return bool(np.min(least) > LEAST_SLOPE * abs(slope.mean()))


@dataclass(frozen=True)
class Problem:
    """Data and settings of a fit.

    The columns (n, p) are the input and plays, or stops, over all rows. The output y (m,) is given on the rows of the
    fit. h is the step (s). T contains the time constants (s) of the lags and is empty without creep. `after` is the
    linear dynamics F; None means F = 1. The least weight of the first column is relative to the sum of all weights. The
    covariates of the bend are given over all rows. Penalties for smooth weights are strengths and matrices (l, p), for
    columns of median size; None instead of a matrix is a ridge. Without penalties, weights with little excitation would
    be arbitrary.
    """

    columns: Array
    y: Array
    rows: NDArray[np.intp]
    h: float
    T: Array
    after: Filter | None = None
    least: float = 0.0
    following: Following = field(default_factory=lambda: Following(np.zeros((1, 0)), ()))
    penalties: tuple[tuple[float, Array | None], ...] = ()

    def solved(self, linear: Array, target: Array, free: Array) -> tuple[Array, Array]:
        """Return the non-negative weights of columns, the operator's p weights first, and the free weights."""
        if not self.penalties:
            return nonnegative(linear, target, free)
        n = self.columns.shape[1]
        size = np.linalg.norm(linear[:, :n] - linear[:, :n].mean(axis=0), axis=0)
        size = np.maximum(size, LEAST_SIZE * size.max())
        rows = [s * (np.diag(size) if P is None else float(np.median(size)) * P) for s, P in self.penalties]
        held = np.hstack([np.vstack(rows), np.zeros((sum(map(len, rows)), linear.shape[1] - n))])
        rest = np.zeros((len(held), free.shape[1]))
        return nonnegative(np.vstack([linear, held]), np.append(target, rest[:, 0]), np.vstack([free, rest]))

    def seen(self, columns: Array) -> Array:
        """Return columns after the dynamics, on the rows of the fit."""
        return np.asarray((columns if self.after is None else self.after(columns))[self.rows])

    def crept(self, columns: Array, k: Array) -> Array:
        """Return columns with their creep."""
        used = k > 0
        if not used.any():
            return columns
        return parallel_lags(-np.expm1(-self.h / self.T[used]), k[used]).run(columns)


def lagged(columns: Array, share: float) -> Array:
    """Run q[i] = q[i - 1] + share (x[i] - q[i - 1]) along the rows of columns x (n, p), from q[0] = x[0].

    The share is the approach of a lag to its input in one step, 1 - e^(-h/T).
    """
    return parallel_lags(np.array([share]), np.ones(1), 0.0).run(columns)


def model(p: Problem, s: BentSum) -> Array:
    """Return the output on the rows of the fit, shape (m,), in the unit of measure of y."""
    return p.seen(p.crept(p.following.value(p.columns @ s.w, s.q, s.c, s.g)[:, None], s.k))[:, 0]


def fit_linear(p: Problem, degree: int) -> BentSum:
    """Return the fit without bend and creep, as the start of `fit`; the coefficients of b are padded to `degree`."""
    w, _ = p.solved(p.seen(p.columns), p.y, p.following.started(p.y, p.rows))
    if not w.any():
        w = np.full(len(w), 1.0)
    w[0] = max(w[0], p.least * w.sum())  # as each step: a start below would be better than all that may follow
    m = len(p.following.levels)
    start = BentSum(w, np.zeros(degree + 1), np.zeros(len(p.T)), g=np.zeros(m), c=np.zeros((m, degree + 1)))
    return _with_bend(p, start)


def fit(p: Problem, start: BentSum, wanted: float = np.inf) -> BentSum:
    """Take Gauss-Newton steps from `start` while the error decreases; return the best point, with a bend of the degree.

    `wanted` is the RMS error from another start. The steps also end if their present rate is too slow to reach this
    error.
    """
    best = _with_bend(p, start)
    # penalties pull on the scale of the weights, which the bend makes up for: steps drift on and gain nearly nothing
    least = HELD_GAIN if p.penalties else GAIN
    for left in range(STEPS - 1, -1, -1):
        step = _newton(p, best)
        for share in SHARES:
            w, k, g = (old + share * (new - old) for old, new in zip(best.variables, step.variables, strict=True))
            trial = _with_bend(p, replace(best, w=w, k=k, g=g))
            if trial.rms < best.rms:
                break
        else:
            break
        gained, best = 1 - (trial.rms / best.rms) ** 2, trial
        if gained < least or best.rms * (1 - gained) ** (left / 2) > wanted:
            break
    return best


def residuals(p: Problem, s: BentSum) -> Callable[[Filter | None], Array]:
    """Return a function that maps other dynamics to the residuals (m,) after one Gauss-Newton step from `s`.

    Columns with weight 0 are omitted, because a search of the dynamics filters the columns hundreds of times.
    """
    used = s.w > 0
    held = tuple((strength, None if P is None else P[:, used]) for strength, P in p.penalties)
    p, s = replace(p, columns=np.ascontiguousarray(p.columns[:, used]), penalties=held), replace(s, w=s.w[used])
    before = _before(p, s)

    def left(after: Filter | None) -> Array:
        linear, free, target = _after(replace(p, after=after), s, before)
        x, v = p.solved(linear, target, free)
        return np.asarray(linear @ x + free @ v - target)

    return left


def _newton(p: Problem, s: BentSum) -> BentSum:
    """Return the weights that minimise the linearised error at `s`."""
    linear, free, target = _after(p, s, _before(p, s))
    x, v = p.solved(linear, target, free)
    w, k, g = x[: len(s.w)], x[len(s.w) :], s.g.copy()
    w[0] = max(w[0], p.least * w.sum())
    g[p.following.gains] = v[1:]
    return replace(s, w=w, k=k, g=g)


def _before(p: Problem, s: BentSum) -> Array:
    """Return the columns of a linearisation before the dynamics.

    They are the derivatives by w, the output, the derivatives by k, and the free columns.
    """
    v = p.columns @ s.w
    slope, b = (f(v, s.q, s.c, s.g)[:, None] for f in (p.following.slope, p.following.value))
    parts = [p.crept(slope * p.columns, s.k), p.crept(b, s.k), *(lagged(b - b[:1], -np.expm1(-p.h / T)) for T in p.T)]
    if len(p.following.gains):
        own = np.asarray(legendre.legval(v, s.q), float)[:, None]
        parts.append(p.crept(p.following.theta[:, p.following.gains] * own, s.k))
    return np.hstack(parts)


def _after(p: Problem, s: BentSum, before: Array) -> tuple[Array, Array, Array]:
    """Return the derivatives of the output at `s`, by w and k, then by free variables, and the common target."""
    n, m = len(s.w), len(p.T)
    seen = p.seen(before)
    moved, creep, gained = seen[:, :n], seen[:, n + 1 : n + 1 + m], seen[:, n + 1 + m :]
    linear = np.hstack([moved, creep])
    target = p.y - seen[:, n] + moved @ s.w + creep @ s.k
    free = np.hstack([np.ones((len(p.y), 1)), gained])
    return linear, free, target + gained @ s.g[p.following.gains]


def _with_bend(p: Problem, s: BentSum) -> BentSum:
    """Scale v to [-1, 1] and fit the coefficients of the bend."""
    v = p.columns @ s.w
    size = float(np.abs(v).max())
    if not size > 0:
        return replace(s, rms=np.inf)
    w, v = s.w / size, v / size
    columns = p.following.columns(np.asarray(legendre.legvander(v, len(s.q) - 1), float), s.g)
    basis = p.seen(p.crept(columns, s.k))
    q = np.asarray(np.linalg.lstsq(basis, p.y, rcond=1e-12)[0], float)
    rms = float(np.sqrt(np.mean((basis @ q - p.y) ** 2)))
    q, c = p.following.coefficients(q, len(s.q))
    return BentSum(w, q, s.k, rms, s.g, c)
