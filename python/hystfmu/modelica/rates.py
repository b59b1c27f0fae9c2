"""Rates of the inputs of operators in a continuous realisation, from the rate of a port of the block."""

from __future__ import annotations

from collections.abc import Mapping

from hystfmu.modelica.layout import line, on_component, placed
from hystfmu.modelica.measures import per_second, si
from hystfmu.modelica.ports import RATE_PLACE, RATE_STEP, inner_rate, rate_name
from hystfmu.modelica.realisation import FACTOR, Rate
from hystfmu.modelica.record import field
from hystfmu.modelica.wiring import Wiring, unit_constant


def declarations(w: Wiring, rates: Mapping[str, Rate]) -> tuple[list[str], list[str]]:
    """Return the declarations and equations of the rates that operators need."""
    if not rates:
        return [], []
    where, low = w.where, min(y for _, y in w.where.of.values()) - 40
    needed = {port for rate in rates.values() for port, _ in rate.terms}
    ports = [p for p in w.graph.inputs if p.name in needed]
    declared, stated, inner = [], [], {}
    for k, p in enumerate(ports):
        name, unit = w.ports[p.name], si(p.unit)[0]
        at, outer = (30 + RATE_STEP * k - where.edge, low), (-where.edge, RATE_PLACE + RATE_STEP * k)
        inner[p.name] = inner_rate(name) + (f"/{unit_constant(name)}" if unit else "")
        declared.append(
            f'  HystFMU.Interfaces.RealInput {inner_rate(name)}(unit = "{per_second(unit)}") "Rate of {name}" '
            f"annotation ({placed(*at)});"
        )
        stated.append(f"  connect({rate_name(name)}, {inner_rate(name)}) {line(outer, at)};")
    for k, (node, rate) in enumerate(rates.items()):
        part = w.parts[node]
        here = (where.of[node][0], low - 30 * (k + 1))
        declared.append(
            f'  HystFMU.Interfaces.RealOutput {inner_rate(part)}(unit = "1/s") "Rate of the input of {part}" '
            f"annotation ({placed(*here)});"
        )
        first = w.graph.node(node).block.of("input")[0].name
        there = on_component((-110, -70), where.of[node])
        stated += [
            f"  {inner_rate(part)} = {_rate(w, rate, inner)};",
            f"  connect({inner_rate(part)}, {part}.{rate_name(first)}) {line(here, there)};",
        ]
    return declared, stated


def _rate(w: Wiring, rate: Rate, inner: Mapping[str, str]) -> str:
    """Return the rate after scalings and sums; beyond the limits of a scaling the rate is 0."""
    terms = []
    for port, through in rate.terms:
        found = inner[port]
        for node, index in reversed(through):
            k, u = f"values.{field(w.graph, node, FACTOR[node.type])}[{index}]", f"{w.parts[node.name]}.u[{index}]"
            limits, keys = [], {v.name for v in node.block.parameters}
            for key, relation, none in (("lo", ">", -1e300), ("hi", "<", 1e300)):
                if key in keys and node.value(key)[index - 1] != none:
                    limits.append(f"{u} {relation} values.{field(w.graph, node, key)}[{index}]")
            found = f"{k}*{found}" if not limits else f"(if {' and '.join(limits)} then {k}*{found} else 0)"
        terms.append(found)
    whole = " + ".join(terms)
    return f"noEvent({whole})" if " if " in f" {whole}".replace("(", " ") else whole
