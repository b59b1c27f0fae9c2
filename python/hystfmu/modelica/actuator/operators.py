"""Slot of one operator: Krasnosel'skii-Pokrovskii or Duhem."""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.graph import Graph, Node
from hystfmu.modelica.actuator.slot import Slot, limits, numbers, value
from hystfmu.modelica.literals import number

DUHEM = ["scaling", "duhem", "scaling"]
REACH = 1.0  # greatest scaled input of a fit
FINE, INSIDE = 1001, 11  # points of a branch of the loop, and across it


def operator(graph: Graph) -> Slot | None:
    """Return the slot of a single operator."""
    types = [n.type for n in graph.nodes]
    if types == ["krasnoselskii_pokrovskii"]:
        (node,) = graph.nodes
        values = {"n": str(node.dims["n"])} | limits(node) | numbers(node, "w")
        return Slot("KrasnoselskiiPokrovskii", values, value(node, "u0"), offset=value(node, "offset"))
    if types != DUHEM:
        return None
    first, node, readout = graph.nodes
    values = {"n": str(node.dims["m"]), "q": str(node.dims["q"]), "w_start": number(value(node, "w0"))}
    values |= {k: number(value(node, k)) for k in ("k", "w_max")}
    values |= numbers(node, *(f"{k}_{way}" for k in "abc" for way in ("rise", "fall")))
    (gain, shift), (scale, offset) = ([value(x, k) for k in ("gain", "offset")] for x in (first, readout))
    return Slot("Duhem", values, value(node, "u0"), gain, shift, scale, offset, [], *_slopes(node))


def _slopes(node: Node) -> tuple[float, float]:
    """Return the slope of a rising output at the start, and the least slope of both directions in the largest loop."""
    k, u0, up = value(node, "k"), value(node, "u0"), np.linspace(-REACH, REACH, FINE)
    way = np.concatenate([up[up >= u0], up[::-1], up, up[::-1], up])
    w = (Graph.single(node).run(way).reshape(-1) - k * way)[-2 * FINE :].reshape(2, FINE)
    x, inside = np.tile(up, (INSIDE, 1)), np.linspace(w[0, ::-1], w[1], INSIDE)
    least = min(float(_slope(node, x, inside, way).min()) for way in ("rise", "fall"))
    return k + float(_slope(node, np.array(u0), np.array(value(node, "w0")), "rise")), k + least


def _slope(node: Node, x: Array, w: Array, way: str) -> Array:
    """Return dw/dx of a Duhem operator in one direction, in the shape of x and w."""
    a = node.value(f"a_{way}")
    b, c = (np.reshape(node.value(f"{key}_{way}"), (len(a), -1)) for key in "bc")
    val = np.polynomial.polynomial.polyval2d
    return np.polynomial.polynomial.polyval(x, a) + w * val(x, w, b) + np.abs(w) * val(x, w, c)
