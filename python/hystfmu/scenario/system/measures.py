"""Units of measure for reports. They come from C tables, models and FMUs, and propagate along the connections.

Two signals have the same unit of measure if they are connected, if a metric subtracts them, or if a block passes them
without scaling. If one signal states its unit of measure, the unit of measure applies to all these signals.
"""

from __future__ import annotations

from collections.abc import Iterator

from hystfmu.graph import Graph
from hystfmu.scenario.system.case import split_end
from hystfmu.scenario.system.spec import MetricSpec
from hystfmu.scenario.system.system import Part, System

SUBTRACTED = ("rms_percent", "max_percent", "between_samples_percent", "rms")  # kinds of `signal` - `against`
OF_SIGNAL = ("peak", "final", "rms")  # kinds in the unit of measure of `signal`
PASSED_ON = ("delay", "quantiser", "sum")  # blocks whose output is their input, late, rounded, or added up


def unit_of(system: System, end: str) -> str:
    """Return the unit of measure of `unit.output`, `unit.input` or `unit.parameter`.

    The result is empty if no unit of measure is stated, or if signals with a common unit of measure state different
    ones. "1" in a table means the unit of measure of the data; it is not a statement.
    """
    own = _stated(system, end)
    if own:
        return own
    found = {unit for other in _same_quantity(system, end) if (unit := _stated(system, other))}
    return found.pop() if len(found) == 1 else ""


def _stated(system: System, end: str) -> str:
    name, variable = split_end(end, "unit_of")
    for part in system.parts:
        for port in part.graph.ports if part.name == name else ():
            if variable == port.name or variable in port.scalar_names:
                return "" if port.unit == "1" else port.unit
    return ""


def _same_quantity(system: System, end: str) -> set[str]:
    """Return the signals with the same unit of measure as `end`, including `end`."""
    beside: dict[str, list[str]] = {}
    for a, b in _pairs(system):
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    found, open_ends = {end}, [end]
    while open_ends:
        new = set(beside.get(open_ends.pop(), ())) - found
        found |= new
        open_ends += new
    return found


def _pairs(system: System) -> Iterator[tuple[str, str]]:
    names = system.names
    for link in system.links:
        to = system.parts[link.to]
        yield names[link.source], f"{to.name}.{to.inputs[link.input]}"
    for m in system.case.metrics.values():
        if m.kind in SUBTRACTED and m.against is not None:
            yield m.signal, m.against
    for part in system.parts:
        yield from ((f"{part.name}.{a}", f"{part.name}.{b}") for a, b in _passed_on(part))


def _passed_on(part: Part) -> Iterator[tuple[str, str]]:
    """Yield inputs and outputs of a unit with one block that does not scale signals."""
    if not isinstance(part.graph, Graph) or len(part.graph.nodes) != 1 or part.graph.nodes[0].type not in PASSED_ON:
        return
    (node,) = part.graph.nodes
    weights = node.value("k").tolist() if "k" in node.sizes else [1.0] * len(part.inputs)
    for name, weight in zip(part.inputs, weights, strict=False):
        if abs(weight) == 1.0:
            yield from ((name, output) for output in part.outputs)


def unit_of_metric(system: System, m: MetricSpec) -> str:
    """Return percent, the unit of measure of the signal, or an empty text for a ratio."""
    if m.kind.endswith("_percent"):
        return "%"
    return unit_of(system, m.signal) if m.kind in OF_SIGNAL else ""


def label(name: str, unit: str) -> str:
    """Return a name with its unit of measure, if there is one, for a table or an axis."""
    return f"{name} in {unit}" if unit else name
