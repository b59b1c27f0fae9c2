"""Structured actuator: plays, bend, creep, linear dynamics with delay; the parts that the data support.

  x = scaled u,  v = w0 x + sum_i w_i p_i[x],  b = b(v),  c = b + sum_j k_j L_{T_j}[b],  y = e^(-s tau) G0(s) c + offset

This is the chain of a piezo, magnetostrictive or polymer actuator: rate-independent hysteresis (Kuhnen 2003), a smooth
readout, creep as a few lags with time constants one decade apart (Krejci & Kuhnen 2001), and the dynamics G0(s) of Yu &
Alici 2005.  `bent_sum` fits weights, bend and creep for given dynamics; f_n, zeta and tau are searched outside
(variable projection).

A part is kept if it reduces the error on validation blocks inside the training rows by more than `BETTER`.  Stops take
the place of plays where the loop runs clockwise.  A bend that is not monotone has no inverse: it must gain `NEEDED`.

With covariates, such as temperature and load, the bend follows each of them, by an offset, a gain, or all of its
coefficients (`following`), as far as the validation blocks support it; one without effect is no input of the model.

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
from hystfmu.identify.candidate import ANY, Candidate, Memory
from hystfmu.identify.features import bent_sum
from hystfmu.identify.features.bent_sum import BentSum, Filter, Problem
from hystfmu.identify.features.covariate_inputs import covariate_inputs
from hystfmu.identify.features.dynamics import DYNAMICS_OPTIONS, Dynamics, search, uncertainty, unknown
from hystfmu.identify.features.following import LEVELS, Following
from hystfmu.identify.features.initial_memory import u0_of, u0_option
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.features.validation_blocks import validation_rows, without_outermost
from hystfmu.identify.options import Option

TEXT = "plays, bend, creep, G0(s) with delay: the parts that validation blocks support"
MEMORY = Memory(1500.0, "N")
COVARIATES = True
MOST_ROWS = 6000  # more rows are thinned evenly, after filtering at the full rate
FIRST = 3  # the first search of the dynamics uses every third of these rows
DEGREES = (1, 3, 5, 8)  # of the bend, tried in turn
LAGS = 6  # at most, one decade apart
BETTER, NEEDED = 0.95, 0.5  # ratio of validation errors below which a part, or a bend without inverse, is kept
SMOOTH = 1e-5  # largest distance of the dead zones from the polynomial, relative to its range
MOST_KNOTS = 400
PAIR = {"n": 2, "m": 0}
MARGIN = 0.05  # covariates are limited to the training range and this fraction of it

CANDIDATES = (Candidate(ANY, 0.5, 0.04),)
OPTIONS = (
    Option("N", 40, 1, 10000, text="number of plays"),
    Option("bend", None, 1, 20, text="degree of the bend, 1: none; default: chosen on validation blocks"),
    Option("creep", None, choices=("yes", "no"), text="creep; default: chosen on validation blocks"),
    Option("dynamics", None, choices=("yes", "no"), text="G0(s) with delay; default: chosen on validation blocks"),
    Option(
        "covariates",
        None,
        choices=LEVELS[1:],
        text="what of the bend follows the covariates; default: chosen on validation blocks",
    ),
    Option("w0_min", 1e-3, 0.0, 1.0, text="least weight of the linear term, relative to the sum of all weights"),
    u0_option("every play rests"),
    *DYNAMICS_OPTIONS,
)


@dataclass(frozen=True)
class Parts:
    """Structure of a candidate: sign of plays, degree of bend, time constants of creep, dynamics, covariates."""

    stops: bool = False
    degree: int = 1
    T: tuple[float, ...] = ()
    g: Dynamics | None = None
    levels: tuple[str, ...] = ()


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
        seen = data.covariates.values[: rows.stop]
        self.low, self.high = seen[rows].min(axis=0), seen[rows].max(axis=0)
        self.theta = (seen - (self.low + self.high) / 2) * 2 / (self.high - self.low)
        every = np.arange(rows.stop)[data.counted]
        self.all = every[:: -(-len(every) // MOST_ROWS)]
        held = np.zeros(rows.stop, dtype=bool)
        held[rows] = validation_rows(data.u[rows])
        held[data.counted] = without_outermost(data.u[data.counted], held[data.counted])
        self.kept, self.held = self.all[~held[self.all]], self.all[held[self.all]]

    def problem(self, parts: Parts, rows: NDArray[np.intp]) -> Problem:
        """Return the problem of `bent_sum` for a structure on some rows."""
        columns = self.stops if parts.stops else self.plays
        least, beside = self.options["w0_min"], Following(self.theta, parts.levels) if parts.levels else None
        after, T = self.filtered(parts.g), np.array(parts.T)
        return Problem(columns, self.data.y[rows], rows, self.data.h, T, after, least, beside)

    def filtered(self, g: Dynamics | None) -> Filter | None:
        """Return the function from columns to columns behind dynamics."""
        return None if g is None else lambda columns: g.filter(columns, self.data.h, self.options["hold"])

    def fit(self, parts: Parts, rows: NDArray[np.intp], start: BentSum | None = None) -> BentSum:
        """Fit weights, bend and creep on some rows, from a fit with fewer parts or from a straight one."""
        p = self.problem(parts, rows)
        if start is None:
            return bent_sum.fit(p, bent_sum.fit_linear(p, parts.degree))
        grown = np.zeros(parts.degree + 1)
        grown[: min(len(grown), len(start.q))] = start.q[: len(grown)]
        k = start.k if len(start.k) == len(parts.T) else np.full(len(parts.T), 1e-3)
        if p.following is None:
            return bent_sum.fit(p, replace(start, q=grown, k=k))
        g = np.where([level == "gain" for level in parts.levels], start.g, 0.0)
        return bent_sum.fit(p, replace(start, q=grown, k=k, g=g, c=np.zeros((len(g), len(grown)))))

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
        left = bent_sum.residuals(self.problem(trial.parts, rows), trial.fit)
        return lambda g: left(self.filtered(g))


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
    first = Parts(levels=(options["covariates"] or "gain",) * len(data.covariates.names))
    best = _bent(f, f.tried(first)).or_better(_bent(f, f.tried(replace(first, stops=True))))
    best = _following(f, best)
    progress(0.2)
    if options["dynamics"] != "no":
        # a missing bend hides creep, and missing dynamics hide the bend
        best = _bent(f, _moving(f, best, lambda done: progress(0.2 + 0.4 * done)))
    if options["creep"] != "no":
        best = _creeping(f, best)
    best = _following(f, _bent(f, best))
    progress(0.8)
    parts = best.parts
    for _ in range(2 if parts.g else 0):
        parts = replace(parts, g=f.dynamics(replace(best, parts=parts), f.all, lambda done: None))
        best = replace(best, parts=parts, fit=f.fit(parts, f.all, best.fit))
    fitted = f.fit(parts, f.all, best.fit)
    told: dict[str, Any] = {"parts": _named(parts, data), "validation_percent": 100 * best.error / data.span}
    warned = [
        f"the covariate {name!r} does not reduce the error on validation blocks: it is no input of the model"
        for name, level in zip(data.covariates.names, parts.levels, strict=True)
        if level == "none"
    ]
    if parts.g:
        residuals = f.residuals(replace(best, fit=fitted), f.all)
        warned += unknown(parts.g, uncertainty(residuals, parts.g, data, options), data, options)
        told |= parts.g.told
    told |= {"warnings": warned} if warned else {}
    count = len(fitted.w) + parts.degree + 1 + len(parts.T) + (parts.g.parameters if parts.g else 0)
    count += Following(f.theta, parts.levels).parameters(parts.degree + 1)
    return _graph(f, parts, fitted), count, told


def _following(f: _Fitting, trial: Trial) -> Trial:
    """Find what follows each covariate: the whole bend if clearly better, less than the gain if not clearly worse."""
    if f.options["covariates"] is not None:
        return trial
    best = trial

    def at(j: int, level: str) -> Trial:
        levels = list(best.parts.levels)
        levels[j] = level
        return f.tried(replace(best.parts, levels=tuple(levels)), best.fit)

    for j in range(len(trial.parts.levels)):
        if best.parts.degree > 1 and best.parts.levels[j] != LEVELS[-1]:
            best = best.or_better(at(j, LEVELS[-1]))
        while (place := LEVELS.index(best.parts.levels[j])) > 0:
            simpler = at(j, LEVELS[place - 1])
            if simpler.or_better(best) is best:
                break
            best = simpler
    return best


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


def _named(parts: Parts, data: Dataset) -> str:
    words = ["stops" if parts.stops else "plays"]
    words += [f"bend of degree {parts.degree}"] if parts.degree > 1 else []
    for name, level in zip(data.covariates.names, parts.levels, strict=True):
        words += [] if level == "none" else [f"{level} that follows {name}"]
    words += [f"creep with {len(parts.T)} lags"] if parts.T else []
    modes = f" of {1 + len(parts.g.beside)} modes" if parts.g and parts.g.beside else ""
    return ", ".join([*words, *([f"G0(s){modes} with delay"] if parts.g else [])])


def _graph(f: _Fitting, parts: Parts, s: BentSum) -> Graph:
    data = f.data
    w = np.concatenate([[s.w.sum()], -s.w[1:]]) if parts.stops else s.w
    slope, r, weights, at_0 = dead_zones(s.q)
    chain = [
        Node("input", "scaling", {"n": 1}, {"gain": 1 / f.half, "offset": -f.middle / f.half}),
        Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": w[0], "r": f.r, "w": w[1:], "u0": f.x0}),
        Node("bend", "dead_zones", {"n": len(r)}, {"w0": slope, "r": r, "w": weights}),
    ]
    nodes, wires, inputs = [*chain], wired(chain), [Input("u", ("input.u",), data.unit_u, data.u[0])]
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
    return Graph(nodes + tail[1:], wires + wired(tail), inputs, [Output("y", "readout.y", data.unit_y)])


def _beside(
    f: _Fitting, parts: Parts, s: BentSum, used: list[int], at_0: float
) -> tuple[list[Node], list[tuple[str, str]], list[tuple[str, ...]]]:
    """Return blocks and wires that let the bend follow covariates, the last block with the output; and their ends.

    Parameters
    ----------
    f, parts, s
        As in `_graph`.
    used : list of int
        Numbers of the covariates that act.
    at_0 : float
        Value of the bend at 0, which its block leaves out.
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
