"""Duhem model for static loops without return-point memory.

The slope of the output is a function of input, output and direction. Each direction of u has its own coefficients:

  y = c + k u + w, dw/du = sum_{i<=m} B_i(u) (a_i + sum_{j<=q} (b_ij w^j + c_ij |w| w^(j-1))).

B_i are B-splines of the scaled input. With the option `slopes`, the slopes are either polynomials of w or saturating:
w approaches a bound, see `features.saturating`. The rest of this text applies to polynomials.

For given k and c, w is known at every row, and linear least squares of the increments of w gives the coefficients. The
increments are taken between neighbouring rows, or over longer monotone pieces if u is noisy. k and c minimise the
residual (variable projection, Golub & Pereyra 1973). Then all parameters and the first value of w are refined, so that
the output error of a simulation is minimised. This search uses an orthonormal basis of the terms, because powers are
nearly linearly dependent. Source: Oh & Bernstein, IEEE Trans. Autom. Control 50 (2005) 631-645.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError, Mask, Progress
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.graph import Graph, Node
from hystfmu.graph.splines import uniform_splines
from hystfmu.identify.catalogue import OPENS, Candidate, Memory, Option, Options, Row, device, scaled_input, wired
from hystfmu.identify.cuts import fitted_and_held
from hystfmu.identify.features.plays import DEAD_BAND
from hystfmu.identify.features.saturating import Level, Path, Problem, Rows, Saturating, started
from hystfmu.identify.solvers.trust_region import Differences, refined
from hystfmu.model import rms

TEXT = "slopes for rising and falling input, polynomial or saturating, least squares, refined on the free run"
EVALUATIONS = (60, 30)  # maximum number of evaluations of residuals and Jacobian: for k and c, for all parameters
STARTS = (0.0, 0.5, 1.0)  # start values of k, relative to the slope of the regression line
TOLERANCE, STEP = 1e-8, 1e-7  # relative change that ends a search; step of a finite difference
PIECE = 5.0  # length of a piece of the path, in dead bands; the noise at its ends is then an eighth of its length
CLOSE = 0.05  # RMS error, relative to half the span, below which no further start value is refined
ROOM = 3.0  # bound of |w|, relative to the largest |w| in the data

# saturating slopes: the levels are tried until the error on validation blocks is below NOISE times the noise, or is not
# below BETTER times the error of the last level
LEVELS = (Level(20, 0.03, 0.01), Level(20, 0.3, 0.1), Level(40, 0.3, 0.1), Level(80, 0.3, 0.1))
BETTER, NOISE = 0.95, 1.1
LEAST_NOISE = 1e-4  # smallest assumed noise, relative to half the span
SPLIT = 0.02  # smallest change of the scaled input over a piece of the path
MOST_ROWS = 6000  # maximum number of rows of a fit of saturating slopes; more rows are thinned evenly
LONGEST = 0.5  # longest step of the integration, relative to the shortest way in which w approaches its bound by 1/e

POLYNOMIAL, SATURATING = "polynomial", "saturating"
CANDIDATES = (Candidate(OPENS, 0.2, 0.5), Candidate(OPENS, 0.5, 0.4, options={"slopes": SATURATING}))
OPTIONS = (
    Option("slopes", POLYNOMIAL, choices=(POLYNOMIAL, SATURATING), text="slope dw/du as a function of the output"),
    Option(
        "m", None, 0, 100, text="number of B-splines of the input, less 1; default: 0; selected for saturating slopes"
    ),
    Option("q", 5, 1, 10, text="degree of the slope dw/du as a polynomial of the output"),
    DEAD_BAND,
)


def basis(u: Array, w: Array, m: int, q: int) -> Array:
    """Return the terms of dw/du at u and w (rows,), shape (rows, (m + 1) (2 q + 1)).

    The terms are the products of B_i(u), i = 0..m, with 1, w^j and |w| w^(j-1), j = 1..q.
    """
    powers = w[:, None] ** np.arange(q)
    of_w = np.column_stack([np.ones(len(w)), w[:, None] * powers, np.abs(w)[:, None] * powers])
    of_u = uniform_splines(u, m + 1)
    return np.asarray((of_u[:, :, None] * of_w[:, None, :]).reshape(len(w), -1))


def segments(u: Array, least: float) -> tuple[Rows, Rows]:
    """Return the first and the last rows of monotone pieces of u (n,).

    The input changes by at least `least` over a piece, unless a reversal ends the piece. If u is noisy, increments over
    longer pieces have less relative noise than increments between neighbouring rows.
    """
    first, last, direction = [0], [], 0.0
    for k in range(1, len(u)):
        s = float(np.sign(u[k] - u[k - 1]))
        if k - 1 > first[-1] and (direction * s < 0 or abs(u[k - 1] - u[first[-1]]) >= least):
            last.append(k - 1)
            first.append(k - 1)
            direction = 0.0
        direction = s or direction
    return np.array(first), np.array([*last, len(u) - 1])


class _Slopes:
    """Linear least-squares problem for each direction of u: increments of w are weighted sums of terms of dw/du."""

    def __init__(self, u: Array, y: Array, kept: Mask, m: int, q: int, least: float) -> None:
        self.u, self.y, self.m, self.q = u, y, m, q
        self.terms = (m + 1) * (2 * q + 1)
        self.first, self.last = segments(u, least)
        way = u[self.last] - u[self.first]
        out = np.concatenate([[0], np.cumsum(~kept)])
        way[out[self.last + 1] > out[self.first]] = 0.0  # a piece that contains a held-out row is not used
        self.parts = [np.flatnonzero(s * way > 0) for s in (1, -1)]

    def solve(self, k: float, c: float) -> tuple[list[Array], list[Array], Array]:
        """Return the coefficients (p,) for rising and falling input, for given k and c.

        The method also returns the matrices (p, p) that make the terms of each direction orthonormal, and the residuals
        of all increments.
        """
        u, w = self.u, self.y - k * self.u - c
        theta, factors, left = [], [], []
        terms = basis((u[:-1] + u[1:]) / 2, (w[:-1] + w[1:]) / 2, self.m, self.q)
        sums = np.add.reduceat(np.diff(u)[:, None] * terms, self.first)
        for pieces in self.parts:
            U, s, Vt = np.linalg.svd(sums[pieces], full_matrices=False)
            factor = Vt.T / np.maximum(s, 1e-10 * s[0])
            dw = w[self.last[pieces]] - w[self.first[pieces]]
            x = U.T @ dw
            x[s <= 1e-10 * s[0]] = 0  # for linearly dependent terms, the smallest weights are used
            theta.append(factor @ x)
            factors.append(factor)
            left.append(dw - U @ x)
        return theta, factors, np.concatenate(left)


def _node(theta: list[Array], k: float, w0: float, u0: float, w_max: float, m: int, q: int) -> Node:
    values: dict[str, Any] = {"k": k, "w_max": w_max, "w0": float(np.clip(w0, -w_max, w_max)), "u0": u0}
    for end, coefficients in zip(("rise", "fall"), theta, strict=True):
        by_power = coefficients.reshape(m + 1, 2 * q + 1)
        values |= {f"a_{end}": by_power[:, 0], f"b_{end}": by_power[:, 1 : q + 1], f"c_{end}": by_power[:, q + 1 :]}
    return Node("operator", "duhem", {"m": m, "q": q}, values)


class _Start:
    """Start point of the second search, and the output error as a function of the changes x from this point."""

    def __init__(self, slopes: _Slopes, x: Array, u: Array, y: Array, rows: slice, kept: Mask) -> None:
        self.k, self.c = x
        self.slopes, self.u, self.y, self.rows, self.kept = slopes, u, y, rows, kept
        self.theta, self.factors, _ = slopes.solve(self.k, self.c)
        w = (y - self.k * u[rows] - self.c)[kept]
        self.w_max = ROOM * float(np.abs(w).max())
        self.first = float(w[0]) if kept[0] and rows.start == 0 else 0.0
        self.cost = float(np.sum(self.error(np.zeros(3 + 2 * slopes.terms)) ** 2))

    def parts(self, x: Array) -> tuple[list[Array], float, float, float]:
        """Return the coefficients of both directions, k, c and the first value of w after the changes x."""
        p = self.slopes.terms
        pairs = enumerate(zip(self.theta, self.factors, strict=True))
        changed = [t + f @ x[3 + d * p : 3 + (d + 1) * p] for d, (t, f) in pairs]
        return changed, self.k + x[0], self.c + x[1], self.first + x[2]

    def error(self, x: Array) -> Array:
        """Return the scaled output errors of the simulation after the changes x, on training rows not held out."""
        now, slope, offset, w0 = self.parts(x)
        node = _node(now, slope, w0, float(self.u[0]), self.w_max, self.slopes.m, self.slopes.q)
        run = Graph.single(node).run(self.u)
        kept = self.kept
        return np.asarray((run[self.rows] + offset - self.y)[kept] / np.sqrt(kept.sum()))


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit the graph ``scaling -> duhem -> scaling``; return graph and number of parameters.

    If one direction has fewer increments than coefficients, an InputError is raised.
    """
    rows, counted = data.train, data.counted
    scaling, gain, shift = scaled_input(data.u[: rows.stop])  # later rows do not affect the training rows
    u, centre, size = gain * data.u[: rows.stop] + shift, float(data.y[counted].mean()), data.span / 2
    y = (data.y[rows] - centre) / size
    fitted = _saturating if options["slopes"] == SATURATING else _polynomial
    node, offset, count = fitted(data, options, u, y, gain, progress)
    nodes = [scaling, node, Node("readout", "scaling", {"n": 1}, {"gain": size, "offset": centre + size * offset})]
    return device(data, nodes, wired(nodes)), count


