"""Bounds of a search where none are given: by the unit of measure of a parameter, its block, and the record.

A frequency lies between a cycle per record and half the sample rate, a time between a tenth of a step and ten records.
A parameter in the unit of an input (threshold, input at rest) lies within one span around the range of this input. A
parameter with limits in its block lies between these limits. A positive parameter is searched by its logarithm, over
three decades to both sides of its value in the graph.
"""

from __future__ import annotations

import numpy as np

from hystfmu.data import Dataset
from hystfmu.graph import Graph, Output
from hystfmu.identify.estimate.free import Free
from hystfmu.model.inputs import rows_of

DECADES = 3.0  # to both sides of a positive value
WIDE = 10.0  # times the value, or times 1, to both sides of one of any sign
LARGE = 1e5  # a limit of a block from here on is no limit of a search


def default_bounds(free: Free, graph: Graph, data: Dataset) -> tuple[float, float]:
    """Return the bounds of the search for a parameter that is not eliminated, including given ones."""
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
    """Return whether a parameter is searched by its logarithm."""
    if free.scale is not None:
        return free.scale == "log"
    open_above = free.row.hi >= LARGE and not free.row.follows
    return not free.rises and bool((free.start > 0).all()) and free.row.lo >= 0 and open_above and free.lower != 0


def _range(free: Free, graph: Graph, data: Dataset) -> tuple[float, float]:
    """Return the range of the input that has the unit of measure of a parameter, in the given graph."""
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
