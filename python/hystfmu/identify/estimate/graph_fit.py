"""Fit of the free parameters of any graph of blocks.

For the fit of a single block, a graph is built: the input is scaled to [-1, 1], and the output of the graph is a
weighted sum of the outputs of the block plus an offset.

Some free parameters are found by linear least squares. A parameter is linear if two equal steps of this parameter
change the output by the same amount. Several parameters are jointly linear if the change of the output by each one does
not depend on the others. Simulations of the graph show this. They also use random values near the values of the graph.
Otherwise a weight of 0 would hide the effect of the parameters that it multiplies. The test does not use knowledge
about the blocks, so a new block needs no further code.
"""

import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from hystfmu.base import Array, InputError, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.graph.listing import group
from hystfmu.identify.catalogue import Built, Option, Options, device, scaled_input
from hystfmu.identify.estimate.coordinates import default_bounds, is_log, made_coordinates
from hystfmu.identify.estimate.free import Free, Spec, read
from hystfmu.identify.estimate.objective import Linear, Objective, OutOfTime, determined, search
from hystfmu.identify.estimate.runs import Runs
from hystfmu.model import rows_of

TEXT = "graph of blocks, free parameters by least squares on the free run"
REPEATED = 1e-4  # a parameter is redundant if the effects of others represent its effect except for this fraction
TRIED = 10  # number of random points for each start after the first; the best points are used

OPTIONS = (
    Option("starts", 6, 1, 1000, text="number of start points: the values in the graph, then random points"),
    Option("seconds", 60.0, 0.01, 1e6, text="limit on the time of the search"),
)


def fit_graph(
    data: Dataset,
    graph: Graph,
    free: Mapping[str, Spec],
    options: Options,
    seed: int,
    progress: Progress,
    hold: bool = False,
) -> Built:
    """Fit the free parameters of a graph, so that the error of its simulation over all records is minimised.

    The graph has one output. Its first input is u, and its further inputs are covariates of the data. `free` has the
    form of `hystfmu.identify.estimate.free`. If `hold` is True, redundant parameters are fixed to their values in the
    graph.

    The function returns the fitted graph, the number of fitted elements, and further results. These are ``free`` and
    ``condition`` (see `Determined`), ``held`` (names of fixed parameters), ``bounded`` (values and bounds of searched
    parameters) and ``warnings``.

    An InputError is raised if the graph has other ports, if a free parameter is invalid, or if the graph with its given
    values cannot be simulated on the data.
    """
    _check_ports(graph, data)
    frees, until = read(graph, free), time.monotonic() + options["seconds"]
    linear = linear_parts(graph, frees, data, seed)
    searched = [f for f in frees if f.place not in {part.name for part in linear}]
    held: tuple[str, ...] = ()
    problem = _Problem(data, graph, searched, linear, until)
    if hold and (held := problem.repeated(seed)):
        frees = tuple(f for f in frees if f.name not in held)
        problem = _Problem(data, graph, [f for f in searched if f.name not in held], linear, until)
    objective, start = problem.objective, problem.start
    objective.columns(start)  # raises an InputError if the graph with its given values cannot be simulated
    starts = [start, *_drawn(objective, options["starts"] - 1, seed, lambda f: progress(0.2 * f))]
    found = search(objective, starts, lambda f: progress(0.2 + 0.8 * f))
    objective.until = np.inf
    told = determined(objective, found.p)
    table, warnings = told.table, told.warnings
    table = {label: table[label] for f in frees for label in f.labels}
    if not found.whole:
        warnings.append(f"the search ended at its limit of {options['seconds']:g} s: increase the option seconds")
    limits = {
        label: (table[label]["value"], *bound)
        for f, bound in zip(problem.searched, problem.bounds, strict=True)
        for label in f.labels
        if f.sum is None and not f.rises
    }
    return (
        _with_ports(objective.graph(found.p), data),
        len(table),
        {
            "free": table,
            "condition": told.condition,
            **({"held": list(held)} if held else {}),
            "bounded": limits,
            "warnings": warnings,
        },
    )


