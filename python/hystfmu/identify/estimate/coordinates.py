"""Coordinates (search variables) of a search, their default bounds, and the parameter values at a point.

A coordinate is a parameter value, its logarithm, the difference of two neighbouring elements of a rising array, or the
logarithm of a ratio of two elements with a given sum.

Default bounds depend on the parameter. A frequency lies between one cycle per record and half of the sampling rate. A
time lies between a tenth of a step and ten record lengths. A parameter in the unit of measure of an input, such as a
threshold, lies within the range of this input, extended on each side by the length of this range. A parameter with
limits in its block lies between these limits. The logarithm of a positive parameter is searched, from a thousandth to
the thousandfold of its value in the graph.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Output
from hystfmu.identify.estimate.free import Free
from hystfmu.identify.solvers.trust_region import Coordinates
from hystfmu.model import rows_of

DECADES = 3.0  # default bounds of a positive parameter: decades to both sides of its value
WIDE = 10.0  # default bounds of other parameters: multiple of the absolute value (at least of 1) to both sides of 0
LARGE = 1e5  # a limit of a block above this value is not used as a bound
RATIO = 10.0  # bound of the logarithm of the ratio of an element to the last element, if the sum is given
STEP = 0.3  # scale of a logarithm
SHARE = 0.1  # scale of other coordinates, relative to the difference of their bounds


def default_bounds(free: Free, graph: Graph, data: Dataset) -> tuple[float, float]:
    """Return the bounds of a searched parameter: given bounds, or the default bounds of the module docstring."""
    least, most = float(free.start.min()), float(free.start.max())
    seconds = (data.train.stop - data.train.start) * data.h
    if free.row.unit == "Hz":
        lo, hi = 1 / seconds, 0.5 / data.h
    elif free.row.unit == "s":
        lo, hi = 0.1 * data.h, 10 * seconds
    elif free.row.lo > -LARGE and free.row.hi < LARGE:
        lo, hi = free.row.lo, free.row.hi
    elif free.row.follows:
        first, last = _range(free, graph, data)
        wide = last - first
        lo, hi = (0.0, wide) if free.row.lo >= 0 else (first - wide, last + wide)
    elif is_log(free):
        lo, hi = least * 10**-DECADES, most * 10**DECADES
    else:
        lo, hi = (s * WIDE * max(abs(least), abs(most), 1.0) for s in (-1, 1))
    lo, hi = max(min(lo, least), free.lo), min(max(hi, most), free.hi)
    lower, upper = (v if v is not None and np.isfinite(v) else None for v in (free.lower, free.upper))
    return lo if lower is None else free.lo, hi if upper is None else free.hi


def is_log(free: Free) -> bool:
    """Return whether the logarithm of a parameter is searched."""
    if free.scale is not None:
        return free.scale == "log"
    open_above = free.row.hi >= LARGE and not free.row.follows
    return not free.rises and bool((free.start > 0).all()) and free.row.lo >= 0 and open_above and free.lower != 0


def _range(free: Free, graph: Graph, data: Dataset) -> tuple[float, float]:
    """Return the range in the data of the block input that has the same unit of measure as the parameter."""
    end = f"{free.node}.{free.row.follows}"
    rows = rows_of(graph, data).reshape(len(data.u), -1)[: data.train.stop]
    for k, port in enumerate(graph.inputs):
        if any(to.partition("[")[0] == end for to in port.to):
            return float(rows[:, k].min()), float(rows[:, k].max())
    sources = [a for a, b in graph.wires if b.partition("[")[0] == end]
    if not sources:
        return -1.0, 1.0
    probe = Graph(graph.nodes, graph.wires, graph.inputs, [Output("probe", sources[0])], sort=False, step=graph.step)
    seen = probe.run(rows, data.h)
    return float(seen.min()), float(seen.max())


@dataclass(frozen=True)
class _Part:
    """Coordinates of one free parameter."""

    lo: Array
    hi: Array
    scale: Array
    start: Array
    values: Callable[[Array], Array]


def made_coordinates(
    frees: Sequence[Free], bounds: Sequence[tuple[float, float]], whole: Mapping[str, Array]
) -> tuple[Coordinates, Array]:
    """Return the coordinates of free parameters with given bounds, and the point with their values in the graph.

    `whole` contains the values of the parameters in the graph by the names ``node.parameter``, with all elements.
    """
    parts = [_part(free, lo, hi) for free, (lo, hi) in zip(frees, bounds, strict=True)]
    ends = np.cumsum([0, *(len(part.start) for part in parts)])

    def values(p: Array) -> dict[str, Array]:
        found: dict[str, Array] = {}
        for free, part, first, last in zip(frees, parts, ends, ends[1:], strict=False):
            array = found.setdefault(free.place, whole[free.place].copy())
            array[list(free.elements)] = part.values(p[first:last])
        return found

    def joined(name: str) -> Array:
        return np.concatenate([np.zeros(0), *(getattr(part, name) for part in parts)])

    return Coordinates(joined("lo"), joined("hi"), joined("scale"), values), joined("start")


def _part(free: Free, lo: float, hi: float) -> _Part:
    n, room = len(free.start), hi - lo
    if free.sum is not None:
        total = free.sum

        def shares(p: Array) -> Array:
            e = np.exp(np.append(p, 0.0))
            return np.asarray(total * e / e.sum())

        first = np.log(free.start[:-1] / free.start[-1])
        return _Part(first - RATIO, first + RATIO, np.full(n - 1, STEP), first, shares)
    if free.rises:

        def rising(p: Array) -> Array:
            return np.asarray(np.minimum(np.cumsum(p), hi))

        least = np.concatenate([[lo], np.zeros(n - 1)])
        most = np.concatenate([[hi], np.full(n - 1, room)])
        return _Part(least, most, np.full(n, SHARE * room / n), np.diff(free.start, prepend=0.0), rising)
    if is_log(free):
        ends = np.log(lo), np.log(hi)
        return _Part(np.full(n, ends[0]), np.full(n, ends[1]), np.full(n, STEP), np.log(free.start), np.exp)
    return _Part(np.full(n, lo), np.full(n, hi), np.full(n, SHARE * room), free.start.copy(), np.array)
