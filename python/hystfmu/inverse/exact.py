"""Exact inverse: block by block from output to input, each by the block that inverts it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.core.library import NO_LIMIT
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.inverse.beside import driven_beside, inverted_beside, takes_beside
from hystfmu.inverse.implicit import implicit_inverse
from hystfmu.inverse.input_range import at_start
from hystfmu.inverse.port_texts import given_text, wanted_text
from hystfmu.model import Model


def exact_inverse(model: Model) -> Model:
    """Invert a model whose blocks form one chain and have inverses; blocks that covariates drive may be in parallel.

    Raises
    ------
    InputError
        The blocks form no chain, or one has no inverse; the message names it.
    """
    g = model.graph
    alone = driven_beside(g)
    chain = _chain(model, alone)
    made = [inverted_beside(g, n, alone) for n in reversed(chain)]
    nodes = [
        _INVERT.get(n.type, _same_values)(n) if other is None else other.node
        for n, other in zip(reversed(chain), made, strict=True)
    ]
    reads = [
        f"{n.name}.{n.block.of('input')[0].name}" + ("" if other is None else "[1]")
        for n, other in zip(nodes, made, strict=True)
    ]
    gives = [f"{n.name}.{n.block.of('output')[0].name}" for n in nodes]
    wires = list(zip(gives[:-1], reads[1:], strict=True))
    wires += [wire for other in made if other is not None for wire in other.wires]
    wires += [(a, b) for a, b in g.wires if b.split(".")[0] in alone]
    source, sink = g.inputs[0], g.outputs[0]
    graph = Graph(
        [*(n for n in g.nodes if n.name in alone), *nodes],
        wires,
        [Input("u", (reads[0],), sink.unit, at_start(model), wanted_text(sink)), *g.inputs[1:]],
        [Output("y", gives[-1], source.unit, given_text(source))],
    )
    graph.executor()  # the core refuses values that have no inverse
    key = model.key.removesuffix("_inverse") if model.key.endswith("_inverse") else f"{model.key}_inverse"
    return Model(
        key, graph, model.step, f"exact inverse: {model.text}", {}, {"inverse": "exact", "of": model.provenance}
    )


def _chain(model: Model, alone: set[str]) -> list[Node]:
    """Return the nodes from input to output, each with one invertible input and output, without the parallel ones
    `alone`."""
    graph = model.graph
    path = [(a, b) for a, b in graph.wires if a.split(".")[0] not in alone]
    follows = {a.split(".")[0]: b for a, b in path}
    for n in graph.nodes:
        if n.name not in alone and n.block.inverse is None and not takes_beside(graph, n, alone):
            hint = _instead(model) if n.type not in ("delay", "transfer_function") else ""
            raise InputError(f"The blocks must be invertible. Got {n.name!r}: {n.type} has no exact inverse{hint}.")
    at = graph.inputs[0].to[0].split(".")[0]
    chain = [graph.node(at)]
    while at in follows:
        at = follows[at].split(".")[0]
        chain.append(graph.node(at))
    straight = len(graph.inputs[0].to) == 1 and len(path) == len(chain) - 1 == len(graph.nodes) - len(alone) - 1
    if not straight or graph.outputs[0].source.split(".")[0] != at:
        raise InputError(
            "The blocks of an exact inverse must form one chain from input to output. "
            f"Got another structure{_instead(model)}."
        )
    return chain


def _instead(model: Model) -> str:
    """Name the other methods that accept the model, as the end of a sentence; both need the range of its input."""
    if "span_u" not in model.provenance:
        return "; other methods need the input range of the model, provenance.span_u = [min, max]"
    try:
        implicit_inverse(model)
    except InputError:
        return "; use the method 'learned'"
    return "; use the method 'implicit'" + ("" if len(model.graph.inputs) > 1 else " or 'learned'")


def _invert_prandtl_ishlinskii(n: Node) -> Node:
    w0, w = float(n.value("w0")[0]), n.value("w")
    if not w0 > 0:
        raise InputError(
            f"The 'w0' parameter of {n.name} must be greater than 0 for an inverse. Got {w0:g} instead: a sum of plays "
            "without linear term has slope 0 after each reversal and no continuous inverse. Fit with w0_min > 0."
        )
    slope = np.cumsum(np.concatenate([[w0], w]))
    if not slope.min() > 0:
        raise InputError(
            f"The block {n.name!r} must be increasing for an inverse: w0 + w_1 + ... + w_i > 0. "
            f"Got {slope.min():g} instead."
        )
    return _same_values(n)


def _same_values(n: Node) -> Node:
    """Invert by the block of the inverse with the same parameters; it has no choice of the memory."""
    if "memory" in n.values and n.value("memory")[0] != 0:
        raise InputError(f"The 'memory' parameter of {n.name} must be 'dominant' for an inverse. Got 'last' instead.")
    values = {v.name: n.value(v.name) for v in n.block.parameters if v.name != "memory"}
    inverse = n.block.inverse
    assert inverse is not None  # _chain() has refused it
    return Node(n.name, inverse, n.dims, values)


def _invert_dead_zones(n: Node) -> Node:
    """Invert an increasing piecewise linear curve through 0 by the same block with other values."""
    r, w = n.value("r"), n.value("w")
    centre = float(n.value("w0")[0] + w[r == 0].sum())  # the slope at 0: a dead zone at 0 is the input itself
    values: dict[str, Any] = {"w0": 1 / centre if centre else np.inf, "r": [], "w": []}
    for side in (-1.0, 1.0):
        slope, at, height = centre, 0.0, 0.0
        for knot in np.unique(side * r[side * r > 0]):
            height, at, before = height + slope * (knot - at), knot, slope
            slope = slope + w[r == side * knot].sum()
            if not (before > 0 and slope > 0):
                raise InputError(
                    f"The block {n.name!r} must be increasing for an inverse. Got a slope of {min(before, slope):g}."
                )
            values["r"].append(side * height)
            values["w"].append(1 / slope - 1 / before)
    if not centre > 0:
        raise InputError(f"The block {n.name!r} must be increasing for an inverse. Got a slope at 0 of {centre:g}.")
    if not values["r"]:  # a straight line
        values |= {"r": [1.0], "w": [0.0]}
    return Node(n.name, n.type, {"n": len(values["r"])}, values)


def _invert_scaling(n: Node) -> Node:
    gain, offset, lo, hi = (n.value(name) for name in ("gain", "offset", "lo", "hi"))
    if len(gain) != 1:
        raise InputError(f"The block {n.name!r} must scale one signal for an exact inverse. Got {len(gain)} instead.")
    if gain[0] == 0:
        raise InputError(f"The 'gain' parameter of {n.name} must not be 0 for an inverse. Got 0.")
    ends = []
    for limit in (lo[0], hi[0]):  # a limit of the forward block becomes one of the inverse, at its image
        ends.append(limit * gain[0] + offset[0] if abs(limit) < NO_LIMIT else np.copysign(NO_LIMIT, limit * gain[0]))
    values = {"gain": 1 / gain, "offset": -offset / gain, "lo": min(ends), "hi": max(ends)}
    return Node(n.name, n.type, {"n": 1}, values)


# blocks whose inverse has other values, or conditions that the table does not state
_INVERT: dict[str, Callable[[Node], Node]] = {
    "prandtl_ishlinskii": _invert_prandtl_ishlinskii,
    "dead_zones": _invert_dead_zones,
    "scaling": _invert_scaling,
}