class _Problem:
    """Objective of a fit: the parameters `searched` are searched, and linear least squares gives `linear`."""

    def __init__(
        self, data: Dataset, graph: Graph, searched: Sequence[Free], linear: Sequence[Linear], until: float
    ) -> None:
        self.searched, self.bounds = searched, [default_bounds(f, graph, data) for f in searched]
        _check_logs(searched, self.bounds)
        whole = {f.place: graph.node(f.node).value(f.parameter) for f in searched}
        coordinates, self.start = made_coordinates(searched, self.bounds, whole)
        self.objective = Objective(data, graph, coordinates, linear, until=until)

    def repeated(self, seed: int) -> tuple[str, ...]:
        """Return the names of redundant parameters, whose effect on the output is a combination of other effects.

        If two parameters have the same effect, the first one is redundant. `seed` is the seed of the random test point.
        """
        c, rng = self.objective.coordinates, np.random.default_rng(seed)
        for _ in range(TRIED):
            p = self.start + 0.1 * rng.uniform(-1, 1, len(self.start)) * np.minimum(c.hi - c.lo, 10 * c.scale)
            p = c.inside(p)
            with suppress(InputError):
                columns = self.objective.columns(p)[1]
                break
        else:
            return ()
        self.objective.project(p)
        effects = self.objective.sensitivities(p)
        basis = np.linalg.qr(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))[0]
        found, at = [], len(p)
        for free in reversed(self.searched):
            n = len(free.start) - (free.sum is not None)
            own, at = effects[:, at - n : at], at - n
            left = own - basis @ (basis.T @ own)
            left -= basis @ (basis.T @ left)
            size = np.linalg.norm(own, axis=0)
            new = np.linalg.norm(left, axis=0) > REPEATED * size
            if not (new & (size > 0)).any():
                found.append(free.name)
            else:
                basis = np.linalg.qr(np.column_stack([basis, left[:, new] / size[new]]))[0]
        return tuple(found)


def _check_ports(graph: Graph, data: Dataset) -> None:
    where = data.path or data.name
    if graph.n_outputs != 1 or not graph.inputs or graph.n_inputs != len(graph.inputs):
        raise InputError(
            f"{where}: The graph of a fit must have one output, the input u and covariates beside it. Got "
            f"{graph.n_inputs} inputs and {graph.n_outputs} outputs."
        )
    takes = [port.name for port in graph.inputs[1:]]
    for name in data.covariates.names:
        if name not in takes:
            raise InputError(
                f"{where}: The graph must have an input for each covariate of the data. Got no {name!r} among its "
                f"inputs {', '.join(port.name for port in graph.inputs)}."
            )


def _with_ports(graph: Graph, data: Dataset) -> Graph:
    """Return the graph with start values from the record, and with units of the record for ports without a unit."""
    columns = {name: (unit, values) for name, unit, values in data.covariates}
    first, *others = graph.inputs
    inputs = [replace(first, unit=first.unit or data.unit_u, start=float(data.u[0]))]
    for port in others:
        unit, values = columns[port.name]
        mean = float(values[data.train].mean())
        inputs.append(replace(port, unit=port.unit or unit, start=mean, text=port.text or "covariate"))
    output = replace(graph.outputs[0], unit=graph.outputs[0].unit or data.unit_y)
    return Graph(graph.nodes, graph.wires, inputs, [output], sort=False, step=graph.step)


def _check_logs(searched: Sequence[Free], bounds: Sequence[tuple[float, float]]) -> None:
    for free, (lo, _) in zip(searched, bounds, strict=True):
        if is_log(free) and free.sum is None and not lo > 0:
            raise InputError(f"The lower bound of {free.name!r} must be positive for the scale 'log'. Got {lo:g}.")


def _drawn(objective: Objective, count: int, seed: int, progress: Progress) -> list[Array]:
    """Return the best `count` of many random points between the bounds."""
    c, rng = objective.coordinates, np.random.default_rng(seed)
    if not len(c.lo):
        return []
    rated = []
    with suppress(OutOfTime):  # the search then returns the best point so far
        for i in range(TRIED * count):
            progress(i / (TRIED * count))
            p = rng.uniform(c.lo, c.hi)
            r = objective.residuals(p)
            rated.append((float(r @ r), i, p))
    return [p for _, _, p in sorted(rated)[:count]]


def around(node: Node, data: Dataset) -> tuple[Graph, dict[str, Spec]]:
    """Return the graph ``input -> node -> readout`` for the fit of a single block, and its free parameters.

    The free parameters are the weights of the outputs, the offset, and all real parameters of the block without a given
    value. An exception is a parameter for the input at rest: without a given value, it is set to the first input of the
    record. An InputError is raised if the block has no output or does not have exactly one input.
    """
    block, sizes = node.block, node.sizes
    inputs, outputs = block.of("input"), block.of("output")
    if len(inputs) != 1 or sizes[inputs[0].name] != 1 or not outputs:
        raise InputError(
            f"A block to fit alone must have one input and an output. Got {node.type}: make a graph of it."
        )
    scaling, gain, offset = scaled_input(data.u[: data.train.stop])
    first = gain * float(data.u[0]) + offset
    rows = [v for v in block.parameters if v.type == "real" and v.name not in node.values]
    rest = {v.name: first for v in rows if v.follows and group(block, v) == "Start"}
    ends = [
        f"{node.name}.{v.name}" + (f"[{k + 1}]" if sizes[v.name] > 1 else "")
        for v in outputs
        for k in range(sizes[v.name])
    ]
    nodes = [
        scaling,
        node.with_values(**rest),
        Node("readout", "sum", {"n": len(ends)}, {"k": np.ones(len(ends))}),
    ]
    wires = [("input.y", f"{node.name}.{inputs[0].name}"), *((a, f"readout.u[{k}]") for k, a in enumerate(ends, 1))]
    graph = device(data, nodes, wires)
    free: dict[str, Spec] = {f"{node.name}.{v.name}": True for v in rows if v.name not in rest}
    return graph, {**free, "readout.k": True, "readout.offset": True}


