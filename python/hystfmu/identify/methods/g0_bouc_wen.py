"""Bouc-Wen hysteresis followed by linear dynamics with delay: y = c + e^(-s tau) G0(s) (a u + b z(u; beta, gamma, n)).

The operator and its scale are those of `bouc_wen` (A = 1), the dynamics those of `g0_prandtl_ishlinskii`.  Offset and
the two gains enter linearly and are eliminated (variable projection, Golub & Pereyra 1973).  Seven parameters are
searched: f_n, zeta, tau and the four of z.

The search starts with the dynamics alone: a bank of Bouc-Wen responses of fixed shapes, filtered by G0 and delayed, is
combined by least squares.  The bank represents a loop of any shape to about a percent, so that the dynamics do not
compensate for the loop, as they do with a sum of plays (f_n 3176 Hz instead of 500 Hz).  Then z is searched with these
dynamics, then all parameters together on all rows.  A delay that the data do not support is left out (Bayesian
information criterion): it trades against f_n, whose standard error it multiplies by three.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.candidate import LATE, Candidate, Memory
from hystfmu.identify.estimate.coordinates import Coordinates
from hystfmu.identify.estimate.determined import determined
from hystfmu.identify.estimate.objective import Linear, Objective
from hystfmu.identify.estimate.search import best_of, refined
from hystfmu.identify.features.dynamics import DYNAMICS_OPTIONS, Dynamics, bounds, errors, search, unknown
from hystfmu.identify.features.identifiable import correlation_time, standard_errors
from hystfmu.identify.methods import bouc_wen
from hystfmu.identify.options import Option

TEXT = "Bouc-Wen hysteresis, then G0(s) with delay, variable projection"
MEMORY = Memory(1000.0)
MOST_ROWS = 5000  # more rows are thinned evenly for the starts, after filtering at the full rate
BANK = tuple((z_max, share, n) for z_max in (0.1, 0.3, 1.0, 3.0) for share in (0.0, 0.5) for n in (1.0, 2.0))
STARTS = ((0.5, 0.5, 1.5), (0.15, 0.2, 1.2), (2.0, 0.5, 1.5))  # z_max, gamma share, n
ENOUGH = 3e-3  # misfit, relative to the span, below which no other start is tried
DELAY = 2  # index of the delay among the parameters
TOLERANCE = 1e-12  # relative change that ends the search of all parameters
EVALUATIONS = (15, 60)  # limit on evaluations of residuals and Jacobian: per start, for all parameters together

CANDIDATES = (Candidate(LATE, 0.5, 0.4),)
OPTIONS = (Option("n_max", 6.0, 1.0, 20.0, text="largest exponent n tried"), *DYNAMICS_OPTIONS)


def build(
    data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]
) -> tuple[Graph, int, dict[str, Any]]:
    """Build the graph ``scaling -> bouc_wen -> sum -> transfer_function [-> delay] -> scaling``.

    It returns the graph, the number of its parameters, and f_n (Hz), zeta, delay (s), with a warning for each of these
    that the data do not determine.
    """
    h, hold = data.h, options["hold"]
    rows = np.arange(len(data.u))[data.counted]
    some = rows[:: -(-len(rows) // MOST_ROWS)]
    least, most = bounds(data, options)
    lo, hi, scale = bouc_wen.limits(options["n_max"])
    lo, hi = np.concatenate([least, lo]), np.concatenate([most, hi])
    everything = Coordinates(lo, hi, np.concatenate([[0.1, 0.1, 0.3], scale]), lambda p: _values(p, h, hold))
    linear = (Linear("hysteresis.k", (0, 1)), Linear("readout.offset"))
    chains = _Chains(data, hold)

    def objective(moved: NDArray[np.bool_], p: Array, rows: NDArray[np.intp]) -> Objective:
        def structure(q: Array) -> Graph:
            return chains.at(Coordinates.joined(moved, p, q))

        return Objective(data, structure, everything.only(moved, p), linear, rows=rows)

    g = search(_Bank(data, some, hold).residuals, data, options, lambda f: progress(0.5 * f))
    shapes = np.arange(len(lo)) > DELAY
    points = [np.array([*g.point(h), np.log(z_max), share, n, 0.0]) for z_max, share, n in STARTS]
    p = everything.inside(points[0])
    first = objective(shapes, p, some)
    shaped = best_of(first, [q[shapes] for q in points], EVALUATIONS[0], lambda f: progress(0.5 + 0.3 * f), ENOUGH)
    p = Coordinates.joined(shapes, p, shaped.p)
    progress(0.8)
    fitted = objective(np.ones(len(lo), dtype=bool), p, rows)
    found = refined(fitted, p, EVALUATIONS[1], TOLERANCE)
    progress(0.9)
    best, p, q, parameters = fitted, found.p, found.p, 10
    spread = standard_errors(fitted.residuals(p), fitted.jacobian(p), ~everything.at_bounds(p))
    if p[DELAY] > 0:
        e = fitted.residuals(p)
        independent = len(e) / correlation_time(e)
        prompt = np.arange(len(lo)) != DELAY
        p_0 = np.where(prompt, p, 0.0)
        without = objective(prompt, p_0, rows)
        again = refined(without, p_0[prompt], EVALUATIONS[1], TOLERANCE)
        if independent * np.log(again.cost / found.cost) <= np.log(independent):
            best, p, q, parameters = without, Coordinates.joined(prompt, p_0, again.p), again.p, 9
    g = Dynamics.at(p, h)
    warned = unknown(g, spread[:3], data, options)  # the standard errors are those with the delay searched
    told = {
        **g.told,
        **errors(g, spread[:3], data, options),
        "bounded": bouc_wen.searched(p[3:], lo[3:], hi[3:]),
        "free": determined(best, q).table,
    }
    return chains.finished(best.graph(q)), parameters, {**told, **({"warnings": warned} if warned else {})}


def _values(p: Array, h: float, hold: str) -> dict[str, ArrayLike]:
    """Return the values at p = (ln f_n, ln zeta, delay in samples, and the four of the shape)."""
    g0 = Dynamics.at(p, h).nodes(h, hold)[0]
    return {"g0.b": g0.value("b"), "g0.a": g0.value("a"), **bouc_wen.shape(p[3:])}


class _Bank:
    """Responses of fixed shapes behind the dynamics, for the search of the dynamics alone."""

    def __init__(self, data: Dataset, rows: NDArray[np.intp], hold: str) -> None:
        self.rows, self.y, self.h, self.hold = rows, data.y[rows], data.h, hold
        front = bouc_wen.nodes(data)
        ports = [Input("u", ("input.u",))], [Output("x", "input.y"), Output("z", "operator.z")]
        graph = Graph(front, [("input.y", "operator.u")], *ports)
        columns = []
        for z_max, share, n in BANK:
            values = bouc_wen.shape(np.array([np.log(z_max), share, n, 0.0]))
            own = {name.partition(".")[2]: value for name, value in values.items()}
            columns.append(graph.replace(front[1].with_values(**own)).run(data.u))
        self.columns = np.column_stack([columns[0][:, 0], *(c[:, 1] for c in columns)])

    def residuals(self, g: Dynamics) -> Array:
        """Return the residuals of a linear combination of 1 and of the filtered responses."""
        filtered = g.filter(self.columns, self.h, self.hold)[self.rows]
        columns = np.column_stack([np.ones(len(self.rows)), filtered])
        size = np.linalg.norm(columns, axis=0)
        c = np.linalg.lstsq(columns / size, self.y, rcond=1e-10)[0] / size
        return np.asarray(columns @ c - self.y)


class _Chains:
    """Graphs by the whole samples of the delay and by whether there is a rest.

    In a search the delay stands in front of the hysteresis, which commutes with it: what it gives before its first
    input does then not depend on the gains.
    """

    def __init__(self, data: Dataset, hold: str) -> None:
        self.data, self.hold = data, hold
        self.made: dict[tuple[int, int], Graph] = {}

    def at(self, p: Array) -> Graph:
        """Return the graph of the structure at a point."""
        dynamics = Dynamics.at(p, self.data.h).nodes(self.data.h, self.hold)
        key = dynamics[0].dims["na"], dynamics[1].dims["n"] if len(dynamics) > 1 else 0
        if key not in self.made:
            front = bouc_wen.nodes(self.data)
            late = [n.with_values(y0=front[1].values["u0"]) for n in dynamics[1:]]
            tail = [Node("hysteresis", "sum", {"n": 2}), dynamics[0], Node("readout", "scaling", {"n": 1})]
            self.made[key] = self._chain([front[0], *late], front[1], tail)
        return self.made[key]

    def finished(self, graph: Graph) -> Graph:
        """Return the graph with the delay behind the dynamics; it gives their steady output first."""
        delays = [n for n in graph.nodes if n.name == "delay"]
        first, operator, total, g0, readout = (n for n in graph.nodes if n.name != "delay")
        if not delays:
            return graph
        rest = float(total.value("k") @ [operator.values["u0"], operator.values["z0"]])
        return self._chain([first], operator, [total, g0, delays[0].with_values(y0=rest), readout])

    def _chain(self, front: list[Node], operator: Node, tail: list[Node]) -> Graph:
        ends = f"{front[-1].name}.y", tail[0].name
        wires = [(ends[0], "operator.u"), (ends[0], f"{ends[1]}.u[1]"), ("operator.z", f"{ends[1]}.u[2]")]
        wires += [(f"{a.name}.y", f"{b.name}.u") for nodes in (front, tail) for a, b in pairwise(nodes)]
        inputs = [Input("u", (f"{front[0].name}.u",), self.data.unit_u, float(self.data.u[0]))]
        outputs = [Output("y", f"{tail[-1].name}.y", self.data.unit_y)]
        return Graph([*front, operator, *tail], wires, inputs, outputs)
