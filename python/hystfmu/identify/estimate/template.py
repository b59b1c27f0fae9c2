"""Template of a chain with a rate-independent operator: y = c + e^(-s tau) G0(s) sum_i k_i x_i, or without dynamics.

The x_i are outputs of the operator and of the scaling before the operator. Linear least squares gives the offset c and
the gains k_i (variable projection, Golub & Pereyra 1973). The shape of the operator is searched, and f_n, zeta and tau
if the chain contains dynamics. With dynamics, the search has three stages.

The first stage searches only the dynamics. The operator is replaced by a bank of operators with fixed shapes. Their
outputs are filtered by G0, delayed, and combined by least squares. The bank represents a loop of any shape with an
error of about one percent, so the dynamics do not compensate for an error in the shape. With a sum of plays instead of
the bank, the dynamics would compensate for this error: in an example, f_n is 3176 Hz instead of 500 Hz. The second
stage searches the shape for these dynamics. The third stage searches all parameters on all rows. If the data do not
support the delay (Bayesian information criterion), it is omitted, because it would triple the standard error of f_n.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from hystfmu.base import Array, Indices, Mask, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.catalogue import Built, Options, device, wired
from hystfmu.identify.estimate.dynamics import Dynamics, Weighted, bounds, told
from hystfmu.identify.estimate.dynamics import search as search_dynamics
from hystfmu.identify.estimate.objective import Linear, Objective, best_of, determined, search
from hystfmu.identify.solvers.trust_region import Coordinates, correlation_time, refined, standard_errors

MOST_ROWS = 5000  # maximum number of rows in the first two stages; more rows are thinned evenly after the simulation
ENOUGH = 3e-3  # RMS error, relative to the span, below which no further start value is tried
DELAY = 2  # index of the delay among the parameters
TOLERANCE = 1e-12  # relative change that ends the search of all parameters
EVALUATIONS = (15, 60)  # maximum number of evaluations of residuals and Jacobian: per start value, in the third stage

_Series = tuple[list[Node], list[tuple[str, str]], list[str], str]


@dataclass(frozen=True)
class Variable:
    """A search variable of an operator: its name, its bounds `lo` and `hi`, and the scale of its steps.

    A variable without a name is not reported in the further result ``bounded``. `told` is the reported lower bound, by
    default `lo`.
    """

    name: str
    lo: float
    hi: float
    scale: float
    told: float | None = None


def limits(variables: Sequence[Variable]) -> tuple[Array, Array, Array]:
    """Return the lower bounds, the upper bounds and the scales (n,) of search variables."""
    lo, hi, scale = np.array([(v.lo, v.hi, v.scale) for v in variables], dtype=np.float64).T
    return lo, hi, scale


def bounded(variables: Sequence[Variable], p: Array) -> dict[str, tuple[float, float, float]]:
    """Return the value and the bounds of each reported variable at the point p (n,)."""
    found = zip(variables, p.tolist(), strict=True)
    return {v.name: (value, float(v.lo if v.told is None else v.told), float(v.hi)) for v, value in found if v.name}


@dataclass(frozen=True)
class Template:
    """Rate-independent operator with a searched shape, which the function `build` fits alone or before dynamics.

    `nodes` contains the block ``input``, which scales u, the block ``operator``, and further blocks; `wires` connects
    them. The function `shape` returns the parameter values at a point (n,) of the search, by the names
    ``node.parameter``. `variables` contains the n search variables. The weighted sum of the ports `columns` is the
    output of the operator. `starts` contains start points of the search, the likeliest first. `bank` contains the
    points of the operators with fixed shapes.
    """

    nodes: list[Node]
    shape: Callable[[Array], dict[str, float]]
    variables: tuple[Variable, ...]
    columns: tuple[str, ...]
    starts: tuple[Array, ...]
    bank: tuple[Array, ...]
    wires: tuple[tuple[str, str], ...] = ()


def build(operator: Template, data: Dataset, options: Options, progress: Progress, dynamics: bool = True) -> Built:
    """Fit the graph ``scaling -> operator -> sum [-> transfer_function [-> delay] -> scaling]``.

    The function returns the graph, the number of its parameters, and further results: the value and the standard error
    of each free parameter. With dynamics, they also contain f_n (Hz), zeta and the delay (s), with a warning for each
    of these three values that the data do not determine.
    """
    count = len(operator.variables) + len(operator.columns) + 1
    least, most, scale = limits(operator.variables)
    if not dynamics:
        chain = _chain(operator, operator.nodes[:1], [Node("readout", "sum", {"n": len(operator.columns)})])
        fitted = Objective(
            data, device(data, *chain), Coordinates(least, most, scale, operator.shape), _linear(operator, "readout")
        )
        p = search(fitted, operator.starts, progress).p
        told_of = {"bounded": bounded(operator.variables, p), "free": determined(fitted, p).table}
        return fitted.graph(p), count, told_of
    h, hold = data.h, options["hold"]
    rows = np.arange(len(data.u))[data.counted]
    some = rows[:: -(-len(rows) // MOST_ROWS)]
    lo, hi = (np.concatenate(ends) for ends in zip(bounds(data, options), (least, most), strict=True))
    scale = np.concatenate([[0.1, 0.1, 0.3], scale])
    chains = _Chains(operator, data, hold)
    everything = Coordinates(lo, hi, scale, chains.values)
    linear = _linear(operator, "hysteresis")

    def objective(moved: Mask, p: Array, rows: Indices) -> Objective:
        def structure(q: Array) -> Graph:
            return chains.at(Coordinates.joined(moved, p, q))

        return Objective(data, structure, everything.only(moved, p), linear, rows=rows)

    g = search_dynamics(_bank(operator, data, some, hold), data, options, lambda f: progress(0.5 * f))
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
    best, p, q, parameters = fitted, found.p, found.p, count + 3
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
    limited = bounded(operator.variables, p[3:])
    # the standard errors are computed with the delay, even if it is omitted
    found_of = {**told(g, spread[:3], data, options), "bounded": limited, "free": determined(best, q).table}
    return chains.finished(best.graph(q)), parameters, found_of


def _linear(operator: Template, total: str) -> tuple[Linear, Linear]:
    """Return the linear parameters: the gains of the sum `total`, and the offset."""
    return Linear(f"{total}.k", tuple(range(len(operator.columns)))), Linear("readout.offset")


def _chain(operator: Template, front: list[Node], tail: list[Node]) -> _Series:
    """Return the nodes `front`, the operator, and the nodes `tail`, which begin with a sum, in series.

    The result contains the nodes, the wires, the endpoints of the input, and the endpoint of the output.
    """
    end = f"{front[-1].name}.y"
    into = [end if column == "input.y" else column for column in operator.columns]
    wires = [(end, "operator.u"), *operator.wires]
    wires += [(port, f"{tail[0].name}.u[{i}]") for i, port in enumerate(into, 1)]
    wires += wired(front) + wired(tail)
    return [*front, *operator.nodes[1:], *tail], wires, [f"{front[0].name}.u"], f"{tail[-1].name}.y"


def _bank(operator: Template, data: Dataset, rows: Indices, hold: str) -> Weighted:
    """Return the problem of the dynamics after the bank, whose weights linear least squares gives."""
    found = [np.ones((len(data.u), 1))]
    for point in operator.bank:
        given = [(*name.partition(".")[::2], value) for name, value in operator.shape(point).items()]
        nodes = [n.with_values(**{k: v for node, k, v in given if node == n.name}) for n in operator.nodes]
        found.append(_run(operator, nodes, data.u)[:, len(found) > 1 :])  # all have the same first column, the input

    def fit(columns: Array, y: Array) -> tuple[Array, Mask]:
        size = np.linalg.norm(columns, axis=0)
        return np.linalg.lstsq(columns / size, y, rcond=1e-10)[0] / size, np.ones(len(size), dtype=bool)

    return Weighted(np.hstack(found), data, rows, hold, fit)


class _Chains:
    """Graphs of the search, one for each number of whole samples of the delay, with and without a fraction of a sample.

    During the search, the block `delay` precedes the hysteresis, with which it commutes. The initial output of the
    delay then does not depend on the gains k_i.
    """

    def __init__(self, operator: Template, data: Dataset, hold: str) -> None:
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
            scaling = self.operator.nodes[0]
            x_0 = float((scaling.value("gain") * self.data.u[0] + scaling.value("offset"))[0])
            late = [n.with_values(y0=x_0) for n in dynamics[1:]]
            total = Node("hysteresis", "sum", {"n": len(self.operator.columns)})
            tail = [total, dynamics[0], Node("readout", "scaling", {"n": 1})]
            self.made[key] = device(self.data, *_chain(self.operator, [scaling, *late], tail))
        return self.made[key]

    def finished(self, graph: Graph) -> Graph:
        """Return the graph with the delay after the dynamics; the delay starts with their steady output."""
        delays = [n for n in graph.nodes if n.name == "delay"]
        scaling, *operator, total, g0, readout = (n for n in graph.nodes if n.name != "delay")
        if not delays:
            return graph
        start = _run(self.operator, [scaling, *operator], self.data.u[:1])[0]
        rest = float(total.value("k") @ start)
        fitted = replace(self.operator, nodes=[scaling, *operator])
        tail = [total, g0, delays[0].with_values(y0=rest), readout]
        return device(self.data, *_chain(fitted, [scaling], tail))


def _run(operator: Template, nodes: list[Node], u: Array) -> Array:
    """Return the outputs `columns` of the operator for an input u (n,), shape (n, columns)."""
    outputs = [Output(f"x{i}", column) for i, column in enumerate(operator.columns)]
    wires = [("input.y", "operator.u"), *operator.wires]
    return Graph(nodes, wires, [Input("u", ("input.u",))], outputs).run(u)
