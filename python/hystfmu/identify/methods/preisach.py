"""Preisach model with a smooth density, weights >= 0, and parallel rate-dependent terms if the data show them.

  y = c + integral over alpha >= beta of mu(alpha, beta) relay_{alpha, beta}[u]
        [ + sum_l k_l q_l + sum_j d_j S(q_b - m, r_j) ],   T_l q_l' = u - q_l,  T_b q_b' = u - q_b

mu is a smooth function with few parameters (`smooth_density`). Unlike in a sum of plays, the shape of minor loops
depends on their position. The model has the wiping-out and congruence properties (Mayergoyz, Mathematical Models of
Hysteresis, 1991, ch. 1). The terms in brackets are creep (Krejci & Kuhnen 2001), and dead zones S of a lagged input q_b
with the thresholds r_j, where m is the mean of u. The dead zones widen the loop at higher rates.

The model is linear in the weights x >= 0 of the density and in the free weights v = (k, d) of the rate-dependent terms.
A and F are the matrices of the regressors. The weights minimise |y - c - A x - F v|^2 + s_0^2 |scaled (x, v)|^2 + sum_i
s_i^2 |P_i x|^2. The penalties keep the density smooth. Tenfold cross-validation determines the strengths s of the
penalties, and whether the model has rate-dependent terms. The training rows are divided into ten chunks of consecutive
rows. For each chunk, the normal equations of all other chunks are computed once. The ridge penalty keeps them well
conditioned: its least strength is 1e-4, for columns of norm 1. Therefore fits with other strengths are fast.

With the option ``density=bell``, the logarithm of mu is smooth, and a static nonlinearity follows, see
`features.bell_density`. A bell curve is replaced by a density of a more general shape if this reduces the error on
validation blocks.
"""

from collections.abc import Sequence

import numpy as np

from hystfmu.base import Array, Indices, Progress
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.graph import Graph, Node
from hystfmu.graph.recursion import lag
from hystfmu.identify.catalogue import ANY, Candidate, Memory, Option, Options, Row, device, scaled_input, wired
from hystfmu.identify.cuts import fitted_and_held
from hystfmu.identify.features.bell_density import ROUGH, Problem, Relays
from hystfmu.identify.features.bent_chain import dead_zones as polygon
from hystfmu.identify.features.smooth_density import smooth_density
from hystfmu.identify.solvers.nonnegative import LEAST_SIZE, nonnegative
from hystfmu.model import rms

FOLDS = 10
EXACT = 1e-12  # least mean square error, relative to that of y, which keeps the normal equations positive definite

Strengths = tuple[float, ...]
TEXT = "smooth density of relays, weights >= 0, and rate dependence; gives the Everett function"
# strengths that are tried: of the ridge, and of the smoothness penalties over the mean and over the half-difference
LEVELS = ((1e-4, 1e-3, 1e-2), (3e-3, 3e-2, 0.3), (3e-3, 3e-2, 0.3))
LAGS, DEAD_ZONES = 6, 6
BETTER = 0.6  # ratio of errors below which rate-dependent terms are kept; in a slow record they can imitate a memory
SMOOTH = (0.1, 1.0, 5.0)  # standard deviations of the third differences of ln mu that are tried
CLEARLY, LEAST_NOISE = 0.9, 1e-4  # ratio of validation errors; smallest assumed noise, relative to half the span
MOST_ROWS, PER_CELL = 3000, 4  # maximum number of rows of a fit of ln mu, also for each cell; others are thinned evenly
LINEAR, BELL = "linear", "bell"
CANDIDATES = (
    Candidate(ANY, 1.2, 0.12, quick={"n": 20, "widths": 12, "means": 4}),
    Candidate(ANY, 0.5, 0.8, options={"density": BELL}, quick={"n": 20}),
)
OPTIONS = (
    Option("density", LINEAR, choices=(LINEAR, BELL), text="whether the density or its logarithm is linear in weights"),
    Option("bend", 5, 1, 20, text="degree of the static nonlinearity after a density of the form bell"),
    Option("n", 40, 1, 100, text="number of grid steps of the Everett function"),
    Option("widths", 32, 2, 100, text="number of hat functions of the half-difference of the two thresholds"),
    Option("means", 8, 1, 50, text="number of B-splines of the mean of the two thresholds"),
    Option("rate", None, choices=("yes", "no"), text="creep and rate dependence; default: by cross-validation"),
    Option("start", "demagnetised", choices=("demagnetised", "low", "high"), text="memory before the first row"),
)