def named(node: str, free: Mapping[str, Spec]) -> dict[str, Spec]:
    """Add the name of the block `node` to the names in `free`, and add the weights and the offset of `around`."""
    own = {name if "." in name else f"{node}.{name}": spec for name, spec in free.items()}
    return {**own, "readout.k": True, "readout.offset": True}


ROWS = 1000  # maximum number of rows of a simulation
EQUAL = 1e-9  # relative difference up to which two changes of the output count as equal


def linear_parts(graph: Graph, frees: Sequence[Free], data: Dataset, seed: int = 0) -> tuple[Linear, ...]:
    """Return the parameters that linear least squares can compute, so that no search is needed for them.

    They are jointly linear and have no bound except a lower bound of 0. `seed` is the seed of the random values.
    """
    able = [f for f in frees if _may(f)]
    if not able:
        return ()
    rng = np.random.default_rng(seed)
    stride = max(1, data.train.stop // ROWS)  # the test needs the turning points of the input, but not its dynamics
    rows = rows_of(graph, data).reshape(len(data.u), -1)[: data.train.stop : stride][:ROWS]
    runs = Runs(graph)

    def run(values: Mapping[str, Array]) -> Array | None:
        with suppress(InputError):
            runs.put(values)
            y = runs.run(rows, data.h)
            return y if np.isfinite(y).all() else None
        return None

    start = {f.place: graph.node(f.node).value(f.parameter) for f in able}

    def moved(values: Mapping[str, Array], free: Free, by: Array) -> dict[str, Array]:
        whole = values[free.place].copy()
        whole[list(free.elements)] += by
        return {**values, free.place: whole}

    sizes = [np.where(f.start == 0, 1.0, np.abs(f.start)) for f in able]
    steps = [rng.uniform(0.5, 1.5, len(size)) * size for size in sizes]

    def zeroed(chosen: Sequence[int]) -> bool:
        """Return whether the core accepts the value 0 for these parameters, which is needed to compute a column."""
        values = dict(start)
        for i in chosen:
            values = moved(values, able[i], -values[able[i].place][list(able[i].elements)])
        return run(values) is not None

    around = start
    for free, step in zip(able, steps, strict=True):
        other = moved(around, free, rng.uniform(0.1, 1) * step)
        if run(other) is not None:
            around = other

    def affine(values: Mapping[str, Array], i: int) -> bool:
        y = [run(moved(values, able[i], k * steps[i])) for k in (0, 1, 2)]
        still = y[0] is not None and y[1] is not None and np.array_equal(y[0], y[1])
        return not still and _equal(y[0], y[1], y[1], y[2])

    def apart(i: int, j: int) -> bool:
        at = moved(around, able[i], steps[i])
        y = [run(around), run(at), run(moved(around, able[j], steps[j])), run(moved(at, able[j], steps[j]))]
        return _equal(*y)

    chosen: list[int] = []
    order = {n.name: k for k, n in enumerate(graph.nodes)}
    likely = sorted(range(len(able)), key=lambda i: (-len(able[i].elements), -order[able[i].node]))
    for i in likely:
        if affine(start, i) and affine(around, i) and all(apart(i, j) for j in chosen) and zeroed([*chosen, i]):
            chosen.append(i)
    return tuple(Linear(able[i].place, able[i].elements, able[i].lo == 0) for i in sorted(chosen))


def _may(free: Free) -> bool:
    """Return whether a parameter has no bound except a lower bound of 0, no scale and no constraint."""
    plain = free.scale is None and not free.rises and free.sum is None
    return plain and free.lo in (0.0, -np.inf) and free.hi == np.inf


def _equal(a: Array | None, b: Array | None, c: Array | None, d: Array | None) -> bool:
    """Return whether b - a and d - c are equal up to rounding."""
    if a is None or b is None or c is None or d is None:
        return False
    size = max(float(np.abs(v).max()) for v in (a, b, c, d))
    change = float(np.abs(b - a).max())
    return bool(np.abs((b - a) - (d - c)).max() <= EQUAL * change + 1e-13 * size)
