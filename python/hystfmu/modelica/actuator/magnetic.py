"""Slot of a sum of a field, its Jiles-Atherton magnetisation, and the square of the magnetisation."""

from __future__ import annotations

import math

from hystfmu.graph import Graph
from hystfmu.modelica.actuator.slot import Slot, left_out, value
from hystfmu.modelica.literals import number

REACH = 3.0  # greatest scaled field of a fit: the half range, and a bias of twice that
BEHIND = ("transfer_function", "delay", "scaling")


def magnetic(graph: Graph) -> Slot | None:
    """Return the slot of a scaling, a Jiles-Atherton operator, and a sum of field, magnetisation and its square."""
    nodes = {n.name: n for n in graph.nodes}
    if [n.type for n in graph.nodes][:2] != ["scaling", "jiles_atherton"]:
        return None
    total = next((n for n in graph.nodes if n.type == "sum"), None)
    if total is None:
        return None
    first, operator = graph.nodes[:2]
    squares = [n for n in graph.nodes if n.type == "product"]
    behind = list(graph.nodes[graph.nodes.index(total) + 1 :])
    places = iter(BEHIND)
    if len(squares) > 1 or not all(n.type in places for n in behind):
        return None
    parts = [f"{first.name}.y", f"{operator.name}.y", *(f"{n.name}.y" for n in squares)]
    wires = {f"{total.name}.u[{i + 1}]": part for i, part in enumerate(parts)}
    wires |= {f"{operator.name}.u": parts[0], **{f"{n.name}.u[{i}]": parts[1] for n in squares for i in (1, 2)}}
    chain = [total, *behind]
    wires |= {f"{b.name}.u": f"{a.name}.y" for a, b in zip(chain, behind, strict=False)}
    if {(a, b) for b, a in wires.items()} != set(graph.wires) or len(nodes) != 3 + len(squares) + len(behind):
        return None
    Ms, a, k, c, alpha = (value(operator, key) for key in ("Ms", "a", "k", "c", "alpha"))
    w0, w, w2 = (*(float(x) for x in total.value("k")), 0.0)[:3]
    w, w2, alpha = w * Ms, w2 * Ms**2, alpha * Ms
    at = {n.type: n for n in behind}
    scale = value(at["scaling"], "gain") if "scaling" in at else 1.0
    if dynamics := at.get("transfer_function"):
        scale *= float(dynamics.value("b")[-1] / dynamics.value("a")[-1])
    least = c / a * _langevin_slope((REACH + abs(alpha)) / a)
    least = w0 + (w - 2 * abs(w2)) * least / (1 - alpha * least)
    values = {"a": a, "k": k, "c": c, "alpha": alpha, "w0": w0, "w": w, "w2": w2, "m_start": value(operator, "m0") / Ms}
    offset = scale * value(total, "offset") + (value(at["scaling"], "offset") if "scaling" in at else 0.0)
    return Slot(
        "JilesAtherton",
        {name: number(x) for name, x in values.items()},
        value(operator, "u0"),
        value(first, "gain"),
        value(first, "offset"),
        scale,
        offset,
        [left_out(at["delay"])] if "delay" in at else [],
        w0 + w * c / (3 * a),
        least if w > 2 * abs(w2) else w - 2 * abs(w2),
    )


def _langevin_slope(h: float) -> float:
    return 1 / h**2 - 1 / math.sinh(min(h, 300.0)) ** 2
