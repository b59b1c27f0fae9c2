"""Exact inverse: each block of a chain is replaced by its inverse block, in the order from output to input.

A model with covariates also has blocks that depend only on covariates. Their outputs enter the chain in sums and
products. The inverse solves these sums and products for the signal of the chain.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.base import InputError
from hystfmu.core.library import NO_LIMIT
from hystfmu.graph import Graph, Node
from hystfmu.inverse.dynamic import DYNAMICS
from hystfmu.inverse.implicit import implicit_inverse
from hystfmu.inverse.ports import assembled, chain
from hystfmu.model import M, Model

ENTERED = ("sum", "product")


def exact_inverse(model: M) -> M:
    """Return the inverse of a model whose blocks form one chain and have inverses.

    Blocks that depend only on covariates may be in parallel with the chain. If the blocks form no chain, or a block has
    no inverse, an InputError is raised.
    """
    g = model.graph
    alone = driven_beside(g)
    forward = _chain(model, alone)
    nodes: list[Node] = []
    reads: list[str] = []
    further: list[tuple[str, str]] = []
    for n in reversed(forward):
        beside = inverted_beside(g, n, alone)
        node, into = (_INVERT.get(n.type, _same_values)(n), []) if beside is None else beside
        nodes.append(node)
        reads.append(f"{node.name}.{node.block.of('input')[0].name}" + ("" if beside is None else "[1]"))
        further += into
    gives = [f"{n.name}.{n.block.of('output')[0].name}" for n in nodes]
    wires = [*zip(gives[:-1], reads[1:], strict=True), *further]
    wires += [(a, b) for a, b in g.wires if b.split(".")[0] in alone]
    parts = [*(n for n in g.nodes if n.name in alone), *nodes]
    inverse = assembled(model, "exact", parts, wires, (reads[0],), gives[-1])
    return replace(inverse, key=model.key.removesuffix("_inverse")) if model.key.endswith("_inverse") else inverse


def _chain(model: Model, alone: set[str]) -> list[Node]:
    """Return the nodes of the chain from input to output, without the nodes `alone` that depend only on covariates.

    A node without an inverse, or nodes that form no chain, raise an InputError.
    """
    graph = model.graph
    for n in graph.nodes:
        if n.name not in alone and n.block.inverse is None and not takes_beside(graph, n, alone):
            hint = _instead(model) if n.type not in DYNAMICS else ""
            raise InputError(f"The blocks must be invertible. Got {n.name!r}: {n.type} has no exact inverse{hint}.")
    found = chain(graph, alone)
    if found is None:
        raise InputError(
            "The blocks of an exact inverse must form one chain from input to output. "
            f"Got another structure{_instead(model)}."
        )
    return found


def _instead(model: Model) -> str:
    """Return the end of an error message, which names other methods that can invert the model."""
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
    """Return the inverse block with the same parameters. Inverse blocks have no `memory`, so it must be 0."""
    if "memory" in n.values and n.value("memory")[0] != 0:
        raise InputError(f"The 'memory' parameter of {n.name} must be 'dominant' for an inverse. Got 'last' instead.")
    values = {v.name: n.value(v.name) for v in n.block.parameters if v.name != "memory"}
    inverse = n.block.inverse
    assert inverse is not None  # _chain() has refused it
    return Node(n.name, inverse, n.dims, values)


def _invert_dead_zones(n: Node) -> Node:
    """Return the inverse of an increasing piecewise linear curve through 0, which is again a block `dead_zones`."""
    r, w = n.value("r"), n.value("w")
    centre = float(n.value("w0")[0] + w[r == 0].sum())  # slope at 0; the output of a dead zone of width 0 is its input
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
    for limit in (lo[0], hi[0]):  # limits on the input of the block become limits on the input of the inverse
        ends.append(limit * gain[0] + offset[0] if abs(limit) < NO_LIMIT else np.copysign(NO_LIMIT, limit * gain[0]))
    values = {"gain": 1 / gain, "offset": -offset / gain, "lo": min(ends), "hi": max(ends)}
    return Node(n.name, n.type, {"n": 1}, values)


# blocks whose inverse has other parameter values, or conditions that the table of the block does not contain
_INVERT: dict[str, Callable[[Node], Node]] = {
    "prandtl_ishlinskii": _invert_prandtl_ishlinskii,
    "dead_zones": _invert_dead_zones,
    "scaling": _invert_scaling,
}


def driven_beside(g: Graph) -> set[str]:
    """Return the names of the blocks that depend only on covariates, not on the first input."""
    if len(g.inputs) == 1:
        return set()
    reached: set[str] = set()
    new = {end.split(".")[0] for end in g.inputs[0].to}
    while new:
        reached |= new
        new = {b.split(".")[0] for a, b in g.wires if a.split(".")[0] in new} - reached
    return {n.name for n in g.nodes} - reached


def takes_beside(g: Graph, n: Node, alone: set[str]) -> bool:
    """Return whether a block is a sum or a product of the chain signal and outputs of the blocks `alone`."""
    return n.type in ENTERED and any(a.split(".")[0] in alone and b.split(".")[0] == n.name for a, b in g.wires)


def inverted_beside(g: Graph, n: Node, alone: set[str]) -> tuple[Node, list[tuple[str, str]]] | None:
    """Solve a sum or a product for the chain signal; return None for another block.

    The result is the inverse block and the wires to its second and further inputs. Its first input is the output of
    `n`. A weight of 0, or a factor that can be 0, raises an InputError.
    """
    if not takes_beside(g, n, alone):
        return None
    size = n.sizes["u"]
    drives = {b: a for a, b in g.wires}
    ends = [drives.get(f"{n.name}.u[{k + 1}]") for k in range(size)]
    (own,) = (k for k, a in enumerate(ends) if a is not None and a.split(".")[0] not in alone)
    others = [k for k in range(size) if k != own]
    if n.type == "sum":
        weights = n.value("k")
        if weights[own] == 0:
            raise InputError(f"The weight of {ends[own]} in {n.name} must not be 0 for an inverse. Got 0.")
        own_weight, offset = float(weights[own]), float(n.value("offset")[0])
        solved = np.concatenate([[1.0], -weights[others]]) / own_weight
        node = Node(n.name, n.type, {"n": size}, {"k": solved, "offset": -offset / own_weight})
    else:
        factors = n.dims["n"]
        if own >= factors or n.dims["m"] > 0:
            raise InputError(f"The block {n.name!r} must have factors only for an inverse. Got a divisor.")
        for k in others:
            _refuse_zero(g, ends[k], n)
        node = Node(n.name, n.type, {"n": 1, "m": size - 1}, {"least": n.value("least")})
    wires = [(a, f"{n.name}.u[{i}]") for i, k in enumerate(others, 2) if (a := ends[k]) is not None]
    return node, wires


def _refuse_zero(g: Graph, end: str | None, n: Node) -> None:
    """Raise an InputError if a factor can be 0, or if it is not a sum of covariates with limits."""
    factor = None if end is None else g.node(end.split(".")[0])
    drives = {b: a for a, b in g.wires}
    limited = None if factor is None else drives.get(f"{factor.name}.u")
    scaling = None if limited is None else g.node(limited.split(".")[0])
    if factor is not None and factor.type == "sum" and scaling is not None and scaling.type == "scaling":
        at = [scaling.value(e) * scaling.value("gain") + scaling.value("offset") for e in ("lo", "hi")]
        reach = [factor.value("k") * a for a in at]
        offset = float(factor.value("offset")[0])
        low, high = (offset + float(pick(*reach).sum()) for pick in (np.minimum, np.maximum))
        if low > 0 or high < 0:
            return
        got = f"one from {low:.3g} to {high:.3g}"
    else:
        got = "one without limits"
    raise InputError(f"The factor {end} of {n.name} must keep its sign for an inverse. Got {got}.")
