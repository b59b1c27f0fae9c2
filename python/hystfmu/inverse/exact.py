"""The exact inverse: block by block from the output to the input, each by the block that inverts it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.core.library import NO_LIMIT
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.inverse.implicit import implicit_inverse
from hystfmu.model import Model


def exact_inverse(model: Model) -> Model:
    """The inverse of a model whose blocks stand in one chain and have inverses.

    Raises
    ------
    InputError
        Another structure, or a block without an inverse; the sentence names it.
    """
    chain = _chain(model)
    nodes = [_INVERT.get(n.type, _same_values)(n) for n in reversed(chain)]
    reads = [f"{n.name}.{n.block.of('input')[0].name}" for n in nodes]
    gives = [f"{n.name}.{n.block.of('output')[0].name}" for n in nodes]
    wires = list(zip(gives[:-1], reads[1:], strict=True))
    source, sink = model.graph.inputs[0], model.graph.outputs[0]
    start = float(model.predict(np.full(2, source.start))[0])
    graph = Graph(
        nodes,
        wires,
        [Input("u", (reads[0],), sink.unit, start, "wanted output")],
        [Output("y", gives[-1], source.unit, "input that gives it")],
    )
    graph.executor()  # a block whose values have no inverse says so
    key = model.key.removesuffix("_inverse") if model.key.endswith("_inverse") else f"{model.key}_inverse"
    return Model(
        key, graph, model.step, f"exact inverse: {model.text}", {}, {"inverse": "exact", "of": model.provenance}
    )


def _chain(model: Model) -> list[Node]:
    """The nodes from the input to the output, each with one invertible input and output."""
    graph = model.graph
    follows = {a.split(".")[0]: b for a, b in graph.wires}
    for n in graph.nodes:
        if n.block.inverse is None:
            hint = _instead(model) if n.type not in ("delay", "transfer_function") else ""
            raise InputError(f"the block {n.name!r} ({n.type}) has no exact inverse{hint}")
    at = graph.inputs[0].to[0].split(".")[0]
    chain = [graph.node(at)]
    while at in follows:
        at = follows[at].split(".")[0]
        chain.append(graph.node(at))
    straight = len(graph.inputs[0].to) == 1 and len(graph.wires) == len(chain) - 1 == len(graph.nodes) - 1
    if not straight or graph.outputs[0].source.split(".")[0] != at:
        raise InputError(f"an exact inverse needs blocks in one chain from input to output{_instead(model)}")
    return chain


def _instead(model: Model) -> str:
    """The methods that do not refuse the model, as the end of a sentence; both need the range of its input."""
    if "span_u" not in model.provenance:
        return "; other methods need the input range of the model, provenance.span_u = [min, max]"
    try:
        implicit_inverse(model)
    except InputError:
        return "; use the method 'learned'"
    return "; use the method 'implicit' or 'learned'"


def _invert_prandtl_ishlinskii(n: Node) -> Node:
    w0, w = float(n.value("w0")[0]), n.value("w")
    if not w0 > 0:
        raise InputError(
            f"the block {n.name!r} has w0 = {w0:g}: a sum of plays without linear term has zero slope after each "
            "reversal and no continuous inverse; fit with w0_min > 0"
        )
    slope = np.cumsum(np.concatenate([[w0], w]))
    if not slope.min() > 0:
        raise InputError(f"the block {n.name!r} is not increasing: w0 + w_1 + ... + w_i falls to {slope.min():g}")
    return _same_values(n)


def _same_values(n: Node) -> Node:
    """The block of the inverse has the parameters of the forward block, but no choice of the memory."""
    if "memory" in n.values and n.value("memory")[0] != 0:
        raise InputError(f"the block {n.name!r} has memory = 'last', which has no inverse; use memory = 'dominant'")
    values = {v.name: n.value(v.name) for v in n.block.parameters if v.name != "memory"}
    inverse = n.block.inverse
    assert inverse is not None  # _chain() has refused it
    return Node(n.name, inverse, n.dims, values)


def _invert_dead_zones(n: Node) -> Node:
    """An increasing piecewise linear curve through 0 has one as its inverse: the same block with other values."""
    r, w = n.value("r"), n.value("w")
    centre = float(n.value("w0")[0] + w[r == 0].sum())  # the slope at 0: a dead zone at 0 is the input itself
    values: dict[str, Any] = {"w0": 1 / centre if centre else np.inf, "r": [], "w": []}
    for side in (-1.0, 1.0):
        slope, at, height = centre, 0.0, 0.0
        for knot in np.unique(side * r[side * r > 0]):
            height, at, before = height + slope * (knot - at), knot, slope
            slope = slope + w[r == side * knot].sum()
            if not (before > 0 and slope > 0):
                raise InputError(f"the block {n.name!r} is not increasing: its slope falls to {min(before, slope):g}")
            values["r"].append(side * height)
            values["w"].append(1 / slope - 1 / before)
    if not centre > 0:
        raise InputError(f"the block {n.name!r} is not increasing: its slope at 0 is {centre:g}")
    if not values["r"]:  # a straight line
        values |= {"r": [1.0], "w": [0.0]}
    return Node(n.name, n.type, {"n": len(values["r"])}, values)


def _invert_scaling(n: Node) -> Node:
    gain, offset, lo, hi = (n.value(name) for name in ("gain", "offset", "lo", "hi"))
    if len(gain) != 1:
        raise InputError(f"the block {n.name!r} scales {len(gain)} signals; an exact inverse needs one")
    if gain[0] == 0:
        raise InputError(f"the block {n.name!r} has gain 0 and no inverse")
    ends = []
    for limit in (lo[0], hi[0]):  # where the forward block limits, so does the inverse, at the image of the limit
        ends.append(limit * gain[0] + offset[0] if abs(limit) < NO_LIMIT else np.copysign(NO_LIMIT, limit * gain[0]))
    values = {"gain": 1 / gain, "offset": -offset / gain, "lo": min(ends), "hi": max(ends)}
    return Node(n.name, n.type, {"n": 1}, values)


# blocks whose inverse has other values, or asks for more than the table says
_INVERT: dict[str, Callable[[Node], Node]] = {
    "prandtl_ishlinskii": _invert_prandtl_ishlinskii,
    "dead_zones": _invert_dead_zones,
    "scaling": _invert_scaling,
}
