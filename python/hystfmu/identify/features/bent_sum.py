"""A sum of plays, a bend, creep and linear dynamics behind it: weights, bend and creep for given dynamics.

  v = w0 x + sum_i w_i p_i[x],  b = b(v),  c = b + sum_j k_j L_{T_j}[b],  y = F[c] + offset

F is linear (G0 with delay, or nothing) with gain 1 at rest, L_T a first-order lag, b a polynomial (Legendre basis on
the range of v). The fit takes Gauss-Newton steps in the non-negative w and k, each a non-negative least-squares problem
on the columns F[(1 + sum k_j L_j)[b'(v) p_i]] and F[L_j[b]]; between the steps the coefficients of b follow by linear
least squares. With covariates b depends on them (`following`); their gains g are variables of the Gauss-Newton steps,
without bounds. This is a Wiener-Hammerstein structure with a hysteresis at its front (Giri & Bai 2010, Block-oriented
Nonlinear System Identification, ch. 1), solved as a separable problem (Golub & Pereyra 1973).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.core.columns import parallel_lags
from hystfmu.identify.features.following import Following
from hystfmu.identify.solvers.nonnegative import nonnegative
from hystfmu.identify.solvers.penalised import LEAST_SIZE

STEPS = 30  # most Gauss-Newton steps
SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step, tried in turn
GAIN, HELD_GAIN = 1e-4, 1e-3  # relative reduction of the squared error below which the steps end; with penalties
LEAST_SLOPE = 0.02  # of the mean slope: a monotone bend is nowhere flatter on the range of v
GRID = np.linspace(-1.0, 1.0, 201)

Filter = Callable[[Array], Array]


@dataclass(frozen=True)
class BentSum:
    """Result of a fit.

    Parameters
    ----------
    w : array, shape (p,)
        Weights of the columns, so that v lies in [-1, 1].
    q : array, shape (degree + 1,)
        Legendre coefficients of the bend; the first one is the offset.
    k : array, shape (m,)
        Weights of the lags.
    rms : float
        RMS error on the rows of the fit.
    g : array, shape (m,)
        Gains of the covariates.
    c : array, shape (m, degree + 1)
        Legendre coefficients of the bends of the covariates.
    """

    w: Array
    q: Array
    k: Array
    rms: float = np.inf
    g: Array = field(default_factory=lambda: np.zeros(0))
    c: Array = field(default_factory=lambda: np.zeros((0, 0)))

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

    Parameters
    ----------
    columns : array, shape (n, p)
        Input and plays, or stops, over all rows from the first on.
    y : array, shape (m,)
        Output on the rows of the fit.
    rows : array of int, shape (m,)
        Rows of the fit.
    h : float
        Step (s).
    T : array, shape (l,)
        Time constants of the lags (s); empty without creep.
    after : function or None
        Linear dynamics F applied to columns; None: F = 1.
    least : float
        Least weight of the first column, relative to the sum of all.
    following : Following, optional
        Covariates that the bend depends on, over all rows.
    penalties : tuple of (float, array, shape (l, p))
        Strengths and matrices of smoothness penalties, for columns of median size; None instead of a matrix: a ridge.
        Without penalties, weights with little excitation would be arbitrary.
    """

    columns: Array
    y: Array
    rows: NDArray[np.intp]
    h: float
    T: Array
    after: Filter | None = None
    least: float = 0.0
    following: Following | None = None
    penalties: tuple[tuple[float, Array | None], ...] = ()

    def solved(self, linear: Array, target: Array, free: Array) -> tuple[Array, Array]:
        """Return the non-negative weights of columns, the first p those of the operator, and the free ones."""
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

    def lag(self, columns: Array, T: float) -> Array:
        """Return the first-order lag of columns, from their steady state, held over each step as `creep` does."""
        return lagged(columns, -np.expm1(-self.h / T))

    def crept(self, columns: Array, k: Array) -> Array:
        """Return columns with their creep."""
        used = k > 0
        if not used.any():
            return columns
        return parallel_lags(-np.expm1(-self.h / self.T[used]), k[used]).run(columns)


def lagged(columns: Array, share: float) -> Array:
    """Run q[i] = q[i - 1] + share (x[i] - q[i - 1]) along the rows, from q[0] = x[0].

    Parameters
    ----------
    columns : array, shape (n, p)
        Inputs x.
    share : float
        Approach of a lag to its input in one step, 1 - e^(-h/T).

    Returns
    -------
    array, shape (n, p)
        Lags q.
    """
    return parallel_lags(np.array([share]), np.ones(1), 0.0).run(columns)


def model(p: Problem, s: BentSum) -> Array:
    """Return the output on the rows of the fit, shape (m,), in the unit of measure of y."""
    return p.seen(p.crept(_bend(p, s, p.columns @ s.w)[:, None], s.k))[:, 0]


