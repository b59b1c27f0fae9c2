"""Functions that build the graph of a fitted model: its ports, the scaling of its input, and the wires of a chain."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hystfmu.base import Array
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
    sort: bool = True,
) -> Graph:
    """Return a graph with the input `u` and the output `y`, in the units of measure of the record.

    `nodes` and `wires` are the blocks and their connections. The input u is connected to the endpoints `to`, and its
    start value is `start`, by default the first input of the record. The output y is the endpoint `source`. `beside`
    contains further inputs. If `sort` is False, the blocks are in the order of evaluation.
    """
    first = Input("u", tuple(to), data.unit_u, float(data.u[0]) if start is None else start)
    return Graph(nodes, wires, [first, *beside], [Output("y", source, data.unit_y)], sort=sort)


def scaled_input(seen: Array, span: float = 2.0) -> tuple[Node, float, float]:
    """Return a block that scales the values `seen` to a range of width `span` around 0, and its gain and offset."""
    gain = span / float(np.ptp(seen))
    offset = -gain * float(seen.min() + seen.max()) / 2
    return Node("input", "scaling", {"n": 1}, {"gain": gain, "offset": offset}), gain, offset


def wired(nodes: list[Node]) -> list[tuple[str, str]]:
    """Return the wires that connect nodes in series, from the output y of a node to the input u of the next node."""
    return [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]


def covariate_inputs(data: Dataset, to: Sequence[tuple[str, ...]]) -> list[Input]:
    """Return one graph input for each covariate.

    `to` contains the endpoints of each input. The start value is the mean of the covariate over the training rows.
    """
    return [
        Input(name, ends, unit, float(values[data.train].mean()), "covariate")
        for (name, unit, values), ends in zip(data.covariates, to, strict=True)
    ]
