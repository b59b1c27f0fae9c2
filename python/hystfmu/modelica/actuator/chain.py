"""Slot of a chain: scaling, plays or relays, bend, creep, dynamics, readout."""

from __future__ import annotations

from hystfmu.graph import Graph, Node
from hystfmu.modelica import classes
from hystfmu.modelica.actuator.slot import Slot, lags, left_out, limits, numbers, value, zones
from hystfmu.modelica.literals import number

OPERATORS = ("prandtl_ishlinskii", "preisach")
BEHIND = ("dead_zones", "creep", "transfer_function", "delay", "scaling")
BEND, CREEP = ("m", "b0", "knots", "b"), ("lags", "creep", "T")


def chain(graph: Graph) -> Slot | None:
    """Return the slot of a chain: blocks in this order, each at most once; only the operator is required."""
    nodes = list(graph.nodes)
    first = nodes.pop(0) if nodes[0].type == "scaling" else None
    types = [n.type for n in nodes]
    places = iter(BEHIND)
    if not nodes or types[0] not in OPERATORS or not all(t in places for t in types[1:]):
        return None
    if len(graph.wires) != len(graph.nodes) - 1:
        return None
    at = dict(zip(types, nodes, strict=True))
    name, values, rest, offset = _operator(nodes[0])
    gain, at_0 = 1.0, 0.0
    if g0 := at.get("transfer_function"):
        gain *= float(g0.value("b")[-1] / g0.value("a")[-1])
    bend, creep, readout = (at.get(k) for k in ("dead_zones", "creep", "scaling"))
    if bend is not None and offset:
        return None
    if bend is not None:
        more, at_0 = zones(bend, BEND)
        values |= more
    if creep is not None:
        direct = value(creep, "w0")
        if not direct:
            return None
        values |= lags(creep, CREEP, 1 / direct)[0]
        gain *= direct
        at_0, offset = ((1 + float(creep.value("w").sum()) / direct) * x for x in (at_0, offset))
    if name == "PrandtlIshlinskii" and (bend is not None or creep is not None):
        name = "BentPrandtlIshlinskii"
        values = {"m": "1", "b0": "1.0", "knots": "{1.0}", "b": "{0.0}"} | values
    if readout is not None:
        gain *= value(readout, "gain")
    return Slot(
        name,
        values,
        rest,
        value(first, "gain") if first else 1.0,
        value(first, "offset") if first else 0.0,
        gain,
        gain * (at_0 + offset) + (value(readout, "offset") if readout else 0.0),
        [left_out(at["delay"])] if "delay" in at else [],
    )


def _operator(node: Node) -> tuple[str, dict[str, str], float, float]:
    """Return the class, its values, the scaled voltage at which the memory is at rest, and the offset."""
    values = {"n": str(node.dims["n"])}
    if node.type == "prandtl_ishlinskii":
        values |= {"w0": number(value(node, "w0")), **numbers(node, "r", "w")}
        return "PrandtlIshlinskii", values, value(node, "u0"), 0.0
    return "Preisach", values | relays(node), rest_of_relays(node), value(node, "offset")


def relays(node: Node) -> dict[str, str]:
    """Return limits, Everett function and start of a Preisach operator."""
    return limits(node) | numbers(node, "E") | classes.choices(node)


def rest_of_relays(node: Node) -> float:
    """Return the input at which the memory of a Preisach operator is at rest."""
    lo, hi = value(node, "lo"), value(node, "hi")
    return {"low": lo, "high": hi}.get(classes.word(node, "start"), 0.5 * (lo + hi))
