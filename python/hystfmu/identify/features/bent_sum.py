"""Fit of a sum of plays with a static nonlinearity and creep, for given linear dynamics after them.

  v = w0 x + sum_i w_i p_i[x],  b = b(v),  c = b + sum_j k_j L_{T_j}[b],  y = F[c] + offset

p_i are plays, L_T is a first-order lag, and F is linear with static gain 1 (G0 with a delay, or F = 1). The static
nonlinearity b, also called bend, is a polynomial in the Legendre basis on the range of v. The weights w and k are not
negative. They are determined by Gauss-Newton steps. Each step is a non-negative least-squares problem with the columns
F[(1 + sum k_j L_j)[b'(v) p_i]] and F[L_j[b]]. After each step, linear least squares gives the coefficients of b. The
structure is a Wiener-Hammerstein system that begins with a hysteresis (Giri & Bai 2010, Block-oriented Nonlinear System
Identification, ch. 1). The coefficients of b are computed separately because they are linear parameters (separable
least squares, Golub & Pereyra 1973).

The nonlinearity can be a linear function of covariates theta, which are scaled to [-1, 1]:

  b(v, theta) = (1 + g' theta) b(v) + sum_j theta_j b_j(v)

Each covariate has one of four levels. With ``none``, it has no effect. With ``offset``, b_j is constant. With ``gain``,
b_j is constant and the gain g_j is fitted. With ``bend``, b_j is a polynomial of the same degree as b. The gains g are
variables of the Gauss-Newton steps and have no bounds. A model with ``gain`` has an exact inverse if b(v) has one. A
model with ``bend`` is inverted by root finding.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.polynomial import legendre

from hystfmu.base import Array, Indices, Mask
from hystfmu.graph.recursion import lag, parallel_lags
from hystfmu.identify.solvers.nonnegative import LEAST_SIZE, nonnegative

LEVELS = ("none", "offset", "gain", "bend")
STEPS = 30  # maximum number of Gauss-Newton steps
SHARES = (1.0, 0.5, 0.25, 0.1)  # step lengths that are tried one after the other, relative to the full step
GAIN, HELD_GAIN = 1e-4, 1e-3  # relative reduction of the squared error that ends the steps: without, with penalties
LEAST_SLOPE = 0.02  # smallest slope of a monotone nonlinearity on the range of v, relative to its mean slope
GRID = np.linspace(-1.0, 1.0, 201)
Filter = Callable[[Array, Indices], Array]
"""Function that filters columns (n, m) and returns them on given rows."""


@dataclass(frozen=True)
class Following:
    """Scaled covariates theta (n, m) for all rows, and the level of each covariate (one of `LEVELS`)."""

    theta: Array
    levels: Sequence[str]

    @property
    def gains(self) -> Indices:
        """Indices, from 0, of the covariates with the level ``gain``."""
        return np.flatnonzero([level == "gain" for level in self.levels])

    def free(self, size: int) -> Mask:
        """Return for each coefficient of each b_j whether it is fitted, shape (m, size)."""
        found = np.zeros((len(self.levels), size), dtype=bool)
        for j, level in enumerate(self.levels):
            found[j, : {"none": 0, "bend": size}.get(level, 1)] = True
        return found

    def columns(self, basis: Array, g: Array) -> Array:
        """Return the regressors that belong to the coefficients of b and to the fitted coefficients of b_j.

        `basis` (n, size) contains the polynomials of v, and g (m,) contains the gains.
        """
        rows, orders = np.nonzero(self.free(basis.shape[1]))
        return np.hstack([basis * (1 + self.theta @ g)[:, None], self.theta[:, rows] * basis[:, orders]])

    def coefficients(self, found: Array, size: int) -> tuple[Array, Array]:
        """Split the weights of the regressors `columns` into the coefficients of b (size,) and of b_j (m, size)."""
        free = self.free(size)
        c = np.zeros(free.shape)
        c[free] = found[size:]
        return found[:size], c

    def value(self, v: Array, q: Array, c: Array, g: Array) -> Array:
        """Return b(v, theta), shape (n,), for the coefficients q of b and the coefficients c of b_j."""
        own: Array = (1 + self.theta @ g) * np.asarray(legendre.legval(v, q), float)
        return np.asarray(own + np.sum(self.theta * np.asarray(legendre.legval(v, c.T), float).T, axis=1))

    def slope(self, v: Array, q: Array, c: Array, g: Array) -> Array:
        """Return the derivative of b(v, theta) by v, shape (n,)."""
        if len(q) == 1:
            return np.zeros(len(v))
        of_q, of_c = (np.asarray(legendre.legder(each, axis=-1), float) for each in (q, c.reshape(-1, len(q))))
        return self.value(v, of_q, of_c, g)

    def started(self, y: Array, rows: Indices) -> Array:
        """Return the free columns of `fit_linear`: a constant, and effects of covariates on offset and gain.

        y (rows,) is the output on the rows `rows`.
        """
        used = self.theta[rows][:, [level != "none" for level in self.levels]] if self.levels else np.zeros((len(y), 0))
        return np.hstack([np.ones((len(y), 1)), used, used * y[:, None]])

    def parameters(self, size: int) -> int:
        """Return the number of fitted coefficients of b_j and gains, for polynomials with `size` coefficients."""
        return int(self.free(size).sum()) + len(self.gains)


@dataclass(frozen=True)
class BentSum:
    """Result of a fit.

    ``w`` (p,) contains the weights of the columns, scaled so that v lies in [-1, 1]. ``q`` contains the Legendre
    coefficients of b; its first element is the offset. ``k`` contains the weights of the lags. ``rms`` is the RMS error
    on the rows of the fit. ``g`` (m,) contains the gains of the covariates, and ``c`` (m, degree + 1) contains the
    Legendre coefficients of b_j.
    """

    w: Array
    q: Array
    k: Array
    rms: float = np.inf
    g: Array = field(default_factory=lambda: np.zeros(0))
    c: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def monotone(self) -> bool:
        """True if the nonlinearity is strictly monotone in v, for all v and scaled covariates in [-1, 1]."""
        slope = legendre.legval(GRID, legendre.legder(self.q)) if len(self.q) > 1 else np.zeros(1)
        least = slope * np.sign(slope.mean()) - np.abs(self.g).sum() * np.abs(slope)
        if self.c.shape[1] > 1:
            least = least - np.abs(legendre.legval(GRID, legendre.legder(self.c, axis=1).T)).sum(axis=0)
        return bool(np.min(least) > LEAST_SLOPE * abs(slope.mean()))


@dataclass(frozen=True)
class Problem:
    """Data and settings of a fit.

    ``columns`` (n, p) contains the input and the outputs of plays, stops or relays for all rows. ``y`` (m,) contains
    the output on the rows ``rows`` of the fit. ``h`` is the step (s). ``T`` contains the time constants (s) of the lags
    and is empty without creep. ``after`` is the linear dynamics F; None means F = 1. ``least`` is the smallest
    permitted weight of the first column, relative to the sum of all weights. ``following`` contains the covariates.

    ``penalties`` keep the weights smooth. Each penalty is a pair of a strength and a matrix (l, p). The matrix is
    multiplied by the median norm of the columns. None instead of a matrix means a ridge penalty on all weights. Without
    penalties, the data would not determine weights of columns with little excitation.

    If `signed` is True, weights of lags can be negative: the output relaxes back, as that of an ionic polymer.
    """

    columns: Array
    y: Array
    rows: Indices
    h: float
    T: Array
    after: Filter | None = None
    least: float = 0.0
    following: Following = field(default_factory=lambda: Following(np.zeros((1, 0)), ()))
    penalties: tuple[tuple[float, Array | None], ...] = ()
    signed: bool = False

    def solved(self, linear: Array, target: Array, free: Array) -> tuple[Array, Array]:
        """Return the non-negative weights of `linear` and the free weights of `free` that best approximate `target`.

        The first p columns of `linear` belong to the operator, and the penalties apply to their weights.
        """
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
        """Return columns filtered by the dynamics F, on the rows of the fit."""
        return np.asarray(columns[self.rows] if self.after is None else self.after(columns, self.rows))

    def crept(self, columns: Array, k: Array) -> Array:
        """Return columns plus their creep, x + sum_j k_j L_j[x]."""
        used = k != 0
        if not used.any():
            return columns
        return parallel_lags(-np.expm1(-self.h / self.T[used]), k[used]).run(columns)


def model(p: Problem, s: BentSum) -> Array:
    """Return the output of a fitted model on the rows of the fit, shape (m,), in the unit of measure of y."""
    return p.seen(p.crept(p.following.value(p.columns @ s.w, s.q, s.c, s.g)[:, None], s.k))[:, 0]


def fit_linear(p: Problem, degree: int) -> BentSum:
    """Fit the weights without nonlinearity and creep, then fit a nonlinearity of the given degree for these weights.

    The result is a start value of `fit`.
    """
    w, _ = p.solved(p.seen(p.columns), p.y, p.following.started(p.y, p.rows))
    if not w.any():
        w = np.full(len(w), 1.0)
    w[0] = max(w[0], p.least * w.sum())  # as in each step; otherwise no permitted point could be better than the start
    m = len(p.following.levels)
    start = BentSum(w, np.zeros(degree + 1), np.zeros(len(p.T)), g=np.zeros(m), c=np.zeros((m, degree + 1)))
    return _with_bend(p, start)


def fit(p: Problem, start: BentSum, wanted: float = np.inf) -> BentSum:
    """Take Gauss-Newton steps from `start` while the error decreases, and return the best point.

    `wanted` is the RMS error that a fit from another start point has reached. The steps also end if the error decreases
    too slowly to reach this value.
    """
    best = _with_bend(p, start)
    # penalties reduce the scale of the weights, and the nonlinearity compensates for this: steps could continue without
    # a useful reduction of the error
    least = HELD_GAIN if p.penalties else GAIN
    for left in range(STEPS - 1, -1, -1):
        step = _newton(p, best)
        for share in SHARES:
            w, k, g = (a + share * (b - a) for a, b in ((best.w, step.w), (best.k, step.k), (best.g, step.g)))
            trial = _with_bend(p, replace(best, w=w, k=k, g=g))
            if trial.rms < best.rms:
                break
        else:
            break
        gained, best = 1 - (trial.rms / best.rms) ** 2, trial
        if gained < least or best.rms * (1 - gained) ** (left / 2) > wanted:
            break
    return best


def behind(p: Problem, s: BentSum) -> tuple[Array, Callable[[Array, Array], tuple[Array, Mask]]]:
    """Return signals before the dynamics, and a fit of their weights, for `Weighted`: one Gauss-Newton step from `s`.

    Columns with the weight 0 are omitted: a search of the dynamics filters all columns many times.
    """
    used = s.w > 0
    held = tuple((strength, None if P is None else P[:, used]) for strength, P in p.penalties)
    p, s = replace(p, columns=np.ascontiguousarray(p.columns[:, used]), penalties=held), replace(s, w=s.w[used])
    n, m, gains = len(s.w), len(p.T), s.g[p.following.gains]

    def fit(seen: Array, y: Array) -> tuple[Array, Mask]:
        x, v = p.solved(*_linearised(p, s, seen, y))
        creep = x[n : n + m] - (x[n + m :] if p.signed else 0.0)
        weights = np.concatenate([x[:n] - s.w, [1.0], creep - s.k, v[1:] - gains, v[:1]])
        moves = np.concatenate([x[:n] > 0, [False], (creep > 0) | p.signed, np.ones(len(v), dtype=bool)])
        return weights, moves

    before = _before(p, s)
    return np.column_stack([before, np.ones(len(before))]), fit


def _newton(p: Problem, s: BentSum) -> BentSum:
    """Return `s` with new w, k and g, which minimise the error of the model linearised at `s`."""
    x, v = p.solved(*_linearised(p, s, p.seen(_before(p, s)), p.y))
    w, of_lags, g = x[: len(s.w)], x[len(s.w) :], s.g.copy()
    k = of_lags[: len(p.T)] - (of_lags[len(p.T) :] if p.signed else 0.0)
    w[0] = max(w[0], p.least * w.sum())
    g[p.following.gains] = v[1:]
    return replace(s, w=w, k=k, g=g)


def _before(p: Problem, s: BentSum) -> Array:
    """Return the columns of the model linearised at `s`, before they are filtered by the dynamics.

    In this order, they are the derivatives with respect to w, the output, and the derivatives with respect to k and g.
    """
    v = p.columns @ s.w
    slope, b = (f(v, s.q, s.c, s.g)[:, None] for f in (p.following.slope, p.following.value))
    parts = [p.crept(slope * p.columns, s.k), p.crept(b, s.k), *(lag(p.h, T).run(b - b[:1]) for T in p.T)]
    if len(p.following.gains):
        own = np.asarray(legendre.legval(v, s.q), float)[:, None]
        parts.append(p.crept(p.following.theta[:, p.following.gains] * own, s.k))
    return np.hstack(parts)


def _linearised(p: Problem, s: BentSum, seen: Array, y: Array) -> tuple[Array, Array, Array]:
    """Return the linearised least-squares problem at `s` for the arguments of `Problem.solved`.

    `seen` (m, k) contains the columns of `_before` after the dynamics, and y (m,) the output. The bounded columns have
    weights >= 0 and are the derivatives of the output with respect to w and k. The free columns belong to the offset
    and to the gains g.
    """
    n, m, gains = len(s.w), len(p.T), p.following.gains
    moved, creep, gained = seen[:, :n], seen[:, n + 1 : n + 1 + m], seen[:, n + 1 + m : n + 1 + m + len(gains)]
    target = y - seen[:, n] + moved @ s.w + creep @ s.k + gained @ s.g[gains]
    return np.hstack([moved, creep, *[-creep] * p.signed]), target, np.hstack([np.ones((len(y), 1)), gained])


def _with_bend(p: Problem, s: BentSum) -> BentSum:
    """Return `s` with weights scaled so that v lies in [-1, 1], and with newly fitted coefficients of b and b_j."""
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