class Penalised:
    """Penalised least-squares problem with non-negative weights of `bounded` (n, p) and free weights of `free` (n, q).

    The target is y (n,). `penalties` contains matrices P_i (m, p), which are multiplied by the median norm of the
    columns. Therefore their strengths do not depend on the scale of the columns.
    """

    def __init__(self, bounded: Array, free: Array, y: Array, penalties: Sequence[Array]) -> None:
        columns = np.column_stack([bounded, free])
        self.n, self.m = bounded.shape[1], columns.shape[1]
        self.middle, self.mean = columns.mean(axis=0), float(y.mean())
        columns = columns - self.middle
        size = np.linalg.norm(columns, axis=0)
        size[: self.n] = np.maximum(size[: self.n], LEAST_SIZE * size[: self.n].max())
        size[size == 0] = 1.0
        self.size = size
        typical = float(np.median(size[: self.n]))
        wide = [np.hstack([p / size[: self.n] * typical, np.zeros((len(p), self.m - self.n))]) for p in penalties]
        self._penalties = [P.T @ P for P in (np.eye(self.m), *wide)]
        rows = np.column_stack([columns / size, np.ones(len(y)), y - self.mean])
        self._chunks = np.array_split(rows, min(FOLDS, len(y) // 2))
        parts = [chunk.T @ chunk for chunk in self._chunks]
        self._whole = np.sum(parts, axis=0)
        self._without = [self._whole - part for part in parts]

    def solve(self, strengths: Strengths) -> tuple[Array, Array, float]:
        """Solve the problem for given strengths of the penalties; return the weights x (p,), v (q,) and the offset c.

        The first strength belongs to the ridge penalty, and the others belong to the matrices P_i.
        """
        z = self._solved(self._whole, strengths)
        w = z[:-1] / self.size
        return w[: self.n], w[self.n :], float(self.mean + z[-1] - self.middle @ w)

    def error(self, strengths: Strengths) -> float:
        """Return the RMS cross-validation error for given strengths of the penalties.

        Each chunk is predicted by a fit to all other chunks.
        """
        folds = zip(self._chunks, self._without, strict=True)
        left = [chunk[:, :-1] @ self._solved(others, strengths) - chunk[:, -1] for chunk, others in folds]
        return rms(np.concatenate(left))

    def _solved(self, products: Array, strengths: Strengths) -> Array:
        """Return the weights of the scaled columns and the constant term, for the normal equations `products`.

        `products` (m + 2, m + 2) contains the products of the scaled columns, the constant and the target. `strengths`
        contains the strengths of the penalties.
        """
        whole = products.copy()
        whole[: self.m, : self.m] += sum(s**2 * P for s, P in zip(strengths, self._penalties, strict=True))
        whole[-1, -1] *= 1 + EXACT
        R = np.asarray(
            np.linalg.cholesky(whole).T, dtype=np.float64
        )  # triangular factor of the columns with the rows of the penalties
        x, v = nonnegative(R[:, : self.n], R[:, -1], R[:, self.n : -1])
        return np.concatenate([x, v])


def best_strengths(problem: Penalised, levels: Sequence[Strengths], progress: Progress) -> tuple[Strengths, float]:
    """Return the strengths with the smallest cross-validation error, and this error.

    `levels` contains the permitted values of each strength. The search begins with the middle value of each strength.
    It changes one strength after the other until no change reduces the error.
    """
    at = [len(some) // 2 for some in levels]
    known: dict[tuple[int, ...], float] = {}

    def error(place: list[int]) -> float:
        key = tuple(place)
        if key not in known:
            known[key] = problem.error(tuple(some[i] for some, i in zip(levels, place, strict=True)))
            progress(min(1.0, len(known) / (3 * sum(map(len, levels)))))
        return known[key]

    while True:
        before = list(at)
        for axis, some in enumerate(levels):
            places = [[*at[:axis], i, *at[axis + 1 :]] for i in range(len(some))]
            at = min(places, key=error)
        if at == before:
            return tuple(some[i] for some, i in zip(levels, at, strict=True)), error(at)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit the model of the module docstring; return graph and number of weights."""
    if options["density"] == BELL:
        return _bell(data, options, progress)
    rows = data.counted
    u, y = data.u[rows], data.y[rows]
    density = smooth_density(data.u[data.train], options["n"], options["widths"], options["means"], options["start"])
    bounded = data.along(density.columns, data.train.stop)[rows]
    sign = -1.0 if np.sum((u - u.mean()) * (y - y.mean())) < 0 else 1.0  # -1 if the output falls as u rises
    progress(0.2)
    rate = _Rate(data)
    tried: list[tuple[float, Array, Array, float]] = []
    for free in [np.zeros((len(u), 0))] * (options["rate"] != "yes") + [rate.columns] * (options["rate"] != "no"):
        problem = Penalised(bounded, free, sign * y, (density.along_mean, density.along_width))
        done = 0.2 + 0.4 * len(tried)
        strengths, error = best_strengths(problem, LEVELS, lambda f, done=done: progress(done + 0.4 * f))  # type: ignore[misc]
        if not tried or error < BETTER * tried[-1][0]:
            tried.append((error, *problem.solve(strengths)))
    _, x, v, offset = tried[-1]
    hysteresis = density.node("hysteresis", sign * (density.E @ x), sign * offset)
    alone = device(data, [hysteresis], (), ["hysteresis.u"], "hysteresis.y")
    return rate.behind(hysteresis, sign * v, data) if len(v) else alone, len(x) + len(v) + 1


def _bell(data: Dataset, options: Options, progress: Progress) -> tuple[Graph, int]:
    """Fit a density with a smooth logarithm and a static nonlinearity."""
    scaling, gain, offset = scaled_input(data.u[: data.train.stop])
    n = int(options["n"])
    x, (every, kept, held) = gain * data.u + offset, fitted_and_held(data, min(MOST_ROWS, PER_CELL * n * (n + 1) // 2))
    held = held if len(held) else kept
    size, middle = data.span / 2, float(data.y[data.counted].mean())
    y = (data.y[every] - middle) / size
    sigma = max(noise(data.y[data.counted]) / size, LEAST_NOISE)
    cuts = [(r.start, every[(r.start <= every) & (every < r.stop)]) for r in data.records]
    parts = [(x[first : rows[-1] + 1], rows - first) for first, rows in cuts if len(rows)]
    demagnetised = options["start"] == "demagnetised"

    def problem(of: Relays, rows: Indices, smooth: float) -> Problem:
        used = np.isin(every, rows)
        return Problem(of.on(used), y[used], options["bend"], smooth, sigma)

    first = Relays(parts, n, float(x[0]) if demagnetised else 0.0, options["start"], demagnetised)
    best = problem(first, kept, SMOOTH[0]).started()
    progress(0.5)
    seen = Relays(parts, n, best.centre, options["start"], False, first.half)
    smooth, least = SMOOTH[0], np.inf
    for level in SMOOTH:
        trial = problem(seen, kept, level).fitted(best, ROUGH)
        error = rms(problem(seen, held, level).errors(trial))
        if not error < CLEARLY * least:
            break
        best, least, smooth = trial, error, level
    progress(0.8)
    last = problem(seen, every, smooth)
    best = last.fitted(best)
    slope, r, weights, at_0 = polygon(best.q)
    nodes = [
        scaling,
        last.node(best),
        Node("bend", "dead_zones", {"n": len(r)}, {"w0": slope, "r": r, "w": weights}),
        Node("readout", "scaling", {"n": 1}, {"gain": size, "offset": middle + size * at_0}),
    ]
    return device(data, nodes, wired(nodes)), len(best.ln_mu) + len(best.q) + 2


class _Rate:
    """Regressors and blocks of the rate-dependent terms: creep, and dead zones of a lagged input."""

    def __init__(self, data: Dataset) -> None:
        rows, h = data.counted, data.h
        longest = max(data.train.stop * h / 3, 10 * h)
        self.T = np.geomspace(h, longest, LAGS)
        self.T_bend = 4 * h
        self.middle = float(data.u[data.train].mean())
        self.s = knots(data.u[data.train] - self.middle, DEAD_ZONES)
        filters = [lag(h, T) for T in (*self.T, self.T_bend)]
        *crept, bent = data.along(lambda u: np.hstack([f.run(u[:, None]) for f in filters]))[rows].T
        self.columns = np.column_stack([*crept, dead_zones(bent - self.middle, self.s)])

    def behind(self, hysteresis: Node, v: Array, data: Dataset) -> Graph:
        """Return the graph of the hysteresis in parallel with the rate-dependent terms, whose weights are v."""
        nodes = [
            hysteresis,
            Node("creep", "creep", {}, {"w": v[:LAGS], "T": self.T, "start": "steady"}),
            Node("lag", "creep", {}, {"w": 1.0, "T": self.T_bend, "start": "steady"}),
            Node("middle", "scaling", {"n": 1}, {"offset": -self.middle}),
            Node("bend_of_lag", "dead_zones", {}, {"w0": 0.0, "r": self.s, "w": v[LAGS:]}),
            Node("readout", "sum", {"n": 3}),
        ]
        wires = [("lag.y", "middle.u"), ("middle.y", "bend_of_lag.u")]
        wires += [(f"{name}.y", f"readout.u[{i}]") for i, name in enumerate(("hysteresis", "creep", "bend_of_lag"), 1)]
        return device(data, nodes, wires, ["hysteresis.u", "creep.u", "lag.u"])


def knots(u: Array, n: int) -> Array:
    """Return n equally spaced thresholds of dead zones inside the range of u.

    A threshold near 0 is replaced by a small value, because a dead zone with the threshold 0 returns its input.
    """
    s = u.min() + np.ptp(u) * np.arange(1, n + 1) / (n + 1)
    least = 1e-6 * np.ptp(u)
    return np.where(np.abs(s) < least, least, s)


def dead_zones(u: Array, s: Array) -> Array:
    """Return the outputs (n, m) of one-sided dead zones of u (n,) with the thresholds s (m,).

    The output is max(u - s, 0) for a positive threshold, and min(u - s, 0) for any other threshold.
    """
    d = u[:, None] - s
    return np.where(s > 0, np.maximum(d, 0), np.minimum(d, 0))


KINDS = {"preisach": Row(TEXT, build, OPTIONS, CANDIDATES, Memory(9800.0, "n", 2), records=True)}
