"""A single block as a graph to fit: its input scaled to [-1, 1], its outputs weighted and shifted."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.graph.listing import group
from hystfmu.identify.estimate.free import Spec


def around(node: Node, data: Dataset) -> tuple[Graph, dict[str, Spec]]:
    """Return ``input -> node -> readout`` and its free parameters.

    Free are the weights of the outputs, the offset, and every real parameter of the block whose value is not given.
    Inputs at rest that are not given are the first one of the record.

    Raises
    ------
    InputError
        The block has other inputs than one, or no output.
    """
    block, sizes = node.block, node.sizes
    inputs, outputs = block.of("input"), block.of("output")
    if len(inputs) != 1 or sizes[inputs[0].name] != 1 or not outputs:
        raise InputError(
            f"A block to fit alone must have one input and an output. Got {node.type}: make a graph of it."
        )
    seen = data.u[: data.train.stop]
    middle, half = float(seen.max() + seen.min()) / 2, float(np.ptp(seen)) / 2
    first = (float(data.u[0]) - middle) / half
    rows = [v for v in block.parameters if v.type == "real" and v.name not in node.values]
    rest = {v.name: first for v in rows if v.follows and group(block, v) == "Start"}
    ends = [
        f"{node.name}.{v.name}" + (f"[{k + 1}]" if sizes[v.name] > 1 else "")
        for v in outputs
        for k in range(sizes[v.name])
    ]
    nodes = [
        Node("input", "scaling", {"n": 1}, {"gain": 1 / half, "offset": -middle / half}),
        node.with_values(**rest),
        Node("readout", "sum", {"n": len(ends)}, {"k": np.ones(len(ends))}),
    ]
    wires = [("input.y", f"{node.name}.{inputs[0].name}"), *((a, f"readout.u[{k}]") for k, a in enumerate(ends, 1))]
    ports = [Input("u", ("input.u",), data.unit_u, float(data.u[0]))]
    graph = Graph(nodes, wires, ports, [Output("y", "readout.y", data.unit_y)])
    free: dict[str, Spec] = {f"{node.name}.{v.name}": True for v in rows if v.name not in rest}
    return graph, {**free, "readout.k": True, "readout.offset": True}


def named(node: str, free: Mapping[str, Spec]) -> dict[str, Spec]:
    """Return the free parameters of a block alone under the names of its graph, with weights and offset of outputs."""
    own = {name if "." in name else f"{node}.{name}": spec for name, spec in free.items()}
    return {**own, "readout.k": True, "readout.offset": True}
