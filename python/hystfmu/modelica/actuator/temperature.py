"""Slot of a chain whose bend depends on a temperature, as in models of the kind actuator."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from hystfmu.graph import Graph, Node, Output
from hystfmu.modelica.actuator.chain import chain
from hystfmu.modelica.actuator.slot import Slot, value, zones
from hystfmu.modelica.literals import number
from hystfmu.modelica.measures import si, to_si

CHANGE = ("gm", "gb0", "gknots", "gb")


def temperatures(graph: Graph) -> bool:
    """Return whether there is one input, or one input and a temperature."""
    return all(si(p.unit)[0] == "K" for p in graph.inputs[1:]) and 1 <= len(graph.inputs) <= 2


def warm(graph: Graph) -> Slot | None:
    """Return the slot of a chain whose bend depends on its second input, a temperature."""
    if len(graph.inputs) != 2 or not temperatures(graph):
        return None
    T = graph.inputs[1]
    nodes = {n.name: n for n in graph.nodes}
    beside = [
        n for n in graph.nodes if n.name in ("covariates", "gain", "scheduled", "following") or _follows(n, T.name)
    ]
    kept = [n for n in graph.nodes if n not in beside]
    if not {"covariates", "following", "bend"} <= set(nodes) or T.to != ("covariates.u[1]",):
        return None
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(kept)]
    found = chain(Graph(kept, wires, graph.inputs[:1], [Output("y", f"{kept[-1].name}.y")]))
    if found is None:
        return None
    scaled, total = nodes["covariates"], nodes["following"].value("k")
    gain, shift, lo, hi = (value(scaled, k) for k in ("gain", "offset", "lo", "hi"))
    g = float(nodes["gain"].value("k")[0]) if "gain" in nodes else 0.0
    at_0 = g * zones(nodes["bend"], CHANGE)[1] + float(total[1])
    values: dict[str, str] = {}
    if bend := nodes.get(f"bend_{T.name}"):
        values, more = zones(bend, CHANGE)
        at_0 += more
    degrees = {"T_middle": -shift / gain, "T_min": lo, "T_max": hi}
    values |= {k: number(to_si(x, T.unit)) for k, x in degrees.items()}
    values |= {"T_gain": number(gain / si(T.unit)[1]), "g": number(g), "g0": number(at_0)}
    return replace(found, values=found.values | values)


def _follows(node: Node, name: str) -> bool:
    return node.name in (f"bend_{name}", f"times_{name}")
