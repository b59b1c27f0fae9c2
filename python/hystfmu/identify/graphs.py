"""Graph of a fitted device: ports from its record, including covariates, and the wires of a chain."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output


def device(
    data: Dataset,
    nodes: Sequence[Node],
    wires: Sequence[tuple[str, str]],
    to: Sequence[str] = ("input.u",),
    source: str = "readout.y",
    start: float | None = None,
    beside: Sequence[Input] = (),
) -> Graph:
    """Return a graph with input `u` and output `y`, in the units of the record.

    The input u drives the endpoints `to`; its start value is its first value, or `start`. `source` gives y. Further
    inputs follow u.
    """
    first = Input("u", tuple(to), data.unit_u, float(data.u[0]) if start is None else start)
    return Graph(nodes, wires, [first, *beside], [Output("y", source, data.unit_y)])


def scaled_input(seen: Array, span: float = 2.0) -> tuple[Node, float, float]:
    """Return the block ``input``, by which `seen` fills a range of `span` around 0, with its gain and offset."""
    gain = span / float(np.ptp(seen))
    offset = -gain * float(seen.min() + seen.max()) / 2
    return Node("input", "scaling", {"n": 1}, {"gain": gain, "offset": offset}), gain, offset


def wired(nodes: list[Node]) -> list[tuple[str, str]]:
    """Return the wires of a chain of nodes with ports u and y."""
    return [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]


def covariate_inputs(data: Dataset, to: Sequence[tuple[str, ...]]) -> list[Input]:
    """Return an input for each covariate; the input drives endpoints, and starts at its mean over the training rows."""
    return [
        Input(name, ends, unit, float(values[data.train].mean()), "covariate")
        for (name, unit, values), ends in zip(data.covariates, to, strict=True)
    ]
