"""Fit and graph of the kind `actuator`: operator, static nonlinearity, creep, linear dynamics and offset in series.

The static nonlinearity after the operator has the name `bend`. It can depend on covariates. In the fit it is a
polynomial, whose coefficients `bent_sum` determines together with the weights and the creep. In the graph it is a sum
of dead zones, which interpolates the polynomial. The sum has an exact inverse, and it continues as a straight line
outside the range of the training rows.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre

from hystfmu.base import Array, Indices, Progress
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.catalogue import Options, covariate_inputs, device, scaled_input, wired
from hystfmu.identify.cuts import fitted_and_held
from hystfmu.identify.estimate.dynamics import Dynamics, Weighted, search
from hystfmu.identify.features import bent_sum
from hystfmu.identify.features.bent_sum import BentSum, Filter, Following, Problem
from hystfmu.identify.features.plays import thresholds, u0_of, with_plays
from hystfmu.identify.features.smooth_density import RelaySum

MOST_ROWS = 6000  # maximum number of rows of a fit; more rows are thinned evenly after they are filtered
# a component is kept if the ratio of the validation errors with and without it is below BETTER; a nonlinearity that is
# not monotone has no inverse, so the ratio must be below NEEDED
BETTER, NEEDED = 0.95, 0.5
PLAYS, STOPS, RELAYS = "plays", "stops", "relays"
SMOOTH = 1e-5  # largest distance of the dead zones from the polynomial, relative to its range
MOST_KNOTS = 400
PAIR = {"n": 2, "m": 0}
MARGIN = 0.05  # covariates are limited to their training range, extended by this fraction to each side


@dataclass(frozen=True)
class Parts:
    """Structure of a model: the operator, the degree of the nonlinearity, and the components that are present.

    `T` contains the time constants of the creep (s), and `signed` states whether its weights can be negative. `g` is
    the linear dynamics. `levels` states for each covariate how the nonlinearity depends on it (see `bent_sum`).
    """

    operator: str = PLAYS
    degree: int = 1
    T: tuple[float, ...] = ()
    g: Dynamics | None = None
    levels: tuple[str, ...] = ()
    signed: bool = False


@dataclass(frozen=True)
class Trial:
    """A structure, its fit, and its RMS error on the validation blocks (unit of measure of y)."""

    parts: Parts
    fit: BentSum
    error: float

    def or_better(self, other: "Trial") -> "Trial":
        """Return the trial `other` if its validation error is clearly smaller, otherwise this trial."""
        enough = BETTER if other.fit.monotone or not self.fit.monotone else NEEDED
        return other if other.error < enough * self.error else self


class Fitting:
    """Data set with its regressors and validation blocks, and methods that fit a model structure to it.

    Fields: ``scaling`` is the block that scales u to x in [-1, 1], and ``x0`` is the input at rest after this scaling.
    ``r`` contains the thresholds of the plays. ``theta`` contains the covariates, scaled to [-1, 1] from their ranges
    ``low`` to ``high``. ``all``, ``kept`` and ``held`` are row numbers: the training rows without held-out rows, the
    fitted rows, and the rows of the validation blocks.
    """

    def __init__(self, data: Dataset, options: Options) -> None:
        rows, self.data, self.options = data.train, data, options
        u = data.u[: rows.stop]
        self.scaling, gain, offset = scaled_input(u[rows])
        self.x0, x = gain * u0_of(data, options) + offset, gain * u + offset
        self.r = thresholds(x[rows], options["N"])
        self.noise = noise(data.y[data.counted])
        self.relays = RelaySum(x, rows)
        self.plays = with_plays(x, self.r, self.x0)
        self.stops = np.column_stack([x, x[:, None] - self.plays[:, 1:]])
        seen = data.covariates.values[: rows.stop]
        self.low, self.high = seen[rows].min(axis=0), seen[rows].max(axis=0)
        self.theta = (seen - (self.low + self.high) / 2) * 2 / (self.high - self.low)
        self.all, self.kept, self.held = fitted_and_held(data, MOST_ROWS)

    def columns(self, operator: str) -> Array:
        """Return the scaled input and the outputs of the elements of an operator, one column per element."""
        return {PLAYS: self.plays, STOPS: self.stops}[operator] if operator != RELAYS else self.relays.columns

    def problem(self, parts: Parts, rows: Indices) -> Problem:
        """Return the least-squares problem of `bent_sum` for a structure on the rows `rows`."""
        columns = self.columns(parts.operator)
        least, beside = self.options["w0_min"], Following(self.theta[:, : len(parts.levels)], parts.levels)
        after, T = self.filtered(parts.g), np.array(parts.T)
        held = self.relays.penalties if parts.operator == RELAYS else ()
        return Problem(columns, self.data.y[rows], rows, self.data.h, T, after, least, beside, held, parts.signed)

    def filtered(self, g: Dynamics | None) -> Filter | None:
        """Return a function that filters columns with the dynamics g; return None if g is None."""
        hold = self.options["hold"]
        return None if g is None else lambda columns, rows: g.filter(columns, self.data.h, hold, rows)

    def fit(self, parts: Parts, rows: Indices, start: BentSum | None = None, wanted: float = np.inf) -> BentSum:
        """Fit weights, nonlinearity and creep of a structure on the rows `rows`.

        The search begins with `start`, a fit of a simpler structure, or else with a fit without nonlinearity and creep.
        `wanted` is the error at which the fit aims (see `bent_sum.fit`).
        """
        p = self.problem(parts, rows)
        if start is None:
            return bent_sum.fit(p, bent_sum.fit_linear(p, parts.degree))
        grown = np.zeros(parts.degree + 1)
        grown[: min(len(grown), len(start.q))] = start.q[: len(grown)]
        k = start.k if len(start.k) == len(parts.T) else np.full(len(parts.T), 1e-3)
        g = np.where([level == "gain" for level in parts.levels], start.g, 0.0)
        return bent_sum.fit(p, replace(start, q=grown, k=k, g=g, c=np.zeros((len(g), len(grown)))), wanted)

    def tried(self, parts: Parts, start: BentSum | None = None, wanted: float = np.inf) -> Trial:
        """Fit a structure on the rows outside the validation blocks, and compute its RMS error on the blocks."""
        fitted = self.fit(parts, self.kept, start, wanted)
        e = bent_sum.model(self.problem(parts, self.held), fitted) - self.data.y[self.held]
        return Trial(parts, fitted, float(np.sqrt(np.mean(e**2))))

    def settled(self, trial: Trial) -> bool:
        """Return whether the error of a trial is so close to the noise that no further component can be kept.

        An error clearly below the estimated noise shows that the estimate is wrong.
        """
        return BETTER * trial.error <= self.noise <= trial.error / BETTER

    def dynamics(self, trial: Trial, rows: Indices, progress: Progress) -> Dynamics:
        """Search the linear dynamics after the hysteresis of a trial; each step also fits the weights again."""
        return search(self.behind(trial, rows), self.data, self.options, progress, trial.parts.g)

    def behind(self, trial: Trial, rows: Indices) -> Weighted:
        """Return the problem of the dynamics after the other parts of a trial (see `bent_sum.behind`)."""
        columns, fit = bent_sum.behind(self.problem(trial.parts, rows), trial.fit)
        return Weighted(columns, self.data, rows, self.options["hold"], fit)


def chain(f: Fitting, parts: Parts, s: BentSum) -> Graph:
    """Return the graph of the structure `parts` with the values of the fit `s`."""
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
    """Return the blocks and wires by which covariates change the nonlinearity, and the inputs of covariates.

    `used` contains the numbers of the covariates with an effect. `at_0` is the value of the nonlinearity at 0, which
    the block `bend` does not include.
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
    """Approximate a curve on [-1, 1] by dead zones; the curve is a Legendre series with coefficients q.

    The result is the linear weight, the thresholds (n,), the weights (n,), and the value of the curve at 0. This value
    is not part of the sum of dead zones, which is 0 at 0. No threshold is 0, because the output of such a dead zone is
    its input. Outside the outermost thresholds the sum is a straight line.
    """
    if len(q) <= 2:
        return float(q[1]) if len(q) > 1 else 0.0, np.array([1.0]), np.zeros(1), float(q[0])
    fine = np.linspace(-1.0, 1.0, 4001)
    wanted = legendre.legval(fine, q)
    m = 4
    while True:
        at = (np.arange(2 * m) - m + 0.5) / (m - 0.5)  # equally spaced from -1 to 1, without 0
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