def fit_linear(p: Problem, degree: int) -> BentSum:
    """Return the fit without bend and creep, as the start of `fit`; for `degree` the coefficients of b are padded."""
    free = np.ones((len(p.y), 1)) if p.following is None else p.following.rows(p.rows).started(p.y)
    w, _ = p.solved(p.seen(p.columns), p.y, free)
    if not w.any():
        w = np.full(len(w), 1.0)
    w[0] = max(w[0], p.least * w.sum())  # as each step: a start below would be better than all that may follow
    m = 0 if p.following is None else len(p.following.levels)
    return _with_bend(
        p, BentSum(w, np.zeros(degree + 1), np.zeros(len(p.T)), g=np.zeros(m), c=np.zeros((m, degree + 1)))
    )


def fit(p: Problem, start: BentSum, wanted: float = np.inf) -> BentSum:
    """Take Gauss-Newton steps from `start` until the error no longer decreases.

    Parameters
    ----------
    p : Problem
        Data.
    start : BentSum
        First point; ``len(q) - 1`` is the degree of the bend.
    wanted : float
        RMS error from another start: the steps also end if they will not reach it at their present rate.

    Returns
    -------
    BentSum
        The best point found.
    """
    best = _with_bend(p, start)
    # penalties pull on the scale of the weights, which the bend makes up for: steps drift on and gain nearly nothing
    least = HELD_GAIN if p.penalties else GAIN
    for left in range(STEPS - 1, -1, -1):
        step = _newton(p, best)
        for share in SHARES:
            moved = {name: old + share * (getattr(step, name) - old) for name, old in _variables(best).items()}
            trial = _with_bend(p, replace(best, **moved))
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


def _variables(s: BentSum) -> dict[str, Array]:
    return {"w": s.w, "k": s.k, "g": s.g}


def _newton(p: Problem, s: BentSum) -> BentSum:
    """Return the weights that minimise the linearised error at `s`."""
    linear, free, target = _linearised(p, s)
    x, v = p.solved(linear, target, free)
    w, k, g = x[: len(s.w)], x[len(s.w) :], s.g.copy()
    w[0] = max(w[0], p.least * w.sum())
    if p.following is not None:
        g[p.following.gains] = v[1:]
    return replace(s, w=w, k=k, g=g)


def _bend(p: Problem, s: BentSum, v: Array) -> Array:
    if p.following is None:
        return np.asarray(legendre.legval(v, s.q), float)
    return p.following.value(v, s.q, s.c, s.g)


def _slope(p: Problem, s: BentSum, v: Array) -> Array:
    if p.following is not None:
        return p.following.slope(v, s.q, s.c, s.g)
    return np.asarray(legendre.legval(v, legendre.legder(s.q))) if len(s.q) > 1 else np.zeros(len(v))


def _linearised(p: Problem, s: BentSum) -> tuple[Array, Array, Array]:
    """Return the derivatives of the output by w and k at `s`, those by free variables, and the target of both."""
    return _after(p, s, _before(p, s))


def _before(p: Problem, s: BentSum) -> Array:
    """Return the columns that `_linearised` filters by the dynamics: derivatives by w, the output, derivatives by k,
    free columns."""
    v = p.columns @ s.w
    slope, b = _slope(p, s, v), _bend(p, s, v)[:, None]
    parts = [p.crept(slope[:, None] * p.columns, s.k), p.crept(b, s.k), *(p.lag(b - b[:1], T) for T in p.T)]
    if p.following is not None and len(p.following.gains):
        own = np.asarray(legendre.legval(v, s.q), float)[:, None]
        parts.append(p.crept(p.following.theta[:, p.following.gains] * own, s.k))
    return np.hstack(parts)


def _after(p: Problem, s: BentSum, before: Array) -> tuple[Array, Array, Array]:
    n, m = len(s.w), len(p.T)
    seen = p.seen(before)
    moved, creep, gained = seen[:, :n], seen[:, n + 1 : n + 1 + m], seen[:, n + 1 + m :]
    linear = np.hstack([moved, creep])
    target = p.y - seen[:, n] + moved @ s.w + creep @ s.k
    free = np.hstack([np.ones((len(p.y), 1)), gained])
    return linear, free, target if p.following is None else target + gained @ s.g[p.following.gains]


def _with_bend(p: Problem, s: BentSum) -> BentSum:
    """Scale v to [-1, 1] and fit the coefficients of the bend."""
    v = p.columns @ s.w
    size = float(np.abs(v).max())
    if not size > 0:
        return replace(s, rms=np.inf)
    w, v = s.w / size, v / size
    columns = np.asarray(legendre.legvander(v, len(s.q) - 1), float)
    if p.following is not None:
        columns = p.following.columns(columns, s.g)
    basis = p.seen(p.crept(columns, s.k))
    q = np.asarray(np.linalg.lstsq(basis, p.y, rcond=1e-12)[0], float)
    rms = float(np.sqrt(np.mean((basis @ q - p.y) ** 2)))
    if p.following is None:
        return BentSum(w, q, s.k, rms)
    q, c = p.following.coefficients(q, len(s.q))
    return BentSum(w, q, s.k, rms, s.g, c)