def _saturating(
    data: Dataset, options: Options, u: Array, y: Array, gain: float, progress: Progress
) -> tuple[Node, float, int]:
    """Return the operator with saturating slopes, the offset of the output, and the number of parameters."""
    every, kept, held = fitted_and_held(data, MOST_ROWS)
    held = held if len(held) else kept
    sigma = max(noise(y), LEAST_NOISE)
    n = None if options["m"] is None else int(options["m"]) + 1
    levels = LEVELS if n is None else [replace(level, splines=n) for level in LEVELS[:2]]

    def problem(rows: Rows, level: Level) -> Problem:
        return Problem(Path(u, rows), y[rows - data.train.start], level, sigma)

    def fitted(rows: Rows, level: Level, more: list[Saturating]) -> Saturating:
        p, pieces = problem(rows, level), segments(u[rows], max(SPLIT, PIECE * options["dead_band"] * gain))
        return p.fitted([*started(u, p.y, rows, pieces, level.splines), *more])

    level, least = levels[0], np.inf
    found: list[Saturating] = []
    for i, tried in enumerate(levels):
        progress(0.6 * i / len(LEVELS))
        trial = fitted(kept, tried, [each.finer(tried.splines) for each in found])
        error = rms(problem(held, tried).errors(trial))
        if not error < BETTER * least:
            break
        level, found, least = tried, [trial], error
        if error < NOISE * sigma:
            break
    best = fitted(every, level, found)
    w = problem(every, level).w(best)
    by_direction = [
        s * np.column_stack([r * W, -r, 0 * r]) for s, r, W in zip((1, -1), best.r, best.bound, strict=True)
    ]
    theta = [coefficients.ravel() for coefficients in by_direction]
    node = _node(theta, best.k, best.w0, float(u[0]), ROOM * float(np.abs(w).max()), level.splines - 1, 1)
    longest = min(LONGEST / float(best.r.max()), float(node.value("du_max")[0]))
    return node.with_values(du_max=longest), 0.0, len(best.p)


