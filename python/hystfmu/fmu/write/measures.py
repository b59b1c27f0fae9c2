"""UnitDefinitions of modelDescription.xml: each unit of measure with its exponents of the SI base units."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from hystfmu.graph import Graph

# unit of measure: exponents of the SI base units, factor to SI
_UNITS: dict[str, tuple[dict[str, int], float]] = {
    "1": ({}, 1.0),
    "%": ({}, 0.01),
    "s": ({"s": 1}, 1.0),
    "ms": ({"s": 1}, 1e-3),
    "s2": ({"s": 2}, 1.0),
    "Hz": ({"s": -1}, 1.0),
    "kHz": ({"s": -1}, 1e3),
    "1/s": ({"s": -1}, 1.0),
    "1/s2": ({"s": -2}, 1.0),
    "rad": ({"rad": 1}, 1.0),
    "rad/s": ({"rad": 1, "s": -1}, 1.0),
    "m": ({"m": 1}, 1.0),
    "mm": ({"m": 1}, 1e-3),
    "um": ({"m": 1}, 1e-6),
    "nm": ({"m": 1}, 1e-9),
    "m/s": ({"m": 1, "s": -1}, 1.0),
    "m/s2": ({"m": 1, "s": -2}, 1.0),
    "1/m": ({"m": -1}, 1.0),
    "kg": ({"kg": 1}, 1.0),
    "N": ({"kg": 1, "m": 1, "s": -2}, 1.0),
    "N/m": ({"kg": 1, "s": -2}, 1.0),
    "N.s/m": ({"kg": 1, "s": -1}, 1.0),
    "Pa": ({"kg": 1, "m": -1, "s": -2}, 1.0),
    "A": ({"A": 1}, 1.0),
    "A/m": ({"A": 1, "m": -1}, 1.0),
    "T": ({"kg": 1, "s": -2, "A": -1}, 1.0),
    "V": ({"kg": 1, "m": 2, "s": -3, "A": -1}, 1.0),
    "mV": ({"kg": 1, "m": 2, "s": -3, "A": -1}, 1e-3),
    "kV": ({"kg": 1, "m": 2, "s": -3, "A": -1}, 1e3),
    "mA": ({"A": 1}, 1e-3),
    "kA/m": ({"A": 1, "m": -1}, 1e3),
    "mT": ({"kg": 1, "s": -2, "A": -1}, 1e-3),
    "mN": ({"kg": 1, "m": 1, "s": -2}, 1e-3),
    "pm": ({"m": 1}, 1e-12),
    "mrad": ({"rad": 1}, 1e-3),
    "V/m": ({"kg": 1, "m": 1, "s": -3, "A": -1}, 1.0),
    "um/V": ({"kg": -1, "m": -1, "s": 3, "A": 1}, 1e-6),
    "m/V": ({"kg": -1, "m": -1, "s": 3, "A": 1}, 1.0),
    "K": ({"K": 1}, 1.0),
}


def rate_unit(unit: str) -> str:
    """Return the unit of measure of a time derivative."""
    known = {"1": "1/s", "s": "1", "m/s": "m/s2", "1/s": "1/s2"}
    return known.get(unit, f"{unit}/s")


def base_unit(unit: str) -> dict[str, str] | None:
    """Return the attributes of `BaseUnit` of a unit of measure, None if it is not known."""
    if unit not in _UNITS:
        return None
    exponents, factor = _UNITS[unit]
    return {k: str(n) for k, n in exponents.items() if n} | ({"factor": repr(factor)} if factor != 1.0 else {})


def unit_definitions(graph: Graph) -> ET.Element:
    """Define the units of measure of all real variables, continuous states and derivatives."""
    states = graph.continuous_states
    units = {p.unit for p in graph.ports if p.unit and p.var.type == "real"} | {"s"} | {x.unit for x in states}
    rates = {rate_unit(x.unit): x.unit for x in states}
    definitions = ET.Element("UnitDefinitions")
    for name in sorted(units | set(rates)):
        unit = ET.SubElement(definitions, "Unit", name=name)
        of = name if name in _UNITS else rates.get(name)
        if of in _UNITS:
            exponents, factor = _UNITS[of]
            if of != name:
                exponents = {**exponents, "s": exponents.get("s", 0) - 1}
            attributes = {k: str(n) for k, n in exponents.items() if n}
            if factor != 1.0:
                attributes["factor"] = repr(factor)
            ET.SubElement(unit, "BaseUnit", attributes)
    return definitions
