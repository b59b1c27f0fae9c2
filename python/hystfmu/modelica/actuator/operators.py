"""Slot of one operator: Krasnosel'skii-Pokrovskii or Duhem."""

from __future__ import annotations

from hystfmu.graph import Graph
from hystfmu.modelica.actuator.slot import Slot, limits, numbers, value
from hystfmu.modelica.literals import number

DUHEM = ["scaling", "duhem", "scaling"]


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
    return Slot("Duhem", values, value(node, "u0"), gain, shift, scale, offset)
