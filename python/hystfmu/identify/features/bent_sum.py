"""A sum of plays, a bend, creep and linear dynamics behind it: weights, bend and creep for given dynamics.

  v = w0 x + sum_i w_i p_i[x],  b = b(v),  c = b + sum_j k_j L_{T_j}[b],  y = F[c] + offset

F is linear (G0 with delay, or nothing) with gain 1 at rest, L_T a first-order lag, b a polynomial (Legendre basis on
the range of v).  The fit takes Gauss-Newton steps in the non-negative w and k, each a non-negative least-squares
problem on the columns F[(1 + sum k_j L_j)[b'(v) p_i]] and F[L_j[b]]; between the steps the coefficients of b follow by
linear least squares.  This is a Wiener-Hammerstein structure with a hysteresis at its front (Giri & Bai 2010,
Block-oriented Nonlinear System Identification, ch. 1), solved as a separable problem (Golub & Pereyra 1973).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.signal import lfilter

from hystfmu.base.arrays import Array
from hystfmu.identify.solvers.nonnegative import nonnegative

STEPS = 30  # most Gauss-Newton steps
SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step, tried in turn
GAIN = 1e-4  # relative reduction of the squared error below which the steps end
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
    """

    w: Array
    q: Array
    k: Array
    rms: float = np.inf

    @property
    def monotone(self) -> bool:
        """Whether the bend rises, or falls, on the whole range of v."""
        slope = legendre.legval(GRID, legendre.legder(self.q)) if len(self.q) > 1 else np.zeros(1)
        return bool(np.min(slope * np.sign(slope.mean())) > LEAST_SLOPE * abs(slope.mean()))


@dataclass(frozen=True)
class Problem:
    """What a fit is given.

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
    """

    columns: Array
    y: Array
    rows: NDArray[np.intp]
    h: float
    T: Array
    after: Filter | None = None
    least: float = 0.0

    def seen(self, columns: Array) -> Array:
        """Return columns after the dynamics, on the rows of the fit."""
        return np.asarray((columns if self.after is None else self.after(columns))[self.rows])

    def lag(self, columns: Array, T: float) -> Array:
        """Return the first-order lag of columns, from their steady state, held over each step as `creep` does."""
        return lagged(columns, -np.expm1(-self.h / T))

    def crept(self, columns: Array, k: Array) -> Array:
        """Return columns with their creep."""
        found = columns
        for weight, T in zip(k, self.T, strict=True):
            if weight > 0:
                found = found + weight * self.lag(columns, T)
        return found


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
    first = columns[:1]
    return np.asarray(lfilter([share], [1.0, share - 1.0], columns - first, axis=0) + first)


def model(p: Problem, s: BentSum) -> Array:
    """Return the output on the rows of the fit, shape (m,), in the unit of measure of y."""
    b = np.asarray(legendre.legval(p.columns @ s.w, s.q), float)[:, None]
    return p.seen(p.crept(b, s.k))[:, 0]


def fit_linear(p: Problem, degree: int) -> BentSum:
    """Return the fit without bend and creep, as the start of `fit`; for `degree` the coefficients of b are padded."""
    w, _ = nonnegative(p.seen(p.columns), p.y, np.ones((len(p.y), 1)))
    if not w.any():
        w = np.full(len(w), 1.0)
    return _with_bend(p, BentSum(w, np.zeros(degree + 1), np.zeros(len(p.T))))


def fit(p: Problem, start: BentSum) -> BentSum:
    """Take Gauss-Newton steps from `start` until they gain nothing.

    Parameters
    ----------
    p : Problem
        Data.
    start : BentSum
        First point; ``len(q) - 1`` is the degree of the bend.

    Returns
    -------
    BentSum
        The best point found.
    """
    best = _with_bend(p, start)
    for _ in range(STEPS):
        step = _newton(p, best)
        for share in SHARES:
            trial = _with_bend(
                p, replace(best, w=best.w + share * (step.w - best.w), k=best.k + share * (step.k - best.k))
            )
            if trial.rms < best.rms:
                break
        else:
            break
        gained, best = 1 - (trial.rms / best.rms) ** 2, trial
        if gained < GAIN:
            break
    return best


def residuals(p: Problem, s: BentSum) -> Array:
    """Return the residuals (m,) after one Gauss-Newton step from `s`: what is left for other dynamics than its own."""
    linear, target = _linearised(p, s)
    x, free = nonnegative(linear, target, np.ones((len(p.y), 1)))
    return np.asarray(linear @ x + free[0] - target)


def _newton(p: Problem, s: BentSum) -> BentSum:
    """Return the weights that a linearisation at `s` asks for."""
    linear, target = _linearised(p, s)
    x, _ = nonnegative(linear, target, np.ones((len(p.y), 1)))
    w, k = x[: len(s.w)], x[len(s.w) :]
    w[0] = max(w[0], p.least * w.sum())
    return replace(s, w=w, k=k)


def _linearised(p: Problem, s: BentSum) -> tuple[Array, Array]:
    """Return the derivatives of the output by w and k at `s`, and the target of a regression on them."""
    v = p.columns @ s.w
    slope = legendre.legval(v, legendre.legder(s.q)) if len(s.q) > 1 else np.zeros(len(v))
    b = legendre.legval(v, s.q)[:, None]
    moved = p.seen(p.crept(slope[:, None] * p.columns, s.k))
    creep = np.hstack([np.zeros((len(p.y), 0)), *(p.seen(p.lag(b - b[:1], T)) for T in p.T)])
    linear = np.hstack([moved, creep])
    return linear, p.y - model(p, s) + moved @ s.w + creep @ s.k


def _with_bend(p: Problem, s: BentSum) -> BentSum:
    """Scale v to [-1, 1] and fit the coefficients of the bend."""
    v = p.columns @ s.w
    size = float(np.abs(v).max())
    if not size > 0:
        return replace(s, rms=np.inf)
    w, v = s.w / size, v / size
    basis = p.seen(p.crept(np.asarray(legendre.legvander(v, len(s.q) - 1), float), s.k))
    q = np.asarray(np.linalg.lstsq(basis, p.y, rcond=1e-12)[0], float)
    return BentSum(w, q, s.k, float(np.sqrt(np.mean((basis @ q - p.y) ** 2))))
