"""Structured actuator: plays, bend, creep, linear dynamics with delay; the parts that the data support.

  x = scaled u,  v = w0 x + sum_i w_i p_i[x],  b = b(v),  c = b + sum_j k_j L_{T_j}[b],  y = e^(-s tau) G0(s) c + offset

This is the chain of a piezo, magnetostrictive or polymer actuator: rate-independent hysteresis (Kuhnen 2003), a smooth
readout, creep as a few lags with time constants one decade apart (Krejci & Kuhnen 2001), and the dynamics G0(s) of Yu &
Alici 2005.  `bent_sum` fits weights, bend and creep for given dynamics; f_n, zeta and tau are searched outside
(variable projection).

A part is kept if it reduces the error on validation blocks inside the training rows by more than `BETTER`.  Stops take
the place of plays where the loop runs clockwise.  A bend that is not monotone has no inverse: it must gain `NEEDED`.

In the graph the bend is a sum of dead zones that interpolates the polynomial, because that has an exact inverse and
continues as a straight line outside the range of the training rows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.features import bent_sum
from hystfmu.identify.features.bent_sum import BentSum, Problem
from hystfmu.identify.features.dynamics import DYNAMICS_OPTIONS, Dynamics, search, uncertainty, unknown
from hystfmu.identify.features.initial_memory import u0_of, u0_option
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.features.validation_blocks import validation_rows
from hystfmu.identify.options import Option

TEXT = "plays, bend, creep, G0(s) with delay: the parts that validation blocks support"
MOST_ROWS = 6000  # more rows are thinned evenly, after filtering at the full rate
FIRST = 3  # the first search of the dynamics uses every third of these rows
DEGREES = (1, 3, 5, 8)  # of the bend, tried in turn
LAGS = 6  # at most, one decade apart
BETTER, NEEDED = 0.95, 0.5  # ratio of validation errors below which a part, or a bend without inverse, is kept
SMOOTH = 1e-5  # largest distance of the dead zones from the polynomial, relative to its range
MOST_KNOTS = 400

OPTIONS = (
    Option("N", 40, 1, 10000, text="number of plays"),
    Option("bend", None, 1, 20, text="degree of the bend, 1: none; default: chosen on validation blocks"),
    Option("creep", None, choices=("yes", "no"), text="creep; default: chosen on validation blocks"),
    Option("dynamics", None, choices=("yes", "no"), text="G0(s) with delay; default: chosen on validation blocks"),
    Option("w0_min", 1e-3, 0.0, 1.0, text="least weight of the linear term, relative to the sum of all weights"),
    u0_option("every play rests"),
    *DYNAMICS_OPTIONS,
)


@dataclass(frozen=True)
class Parts:
    """Structure of a candidate: sign of the plays, degree of the bend, time constants of creep, dynamics."""

    stops: bool = False
    degree: int = 1
    T: tuple[float, ...] = ()
    g: Dynamics | None = None


class _Fitting:
    """Columns and rows of one fit, and the candidates fitted so far."""

    def __init__(self, data: Dataset, options: Mapping[str, Any]) -> None:
        rows, self.data, self.options = data.train, data, options
        u = data.u[: rows.stop]
        self.middle, self.half = float(u[rows].max() + u[rows].min()) / 2, float(np.ptp(u[rows])) / 2
        self.x0 = (u0_of(data, options) - self.middle) / self.half
        x = (u - self.middle) / self.half
        self.r = thresholds(x[rows], options["N"])
        self.plays = np.column_stack([x, plays(x, self.r, self.x0)])
        self.stops = np.column_stack([x, x[:, None] - self.plays[:, 1:]])
        every = np.arange(rows.stop)[data.counted]
        self.all = every[:: -(-len(every) // MOST_ROWS)]
        held = np.zeros(rows.stop, dtype=bool)
        held[rows] = validation_rows(data.u[rows])
        self.kept, self.held = self.all[~held[self.all]], self.all[held[self.all]]

    def problem(self, parts: Parts, rows: NDArray[np.intp]) -> Problem:
        """Return the problem of `bent_sum` for a structure on some rows."""
        data, hold, g = self.data, self.options["hold"], parts.g
        after = None if g is None else lambda columns: g.filter(columns, data.h, hold)
        columns = self.stops if parts.stops else self.plays
        return Problem(columns, data.y[rows], rows, data.h, np.array(parts.T), after, self.options["w0_min"])

    def fit(self, parts: Parts, rows: NDArray[np.intp], start: BentSum | None = None) -> BentSum:
        """Fit weights, bend and creep on some rows, from a fit with fewer parts or from a straight one."""
        p = self.problem(parts, rows)
        if start is None:
            return bent_sum.fit(p, bent_sum.fit_linear(p, parts.degree))
        grown = np.zeros(parts.degree + 1)
        grown[: min(len(grown), len(start.q))] = start.q[: len(grown)]
        k = start.k if len(start.k) == len(parts.T) else np.full(len(parts.T), 1e-3)
        return bent_sum.fit(p, replace(start, q=grown, k=k))

    def tried(self, parts: Parts, start: BentSum | None = None) -> Trial:
        """Fit a structure on the rows outside the validation blocks, and give its error on those."""
        fitted = self.fit(parts, self.kept, start)
        e = bent_sum.model(self.problem(parts, self.held), fitted) - self.data.y[self.held]
        return Trial(parts, fitted, float(np.sqrt(np.mean(e**2))))

    def dynamics(self, trial: Trial, rows: NDArray[np.intp], progress: Callable[[float], None]) -> Dynamics:
        """Search the dynamics behind a given hysteresis, whose weights follow for every trial."""
        return search(self.residuals(trial, rows), self.data, self.options, progress, trial.parts.g)

    def residuals(self, trial: Trial, rows: NDArray[np.intp]) -> Callable[[Dynamics], Array]:
        """Return the function from other dynamics to the residuals that a hysteresis near that of the trial leaves."""
        return lambda g: bent_sum.residuals(self.problem(replace(trial.parts, g=g), rows), trial.fit)


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


def build(
    data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]
) -> tuple[Graph, int, dict[str, Any]]:
    """Build the chain of the equation above from the parts that the data support.

    It returns the graph, the number of its parameters, the parts, and f_n (Hz), zeta, delay (s) with a warning for each
    of these that the data do not determine.
    """
    f = _Fitting(data, options)
    best = _bent(f, f.tried(Parts())).or_better(_bent(f, f.tried(Parts(stops=True))))
    progress(0.2)
    if options["dynamics"] != "no":
        # a missing bend hides creep, and missing dynamics hide the bend
        best = _bent(f, _moving(f, best, lambda done: progress(0.2 + 0.4 * done)))
    if options["creep"] != "no":
        best = _creeping(f, best)
    best = _bent(f, best)
    progress(0.8)
    parts = best.parts
    for _ in range(2 if parts.g else 0):
        parts = replace(parts, g=f.dynamics(replace(best, parts=parts), f.all, lambda done: None))
        best = replace(best, parts=parts, fit=f.fit(parts, f.all, best.fit))
    fitted = f.fit(parts, f.all, best.fit)
    told: dict[str, Any] = {"parts": _named(parts), "validation_percent": 100 * best.error / data.span}
    if parts.g:
        residuals = f.residuals(replace(best, fit=fitted), f.all)
        warned = unknown(parts.g, uncertainty(residuals, parts.g, data, options), data, options)
        told |= {**vars(parts.g), **({"warnings": warned} if warned else {})}
    count = len(fitted.w) + parts.degree + 1 + len(parts.T) + (3 if parts.g else 0)
    return _graph(f, parts, fitted), count, told


def _bent(f: _Fitting, trial: Trial) -> Trial:
    """Raise the degree of the bend while the validation error falls."""
    if f.options["bend"] is not None:
        asked = int(f.options["bend"])
        return trial if trial.parts.degree == asked else f.tried(replace(trial.parts, degree=asked), trial.fit)
    best = trial
    for degree in DEGREES[DEGREES.index(trial.parts.degree) + 1 :]:
        parts = replace(trial.parts, degree=degree)
        best = best.or_better(f.tried(parts, best.fit))
        if best.parts.degree != degree:
            # weights fitted to a straight line mislead where the output is even in v (butterfly loops)
            best = best.or_better(f.tried(parts, replace(best.fit, w=np.ones_like(best.fit.w))))
        if best.parts.degree != degree:
            break
    return best


def _moving(f: _Fitting, trial: Trial, progress: Callable[[float], None]) -> Trial:
    """Put dynamics behind it."""
    g = f.dynamics(trial, f.kept[::FIRST], progress)
    moved = f.tried(replace(trial.parts, g=g), trial.fit)
    return moved if f.options["dynamics"] == "yes" else trial.or_better(moved)


def _creeping(f: _Fitting, trial: Trial) -> Trial:
    """Add lags, one decade apart, from ten samples to a third of the record."""
    h, n = f.data.h, f.data.train.stop
    longest = np.log10(max(n * h / 3, 20 * h))
    T = 10 ** np.arange(longest, np.log10(10 * h) - 1e-9, -1.0)[:LAGS][::-1]
    crept = f.tried(replace(trial.parts, T=tuple(float(t) for t in T)), trial.fit)
    if crept.parts.g:  # found without creep, they stand in for a part of it
        g = f.dynamics(crept, f.kept[::FIRST], lambda done: None)
        crept = f.tried(replace(crept.parts, g=g), crept.fit)
    return crept if f.options["creep"] == "yes" else trial.or_better(crept)


def _named(parts: Parts) -> str:
    words = ["stops" if parts.stops else "plays"]
    words += [f"bend of degree {parts.degree}"] if parts.degree > 1 else []
    words += [f"creep with {len(parts.T)} lags"] if parts.T else []
    return ", ".join([*words, *(["G0(s) with delay"] if parts.g else [])])


def _graph(f: _Fitting, parts: Parts, s: BentSum) -> Graph:
    data = f.data
    w = np.concatenate([[s.w.sum()], -s.w[1:]]) if parts.stops else s.w
    slope, r, weights, at_0 = dead_zones(s.q)
    chain = [
        Node("input", "scaling", {"n": 1}, {"gain": 1 / f.half, "offset": -f.middle / f.half}),
        Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": w[0], "r": f.r, "w": w[1:], "u0": f.x0}),
        Node("bend", "dead_zones", {"n": len(r)}, {"w0": slope, "r": r, "w": weights}),
    ]
    if parts.T:
        chain.append(Node("creep", "creep", {}, {"w0": 1.0, "w": s.k, "T": np.array(parts.T), "start": "steady"}))
    if parts.g:
        at_rest = Graph(chain, wired(chain), [Input("u", ("input.u",))], [Output("y", f"{chain[-1].name}.y")])
        first = float(at_rest.run(data.u[:1], data.h)[0])
        dynamics = parts.g.nodes(data.h, f.options["hold"])
        chain += [dynamics[0], *(n.with_values(y0=first) for n in dynamics[1:])]
    chain.append(Node("readout", "scaling", {"n": 1}, {"offset": at_0 * (1 + s.k.sum())}))
    inputs = [Input("u", ("input.u",), data.unit_u, data.u[0])]
    return Graph(chain, wired(chain), inputs, [Output("y", "readout.y", data.unit_y)])


def wired(chain: list[Node]) -> list[tuple[str, str]]:
    """Return the wires of a chain of nodes with ports u and y."""
    return [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(chain)]


def dead_zones(q: Array) -> tuple[float, Array, Array, float]:
    """Return linear weight, thresholds, weights and value at 0 of dead zones that follow a Legendre series on [-1, 1].

    No threshold is 0, which is the input itself; beyond the thresholds the curve is straight.

    Parameters
    ----------
    q : array, shape (degree + 1,)
        Legendre coefficients.

    Returns
    -------
    w0 : float
        Weight of the linear term.
    r, w : array, shape (n,)
        Thresholds and weights of the dead zones.
    at_0 : float
        Value of the curve at 0, where the dead zones give 0.
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
