"""Rate-independent operator followed by linear dynamics with delay: y = c + e^(-s tau) G0(s) sum_i k_i x_i.

The x_i are outputs of the operator and of the scaling before the operator. Linear least squares gives the offset c and
the gains k_i (variable projection, Golub & Pereyra 1973). f_n, zeta, tau and the shape parameters of the operator are
searched in three stages.

The first stage searches only the dynamics. The operator is replaced by a bank of operators with fixed shapes. Their
outputs are filtered by G0, delayed, and combined by least squares. The bank represents a loop of any shape with an
error of about one percent, so the dynamics do not compensate for an error in the shape. With a sum of plays instead of
the bank, the dynamics would compensate for this error: in an example, f_n is 3176 Hz instead of 500 Hz. The second
stage searches the shape for these dynamics. The third stage searches all parameters on all rows. If the data do not
support the delay (Bayesian information criterion), it is omitted, because it would triple the standard error of f_n.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystfmu.base.arrays import Array, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.catalogue import Built, Options
from hystfmu.identify.estimate.coordinates import Coordinates
from hystfmu.identify.estimate.dynamics import Dynamics, bounds, search, told
from hystfmu.identify.estimate.objective import Linear, Objective
from hystfmu.identify.estimate.search import best_of, correlation_time, determined, refined, standard_errors
from hystfmu.identify.graphs import device, wired

MOST_ROWS = 5000  # maximum number of rows in the first two stages; more rows are thinned evenly after the simulation
ENOUGH = 3e-3  # RMS error, relative to the span, below which no further start value is tried
DELAY = 2  # index of the delay among the parameters
TOLERANCE = 1e-12  # relative change that ends the search of all parameters
EVALUATIONS = (15, 60)  # maximum number of evaluations of residuals and Jacobian: per start value, in the third stage


@dataclass(frozen=True)
class Operator:
    """Rate-independent operator with n shape parameters, which the function `build` searches.

    `lo`, `hi` and `scale` (n,) contain the bounds and the scales of the shape parameters. A point (n,) contains their
    values.

    `nodes` contains the block ``input``, which scales u, the block ``operator``, and further blocks; `wires` connects
    them. The function `shape` returns the parameter values at a point, by the names ``node.parameter``. The function
    `searched` returns the names, values and bounds of parameters for a point p and the bounds lo and hi. They become
    the further result ``bounded``. The weighted sum of the ports `columns` is the input of the dynamics. `starts`
    contains start points of the search, the likeliest first. `bank` contains the points of the operators with fixed
    shapes.
    """

    nodes: list[Node]
    shape: Callable[[Array], dict[str, float]]
    lo: Array
    hi: Array
    scale: Array
    columns: tuple[str, ...]
    starts: tuple[Array, ...]
    bank: tuple[Array, ...]
    searched: Callable[[Array, Array, Array], dict[str, tuple[float, float, float]]]
    wires: tuple[tuple[str, str], ...] = ()


def build(operator: Operator, data: Dataset, options: Options, progress: Progress) -> Built:
    """Fit the graph ``scaling -> operator -> sum -> transfer_function [-> delay] -> scaling``.

    The function returns the graph, the number of its parameters, and further results: f_n (Hz), zeta and the delay (s),
    with a warning for each of these three values that the data do not determine.
    """
    h, hold = data.h, options["hold"]
    rows = np.arange(len(data.u))[data.counted]
    some = rows[:: -(-len(rows) // MOST_ROWS)]
    least, most = bounds(data, options)
    lo, hi = np.concatenate([least, operator.lo]), np.concatenate([most, operator.hi])
    scale = np.concatenate([[0.1, 0.1, 0.3], operator.scale])
    chains = _Chains(operator, data, hold)
    everything = Coordinates(lo, hi, scale, chains.values)
    linear = (Linear("hysteresis.k", tuple(range(len(operator.columns)))), Linear("readout.offset"))

    def objective(moved: NDArray[np.bool_], p: Array, rows: NDArray[np.intp]) -> Objective:
        def structure(q: Array) -> Graph:
            return chains.at(Coordinates.joined(moved, p, q))

        return Objective(data, structure, everything.only(moved, p), linear, rows=rows)

    g = search(_bank(operator, data, some, hold), data, options, lambda f: progress(0.5 * f))
    shapes = np.arange(len(lo)) > DELAY
    points = [np.array([*g.point(h), *start]) for start in operator.starts]
    p = everything.inside(points[0])
    first = objective(shapes, p, some)
    shaped = best_of(first, [q[shapes] for q in points], EVALUATIONS[0], lambda f: progress(0.5 + 0.3 * f), ENOUGH)
    p = Coordinates.joined(shapes, p, shaped.p)
    progress(0.8)
    fitted = objective(np.ones(len(lo), dtype=bool), p, rows)
    found = refined(fitted, p, EVALUATIONS[1], TOLERANCE)
    progress(0.9)
    best, p, q, parameters = fitted, found.p, found.p, len(lo) + len(operator.columns) + 1
    spread = standard_errors(fitted.residuals(p), fitted.jacobian(p), ~everything.at_bounds(p))
    if p[DELAY] > 0:
        e = fitted.residuals(p)
        independent = len(e) / correlation_time(e)
        prompt = np.arange(len(lo)) != DELAY
        p_0 = np.where(prompt, p, 0.0)
        without = objective(prompt, p_0, rows)
        again = refined(without, p_0[prompt], EVALUATIONS[1], TOLERANCE)
        if independent * np.log(again.cost / found.cost) <= np.log(independent):
            best, p, q, parameters = without, Coordinates.joined(prompt, p_0, again.p), again.p, parameters - 1
    g = Dynamics.at(p, h)
    limited = operator.searched(p[3:], operator.lo, operator.hi)
    # the standard errors are computed with the delay, even if it is omitted
    found_of = {**told(g, spread[:3], data, options), "bounded": limited, "free": determined(best, q).table}
    return chains.finished(best.graph(q)), parameters, found_of


def _bank(operator: Operator, data: Dataset, rows: NDArray[np.intp], hold: str) -> Callable[[Dynamics], Array]:
    """Return a function that fits the weights of the bank for given dynamics, and returns the residuals."""
    found = []
    for point in operator.bank:
        given = [(*name.partition(".")[::2], value) for name, value in operator.shape(point).items()]
        nodes = [n.with_values(**{k: v for node, k, v in given if node == n.name}) for n in operator.nodes]
        found.append(_run(operator, nodes, data.u))
    responses, y = np.column_stack([found[0][:, 0], *(c[:, 1:] for c in found)]), data.y[rows]

    def residuals(g: Dynamics) -> Array:
        columns = np.column_stack([np.ones(len(rows)), g.filter(responses, data.h, hold)[rows]])
        size = np.linalg.norm(columns, axis=0)
        c = np.linalg.lstsq(columns / size, y, rcond=1e-10)[0] / size
        return np.asarray(columns @ c - y)

    return residuals


class _Chains:
    """Graphs of the search, one for each number of whole samples of the delay, with and without a fraction of a sample.

    During the search, the block `delay` precedes the hysteresis, with which it commutes. The initial output of the
    delay then does not depend on the gains k_i.
    """

    def __init__(self, operator: Operator, data: Dataset, hold: str) -> None:
        self.operator, self.data, self.hold = operator, data, hold
        self.made: dict[tuple[int, int], Graph] = {}

    def values(self, p: Array) -> dict[str, ArrayLike]:
        """Return the parameter values at the point p = (ln f_n, ln zeta, delay in samples, shape)."""
        g0, *late = Dynamics.at(p, self.data.h).nodes(self.data.h, self.hold)
        shape: dict[str, float] = self.operator.shape(p[3:])
        if late and "input.offset" in shape:  # the initial output of the delay is the scaled first input
            gain = float(self.operator.nodes[0].value("gain")[0])
            shape["delay.y0"] = gain * float(self.data.u[0]) + shape["input.offset"]
        return {"g0.b": g0.value("b"), "g0.a": g0.value("a"), **shape}

    def at(self, p: Array) -> Graph:
        """Return the graph whose structure belongs to the point p."""
        dynamics = Dynamics.at(p, self.data.h).nodes(self.data.h, self.hold)
        key = dynamics[0].dims["na"], dynamics[1].dims["n"] if len(dynamics) > 1 else 0
        if key not in self.made:
            scaling, *operator = self.operator.nodes
            x_0 = float((scaling.value("gain") * self.data.u[0] + scaling.value("offset"))[0])
            late = [n.with_values(y0=x_0) for n in dynamics[1:]]
            total = Node("hysteresis", "sum", {"n": len(self.operator.columns)})
            tail = [total, dynamics[0], Node("readout", "scaling", {"n": 1})]
            self.made[key] = self._chain([scaling, *late], operator, tail)
        return self.made[key]

    def finished(self, graph: Graph) -> Graph:
        """Return the graph with the delay after the dynamics; the delay starts with their steady output."""
        delays = [n for n in graph.nodes if n.name == "delay"]
        scaling, *operator, total, g0, readout = (n for n in graph.nodes if n.name != "delay")
        if not delays:
            return graph
        start = _run(self.operator, [scaling, *operator], self.data.u[:1])[0]
        rest = float(total.value("k") @ start)
        return self._chain([scaling], operator, [total, g0, delays[0].with_values(y0=rest), readout])

    def _chain(self, front: list[Node], operator: list[Node], tail: list[Node]) -> Graph:
        end = f"{front[-1].name}.y"
        into = [end if column == "input.y" else column for column in self.operator.columns]
        wires = [(end, "operator.u"), *self.operator.wires]
        wires += [(port, f"{tail[0].name}.u[{i}]") for i, port in enumerate(into, 1)]
        wires += wired(front) + wired(tail)
        return device(self.data, [*front, *operator, *tail], wires, [f"{front[0].name}.u"], f"{tail[-1].name}.y")


def _run(operator: Operator, nodes: list[Node], u: Array) -> Array:
    """Return the outputs `columns` of the operator for an input u (n,), shape (n, columns)."""
    outputs = [Output(f"x{i}", column) for i, column in enumerate(operator.columns)]
    wires = [("input.y", "operator.u"), *operator.wires]
    return Graph(nodes, wires, [Input("u", ("input.u",))], outputs).run(u)
