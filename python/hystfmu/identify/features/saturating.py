"""Saturating slopes of a Duhem operator: for each direction of the input, w approaches a bound at a rate.

  y = k u + w,  dw/d|u| = r(u) (W(u) - w)

The rate r > 0 and the bound W are functions of the input, one pair for rising and one for falling input. This form
contains many models of loops that saturate. In the model of Tellinen (IEEE Trans. Magn. 34 (1998) 2200-2206), W is one
branch of the major loop of a magnet, and r is the relative slope of the other branch. In shape-memory alloys, W is the
fraction of martensite 1 or 0, and r is a bell curve of the temperature (Likhachev & Koval, Scripta Metall. Mater. 27
(1992) 223-227). In the operators of Dahl and of Coleman & Hodgdon (1986), r is constant.

ln r and W are coefficients of B-splines. Penalties on the third differences of ln r and on the first differences of W
keep them smooth. A bell curve r = exp(polynomial of degree 2) and a constant W have no penalty, so a few small loops
determine such a device. In the intervals between neighbouring points of the path, the equation is solved exactly for a
constant r and W. Linear least squares of the increments gives the start values, because dw/d|u| is linear in r W and r.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, solve_banded
from scipy.sparse import csr_array, vstack

from hystfmu.base import Array, Indices, Mask
from hystfmu.graph.splines import uniform_splines
from hystfmu.identify.solvers.nonnegative import nonnegative
from hystfmu.identify.solvers.trust_region import Coordinates, refined
from hystfmu.model import rms

Rows = Indices

STEP = 0.02  # longest interval of the path, for u in [-1, 1]
LEAST, MOST = 1e-8, 300.0  # range of r
START, FARTHEST = 0.02, 1.5  # smallest r and largest |W| of the start values
HELD = 1e-2, 1e-3  # strengths of the penalties of the start values: on second differences, and on r
WIDE = 10.0, 3.0  # standard deviations of ln r and of W, for y in [-1, 1]: weak ridge penalties
SLOPES = (0.0, 0.1, 0.2, 0.4)  # start values of k
CHUNK = 4096  # number of points that are processed together
EVALUATIONS, TOLERANCE = 40, 1e-4  # limits of a search
SEARCHED, NOISE = 2, 1.5  # start values of searches, as one can end in a local minimum; error of a good fit over sigma


@dataclass(frozen=True)
class Level:
    """Number of B-splines, and standard deviations of third differences of ln r and of first differences of W."""

    splines: int
    rate: float
    bound: float


class Path:
    """The input u (n,) at the rows to be fitted, at all reversals, and at points between, not more than STEP apart."""

    def __init__(self, u: Array, rows: Rows) -> None:
        d = np.sign(np.diff(u))
        d = d[np.maximum.accumulate(np.where(d != 0, np.arange(len(d)), 0))]  # a plateau keeps its direction
        ends = np.union1d(np.append(rows, 0), np.flatnonzero(np.diff(d)) + 1)
        ends = ends[ends <= rows[-1]]
        parts = np.maximum(np.ceil(np.abs(np.diff(u[ends])) / STEP), 1).astype(int)
        at = np.append(0, np.cumsum(parts))
        points = np.interp(np.arange(at[-1] + 1), at, u[ends])
        self.rows = at[np.searchsorted(ends, rows)]
        self.u = u[rows]
        self.middle = (points[1:] + points[:-1]) / 2
        self.length = np.abs(np.diff(points))
        self.up = np.diff(points) > 0


@dataclass(frozen=True)
class Saturating:
    """Coefficients (2, m + 1) of ln r and of W for rising and falling input, slope k, and w at the first input."""

    rate: Array
    bound: Array
    k: float
    w0: float

    @staticmethod
    def at(p: Array) -> "Saturating":
        """Return the model at a point p (4 (m + 1) + 2,) of the search."""
        rate, bound = p[:-2].reshape(2, 2, -1)  # both directions of ln r, then of W
        return Saturating(rate, bound, float(p[-2]), float(p[-1]))

    @property
    def p(self) -> Array:
        """The point of the search."""
        return np.concatenate([self.rate.ravel(), self.bound.ravel(), [self.k, self.w0]])

    @property
    def r(self) -> Array:
        """Coefficients of r (2, m + 1)."""
        return np.asarray(np.exp(np.clip(self.rate, np.log(LEAST), np.log(MOST))))

    def finer(self, n: int) -> "Saturating":
        """Return nearly the same functions with n B-splines."""
        old, new = (np.linspace(0, 1, k) for k in (self.rate.shape[1], n))
        rate, bound = (np.array([np.interp(new, old, c) for c in both]) for both in (self.rate, self.bound))
        return Saturating(rate, bound, self.k, self.w0)


class Problem:
    """Residuals of y (rows,) in units of its noise `sigma`, followed by the penalties; y is scaled to [-1, 1]."""

    def __init__(self, path: Path, y: Array, level: Level, sigma: float) -> None:
        n = level.splines
        self.path, self.y, self.sigma = path, y, sigma
        parts = np.array_split(np.arange(len(path.middle)), len(path.middle) // CHUNK + 1)
        self.splines = vstack([csr_array(_by_direction(path.middle[i], path.up[i], n)) for i in parts])  # mostly 0
        rate = np.vstack([np.diff(np.eye(n), 3, axis=0) / level.rate, np.eye(n) / WIDE[0]])
        bound = np.vstack([np.diff(np.eye(n), axis=0) / level.bound, np.eye(n) / WIDE[1]])
        self.penalty = block_diag(rate, rate, bound, bound, np.zeros((0, 2)))
        free = np.full(4 * n + 2, np.inf)
        self.coordinates = Coordinates(-free, free, np.ones(4 * n + 2), lambda p: {})

    def _steps(self, s: Saturating) -> tuple[Array, Array, Array, Array]:
        """Return r W and r in each interval, and the factors g and h of the solution w_new = g w + h r W."""
        target, rate = (np.asarray(self.splines @ c.ravel()) for c in (s.r * s.bound, s.r))
        return target, rate, np.exp(-rate * self.path.length), -np.expm1(-rate * self.path.length) / rate

    def w(self, s: Saturating) -> Array:
        """Return w at all points of the path."""
        target, _, g, h = self._steps(s)
        return _recursive(g, np.append(s.w0, h * target))

    def errors(self, s: Saturating) -> Array:
        """Return the output errors (rows,)."""
        return np.asarray(s.k * self.path.u + self.w(s)[self.path.rows] - self.y)

    def residuals(self, p: Array) -> Array:
        """Return the residuals and the penalties at a point p of the search."""
        return np.concatenate([self.errors(Saturating.at(p)) / self.sigma, self.penalty @ p])

    def jacobian(self, p: Array) -> Array:
        """Return the derivatives of `residuals`."""
        s, length = Saturating.at(p), self.path.length
        target, rate, g, h = self._steps(s)
        of_rate = -length * g * self.w(s)[:-1] + target * (length * g - h) / rate
        changed = np.zeros((len(self.y), len(p)))
        last = np.eye(1, len(p), len(p) - 1)[0]
        for a in range(0, len(g) + 1, CHUNK):  # w at all points depends on all variables: a long path has many points
            here = slice(a, min(a + CHUNK, len(g)))
            by_r = self.splines[here].toarray() * s.r.ravel()
            by_rate = by_r * (of_rate[here, None] + h[here, None] * s.bound.ravel())
            forced = np.vstack([last, np.hstack([by_rate, by_r * h[here, None], np.zeros((len(by_r), 2))])])
            w = _recursive(g[here], forced)
            rows = (here.start <= self.path.rows) & (self.path.rows <= here.stop)
            changed[rows] = w[self.path.rows[rows] - a]
            last = w[-1]
        changed[:, -2] = self.path.u
        return np.vstack([changed / self.sigma, self.penalty])

    def fitted(self, starts: Sequence[Saturating]) -> Saturating:
        """Return the best result of searches from the start values with the smallest output errors.

        There are at most `SEARCHED` searches, and no further one if the errors are not larger than the noise.
        """
        found = []
        for start in sorted(starts, key=lambda s: rms(self.errors(s)))[:SEARCHED]:
            found.append(refined(self, start.p, EVALUATIONS, TOLERANCE))
            if rms(self.errors(Saturating.at(found[-1].p))) < NOISE * self.sigma:
                break
        return Saturating.at(min(found, key=lambda f: f.cost).p)


def started(u: Array, y: Array, rows: Rows, pieces: tuple[Rows, Rows], n: int) -> list[Saturating]:
    """Return start values with n B-splines for each slope of `SLOPES`, from increments of y over pieces of the path.

    y (rows,) belongs to `rows`, and `pieces` contains the first and the last elements of the pieces in `rows`. A piece
    with a gap in `rows` is not used.
    """
    stride = np.diff(rows).min()
    first, last = (ends[np.ptp(rows[np.array(pieces)], axis=0) == stride * np.ptp(pieces, axis=0)] for ends in pieces)
    du, middle = np.diff(u[rows]), (u[rows][1:] + u[rows][:-1]) / 2
    of_u = _by_direction(middle, du > 0, n) * np.abs(du)[:, None]
    smooth = HELD[0] * np.kron(np.eye(2), np.diff(np.eye(n), 2, axis=0))
    held = (
        np.vstack([smooth, 0 * smooth, HELD[1] * np.eye(2 * n)]),
        np.vstack([0 * smooth, smooth, np.zeros((2 * n, 2 * n))]),
    )

    def sums(columns: Array) -> Array:
        total = np.vstack([np.zeros(2 * n), np.cumsum(columns, axis=0)])
        return np.asarray(total[last] - total[first])

    found = []
    for k in SLOPES:
        w = y - k * u[rows]
        of_r, of_target = sums(-of_u * ((w[1:] + w[:-1]) / 2)[:, None]), sums(of_u)
        dw = np.append(w[last] - w[first], np.zeros(len(held[0])))
        r, target = nonnegative(np.vstack([of_r, held[0]]), dw, np.vstack([of_target, held[1]]))
        r = np.clip(r, START, MOST)
        bound = np.clip(target / r, -FARTHEST, FARTHEST)
        found.append(Saturating(np.log(r).reshape(2, n), bound.reshape(2, n), k, float(w[0])))
    return found


def _by_direction(u: Array, up: Mask, n: int) -> Array:
    """Return B-splines of u (rows, 2 n): for rising input in the first half of the columns, else in the second half."""
    of_u = uniform_splines(u, n)
    return np.hstack([of_u * up[:, None], of_u * ~up[:, None]])


def _recursive(g: Array, forced: Array) -> Array:
    """Return x with x[0] = forced[0] and x[i + 1] = g[i] x[i] + forced[i + 1], for one or several columns."""
    bands = np.vstack([np.ones(len(g) + 1), np.append(-g, 0.0)])
    return np.asarray(solve_banded((1, 0), bands, forced, overwrite_b=True, check_finite=False))