def _polynomial(
    data: Dataset, options: Options, u: Array, y: Array, gain: float, progress: Progress
) -> tuple[Node, float, int]:
    """Return the operator with polynomial slopes, the offset of the output, and the number of parameters."""
    rows, m, q = data.train, int(options["m"] or 0), options["q"]
    kept = np.zeros(len(data.u), dtype=bool)
    kept[data.counted] = True
    kept = kept[rows]
    slopes = _Slopes(u[rows], y, kept, m, q, PIECE * options["dead_band"] * gain)
    if min(map(len, slopes.parts)) < slopes.terms:
        rises, falls = map(len, slopes.parts)
        raise InputError(
            f"{data.path or data.name}: The training rows for duhem with m = {m}, q = {q} must have at least "
            f"{slopes.terms} rows of rising and of falling u. Got {rises} and {falls} instead."
        )
    line = np.linalg.lstsq(np.column_stack([u[rows], np.ones(len(y))])[kept], y[kept], rcond=None)[0]
    increments = Differences(lambda p: slopes.solve(p[0], p[1])[2], np.full(2, 0.1), step=STEP)
    tries = []
    for i, share in enumerate(STARTS):
        progress(0.3 * i / len(STARTS))
        tries.append(refined(increments, np.array([share * line[0], 0.0]), EVALUATIONS[0], TOLERANCE))
    # coefficients with the smallest error of the increments can have a large output error, so this error is compared
    starts = sorted((_Start(slopes, r.p, u, y, rows, kept) for r in tries), key=lambda s: s.cost)
    results = []
    for i, start in enumerate(starts):
        progress(0.3 + 0.6 * i / len(starts))
        p = np.zeros(3 + 2 * slopes.terms)
        found = refined(Differences(start.error, p + 1, step=STEP), p, EVALUATIONS[1], TOLERANCE, by_jacobian=True)
        results.append((start, found))
        if found.misfit < CLOSE:
            break
    start, found = min(results, key=lambda pair: pair[1].cost)
    now, slope, offset, w0 = start.parts(found.p)
    return _node(now, slope, w0, float(u[0]), start.w_max, m, q), offset, len(found.p)


KINDS = {"duhem": Row(TEXT, build, OPTIONS, CANDIDATES, Memory(1700.0, "q"))}
