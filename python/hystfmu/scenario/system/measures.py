"""Units of what a report shows: outputs and parameters as the C tables or the model say them, metrics by their kind."""

from __future__ import annotations

from hystfmu.scenario.system.case import split_end
from hystfmu.scenario.system.spec import MetricSpec
from hystfmu.scenario.system.system import System


def unit_of(system: System, end: str) -> str:
    """Unit of `unit.output` or `unit.parameter`; empty where none is stated ("1" in a table: as in the data)."""
    name, variable = split_end(end, "unit_of")
    for part in system.parts:
        for port in part.graph.ports if part.name == name else ():
            if variable == port.name or variable in port.scalar_names:
                return "" if port.unit == "1" else port.unit
    return ""


def unit_of_metric(system: System, m: MetricSpec) -> str:
    """Percent, the unit of the signal, or empty for a ratio."""
    if m.kind.endswith("_percent"):
        return "%"
    return unit_of(system, m.signal) if m.kind in ("peak", "final") else ""


def label(name: str, unit: str) -> str:
    """A name with its unit, if there is one, for a table or an axis."""
    return f"{name} in {unit}" if unit else name
