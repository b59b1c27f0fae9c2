"""Fit and graph of a chain: operator, bend, parts that depend on covariates, creep, dynamics, offset.

`bent_sum` fits weights, bend and creep of a structure.

The bend is a polynomial in the fit and a sum of dead zones in the graph. The sum interpolates the polynomial. It has an
exact inverse, and continues as a straight line outside the range of the training rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from hystfmu.base.arrays import Array, Progress
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.catalogue import Options
from hystfmu.identify.cuts import fitted_and_held
from hystfmu.identify.estimate.dynamics import Dynamics, search
from hystfmu.identify.features import bent_sum
from hystfmu.identify.features.bent_sum import BentSum, Filter, Following, Problem
from hystfmu.identify.features.plays import plays, thresholds, u0_of
from hystfmu.identify.features.smooth_density import RelaySum
from hystfmu.identify.graphs import covariate_inputs, device, scaled_input, wired

MOST_ROWS = 6000  # more rows are thinned evenly, after filtering at the full rate
BETTER, NEEDED = 0.95, 0.5  # ratio of validation errors below which a part, or a bend without inverse, is kept
PLAYS, STOPS, RELAYS = "plays", "stops", "relays"
SMOOTH = 1e-5  # largest distance of the dead zones from the polynomial, relative to its range
MOST_KNOTS = 400
PAIR = {"n": 2, "m": 0}
MARGIN = 0.05  # covariates are limited to the training range and this fraction of it


@dataclass(frozen=True)
class Parts:
    """Structure of a candidate: operator, degree of bend, time constants of creep, dynamics, covariates."""

    operator: str = PLAYS
    degree: int = 1
    T: tuple[float, ...] = ()
    g: Dynamics | None = None
    levels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Trial:
    """A structure, its fit, and its error on the validation blocks."""

    parts: Parts
    fit: BentSum
    error: float

    def or_better(self, other: Trial) -> Trial:
        """Return the other trial if it is clearly better."""
        enough = BETTER if other.fit.monotone or not self.fit.monotone else NEEDED
        return other if other.error < enough * self.error else self


class Fitting:
    """Columns and rows of one fit, and the structures fitted to them.

    Fields: the block that scales u to x in [-1, 1], the start x0; thresholds r of the plays; covariates theta, scaled
    to [-1, 1] from their range low..high; all counted rows, the fitted rows, and the held-out rows.
    """

    def __init__(self, data: Dataset, options: Options) -> None:
        rows, self.data, self.options = data.train, data, options
        u = data.u[: rows.stop]
        self.scaling, gain, offset = scaled_input(u[rows])
        self.x0, x = gain * u0_of(data, options) + offset, gain * u + offset
        self.r = thresholds(x[rows], options["N"])
        self.noise = noise(data.y[data.counted])
        self.relays = RelaySum(x, rows)
        self.plays = np.column_stack([x, plays(x, self.r, self.x0)])
        self.stops = np.column_stack([x, x[:, None] - self.plays[:, 1:]])
        seen = data.covariates.values[: rows.stop]
        self.low, self.high = seen[rows].min(axis=0), seen[rows].max(axis=0)
        self.theta = (seen - (self.low + self.high) / 2) * 2 / (self.high - self.low)
        self.all, self.kept, self.held = fitted_and_held(data, MOST_ROWS)

    def columns(self, operator: str) -> Array:
        """Return the columns of an operator."""
        return {PLAYS: self.plays, STOPS: self.stops}[operator] if operator != RELAYS else self.relays.columns

    def problem(self, parts: Parts, rows: NDArray[np.intp]) -> Problem:
        """Return the problem of `bent_sum` for a structure on some rows."""
        columns = self.columns(parts.operator)
        least, beside = self.options["w0_min"], Following(self.theta[:, : len(parts.levels)], parts.levels)
        after, T = self.filtered(parts.g), np.array(parts.T)
        held = self.relays.penalties if parts.operator == RELAYS else ()
        return Problem(columns, self.data.y[rows], rows, self.data.h, T, after, least, beside, held)

    def filtered(self, g: Dynamics | None) -> Filter | None:
        """Return a function that filters columns by the dynamics."""
        return None if g is None else lambda columns: g.filter(columns, self.data.h, self.options["hold"])

    def fit(
        self, parts: Parts, rows: NDArray[np.intp], start: BentSum | None = None, wanted: float = np.inf
    ) -> BentSum:
        """Fit weights, bend and creep on some rows; start from a fit with fewer parts, or from a fit without a bend."""
        p = self.problem(parts, rows)
        if start is None:
            return bent_sum.fit(p, bent_sum.fit_linear(p, parts.degree))
        grown = np.zeros(parts.degree + 1)
        grown[: min(len(grown), len(start.q))] = start.q[: len(grown)]
        k = start.k if len(start.k) == len(parts.T) else np.full(len(parts.T), 1e-3)
        g = np.where([level == "gain" for level in parts.levels], start.g, 0.0)
        return bent_sum.fit(p, replace(start, q=grown, k=k, g=g, c=np.zeros((len(g), len(grown)))), wanted)

    def tried(self, parts: Parts, start: BentSum | None = None, wanted: float = np.inf) -> Trial:
        """Fit a structure on the rows outside the validation blocks, and compute its error in the blocks."""
        fitted = self.fit(parts, self.kept, start, wanted)
        e = bent_sum.model(self.problem(parts, self.held), fitted) - self.data.y[self.held]
        return Trial(parts, fitted, float(np.sqrt(np.mean(e**2))))

    def dynamics(self, trial: Trial, rows: NDArray[np.intp], progress: Progress) -> Dynamics:
        """Search the dynamics after a given hysteresis, whose weights are computed for every trial."""
        return search(self.residuals(trial, rows), self.data, self.options, progress, trial.parts.g)

    def residuals(self, trial: Trial, rows: NDArray[np.intp]) -> Callable[[Dynamics], Array]:
        """Return a function from dynamics to the residuals, with a hysteresis near the hysteresis of the trial."""
        left = bent_sum.residuals(self.problem(trial.parts, rows), trial.fit)
        return lambda g: left(self.filtered(g))


def chain(f: Fitting, parts: Parts, s: BentSum) -> Graph:
    """Return the graph of a structure with its fit."""
    data = f.data
    slope, r, weights, at_0 = dead_zones(s.q)
    front = [
        f.scaling,
        _hysteresis(f, parts.operator, s.w),
        Node("bend", "dead_zones", {"n": len(r)}, {"w0": slope, "r": r, "w": weights}),
    ]
    nodes, wires, inputs = [*front], wired(front), [Input("u", ("input.u",), data.unit_u, data.u[0])]
    used = [j for j, level in enumerate(parts.levels) if level != "none"]
    if used:
        more, joined, ends = _beside(f, parts, s, used, at_0)
        nodes, wires = nodes + more, wires + joined
        inputs += [covariate_inputs(data, ends)[j] for j in used]
    tail = [nodes[-1]]
    if parts.T:
        tail.append(Node("creep", "creep", {}, {"w0": 1.0, "w": s.k, "T": np.array(parts.T), "start": "steady"}))
    if parts.g:
        source = Output("y", f"{tail[-1].name}.y")
        at_rest = Graph(nodes + tail[1:], wires + wired(tail), inputs, [source])
        beside = data.covariates.values[:1, used]
        first = float(at_rest.run(np.column_stack([data.u[:1], beside]), data.h)[0])
        dynamics = parts.g.nodes(data.h, f.options["hold"])
        tail += [dynamics[0], *(n.with_values(y0=first) for n in dynamics[1:])]
    tail.append(Node("readout", "scaling", {"n": 1}, {"offset": at_0 * (1 + s.k.sum())}))
    return device(data, nodes + tail[1:], wires + wired(tail), beside=inputs[1:])


def _hysteresis(f: Fitting, operator: str, w: Array) -> Node:
    if operator == "relays":
        return f.relays.node("hysteresis", w)
    signed = np.concatenate([[w.sum()], -w[1:]]) if operator == "stops" else w
    return Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": signed[0], "r": f.r, "w": signed[1:], "u0": f.x0})


def _beside(
    f: Fitting, parts: Parts, s: BentSum, used: list[int], at_0: float
) -> tuple[list[Node], list[tuple[str, str]], list[tuple[str, ...]]]:
    """Return the blocks and wires of a bend that depends on covariates, and their endpoints.

    `used` are the numbers of the covariates with an effect. `at_0` is the value of the bend at 0, which the block of
    the bend does not include.
    """
    names, n = f.data.covariates.names, len(used)
    half = (f.high - f.low)[used] / 2
    middle = (f.high + f.low)[used] / 2
    limits = {"lo": f.low[used] - 2 * MARGIN * half, "hi": f.high[used] + 2 * MARGIN * half}
    nodes = [Node("covariates", "scaling", {"n": n}, {"gain": 1 / half, "offset": -middle / half, **limits})]
    wires: list[tuple[str, str]] = []
    source, theta = "bend.y", [f"covariates.y[{i + 1}]" for i in range(n)]
    offsets = s.g[used] * at_0 + s.c[used, 0]
    bent: list[str] = []
    if s.g.any():
        nodes += [Node("gain", "sum", {"n": n}, {"k": s.g[used], "offset": 1.0}), Node("scheduled", "product", PAIR)]
        wires += [("covariates.y", "gain.u"), (source, "scheduled.u[1]"), ("gain.y", "scheduled.u[2]")]
        source = "scheduled.y"
    for i, j in enumerate(used):
        if parts.levels[j] != "bend":
            continue
        slope, r, weights, offsets[i] = dead_zones(s.c[j])
        bend, times = f"bend_{names[j]}", f"times_{names[j]}"
        nodes.append(Node(bend, "dead_zones", {"n": len(r)}, {"w0": slope, "r": r, "w": weights}))
        nodes.append(Node(times, "product", PAIR))
        wires += [("hysteresis.y", f"{bend}.u"), (f"{bend}.y", f"{times}.u[1]"), (theta[i], f"{times}.u[2]")]
        bent.append(f"{times}.y")
    k = np.concatenate([[1.0], offsets, np.ones(len(bent))])
    nodes.append(Node("following", "sum", {"n": len(k)}, {"k": k}))
    wires += [(end, f"following.u[{i + 1}]") for i, end in enumerate([source, *theta, *bent])]
    ends: list[tuple[str, ...]] = [
        (f"covariates.u[{used.index(j) + 1}]",) if j in used else () for j in range(len(names))
    ]
    return nodes, wires, ends


def dead_zones(q: Array) -> tuple[float, Array, Array, float]:
    """Return linear weight, thresholds (n,), weights (n,) and value at 0 of dead zones that follow a curve on [-1, 1].

    The curve is a Legendre series with coefficients q.  No threshold is 0, which is the input itself; at 0 the dead
    zones give 0.  Beyond the thresholds the curve is straight.
    """
    if len(q) <= 2:
        return float(q[1]) if len(q) > 1 else 0.0, np.array([1.0]), np.zeros(1), float(q[0])
    fine = np.linspace(-1.0, 1.0, 4001)
    wanted = legendre.legval(fine, q)
    m = 4
    while True:
        at = (np.arange(2 * m) - m + 0.5) / (m - 0.5)  # from -1 to 1, symmetrical, without 0
        height = legendre.legval(at, q)
        if 2 * m >= MOST_KNOTS or np.abs(np.interp(fine, at, height) - wanted).max() <= SMOOTH * np.ptp(wanted):
            break
        m *= 2
    slope = np.diff(height) / np.diff(at)
    centre = float(slope[m - 1])
    change = np.diff(slope)  # at at[1:-1]
    r = at[1:-1]
    weights = np.where(r > 0, change, -change)
    return centre, np.asarray(r), np.asarray(weights, float), float(height[m - 1] - centre * at[m - 1])
