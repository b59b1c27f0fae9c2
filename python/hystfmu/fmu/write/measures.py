"""UnitDefinitions of modelDescription.xml: conversion of units of measure to SI base units.

A unit of measure is written as a product of symbols with prefixes and exponents, such as `um/V` or `N.s/m2`.
"""

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass

from hystfmu.graph import Graph


@dataclass(frozen=True)
class UnitOfMeasure:
    """A unit of measure as exponents of the SI base units and a factor.

    The factor is `scale` times 10^`ten`, which represents decimal factors exactly.
    """

    exponents: dict[str, int]
    ten: int = 0
    scale: float = 1.0
    offset: float = 0.0

    def times(self, other: "UnitOfMeasure", n: int) -> "UnitOfMeasure":
        """Return the product of this unit and the n-th power of another unit."""
        both = {k: self.exponents.get(k, 0) + n * other.exponents.get(k, 0) for k in self.exponents | other.exponents}
        return UnitOfMeasure(both, self.ten + n * other.ten, self.scale * other.scale**n)

    @property
    def factor(self) -> float:
        """Factor of the conversion to SI base units."""
        return float(f"{self.scale!r}e{self.ten}")

    def attributes(self) -> dict[str, str]:
        """Return the attributes of the element BaseUnit."""
        found = {k: str(n) for k, n in self.exponents.items() if n}
        found |= {"factor": repr(self.factor)} if self.factor != 1.0 else {}
        return found | ({"offset": repr(self.offset)} if self.offset else {})


_PI = 3.141592653589793
_VOLT = {"kg": 1, "m": 2, "s": -3, "A": -1}
_SYMBOLS = {
    "1": UnitOfMeasure({}),
    "%": UnitOfMeasure({}, -2),
    **{name: UnitOfMeasure({name: 1}) for name in ("s", "m", "A", "K", "rad", "mol", "cd")},
    "g": UnitOfMeasure({"kg": 1}, -3),
    "min": UnitOfMeasure({"s": 1}, scale=60.0),
    "h": UnitOfMeasure({"s": 1}, scale=3600.0),
    "Hz": UnitOfMeasure({"s": -1}),
    "N": UnitOfMeasure({"kg": 1, "m": 1, "s": -2}),
    "Pa": UnitOfMeasure({"kg": 1, "m": -1, "s": -2}),
    "bar": UnitOfMeasure({"kg": 1, "m": -1, "s": -2}, 5),
    "J": UnitOfMeasure({"kg": 1, "m": 2, "s": -2}),
    "W": UnitOfMeasure({"kg": 1, "m": 2, "s": -3}),
    "V": UnitOfMeasure(_VOLT),
    "C": UnitOfMeasure({"A": 1, "s": 1}),
    "F": UnitOfMeasure({"kg": -1, "m": -2, "s": 4, "A": 2}),
    "Ohm": UnitOfMeasure({"kg": 1, "m": 2, "s": -3, "A": -2}),
    "H": UnitOfMeasure({"kg": 1, "m": 2, "s": -2, "A": -2}),
    "T": UnitOfMeasure({"kg": 1, "s": -2, "A": -1}),
    "G": UnitOfMeasure({"kg": 1, "s": -2, "A": -1}, -4),
    "Oe": UnitOfMeasure({"A": 1, "m": -1}, 3, 1 / (4 * _PI)),
    "deg": UnitOfMeasure({"rad": 1}, scale=_PI / 180),
    "degC": UnitOfMeasure({"K": 1}, offset=273.15),
}
_PREFIXES = {"p": -12, "n": -9, "u": -6, "m": -3, "c": -2, "k": 3, "M": 6, "G": 9}
_WHOLE = {"1", "%", "min", "h", "deg", "degC", "bar"}  # symbols that cannot have a prefix
_FACTOR = re.compile(r"(1|%|[A-Za-z]+)(-?[1-9])?\Z")


def _symbol(name: str) -> UnitOfMeasure | None:
    if name in _SYMBOLS:
        return _SYMBOLS[name]
    stem = _SYMBOLS.get(name[1:])
    if stem is None or name[0] not in _PREFIXES or name[1:] in _WHOLE:
        return None
    return UnitOfMeasure(stem.exponents, stem.ten + _PREFIXES[name[0]], stem.scale)


def parsed(unit: str) -> UnitOfMeasure | None:
    """Return the exponents and the factor of a unit of measure; None if the unit is not known."""
    if unit in _SYMBOLS:
        return _SYMBOLS[unit]
    made = UnitOfMeasure({})
    for k, part in enumerate(unit.split("/")):
        for word in part.split("."):
            matched = _FACTOR.match(word)
            found = _symbol(matched[1]) if matched else None
            if matched is None or found is None:
                return None
            made = made.times(found, int(matched[2] or 1) * (1 if k == 0 else -1))
    return made


def rate_unit(unit: str) -> str:
    """Return the unit of measure of the time derivative of a variable with a given unit."""
    known = {"1": "1/s", "s": "1", "m/s": "m/s2", "1/s": "1/s2"}
    return known.get(unit, f"{unit}/s")


def base_unit(unit: str) -> dict[str, str] | None:
    """Return the attributes of the element BaseUnit for a unit of measure; None if the unit is not known.

    Examples
    --------
    >>> from hystfmu.fmu.write.measures import base_unit
    >>> base_unit("um/V")
    {'m': '-1', 'kg': '-1', 's': '3', 'A': '1', 'factor': '1e-06'}
    """
    found = parsed(unit)
    return None if found is None else found.attributes()


def unit_definitions(graph: Graph) -> ET.Element:
    """Return the element UnitDefinitions with the units of all real variables, continuous states and derivatives."""
    states = graph.continuous_states
    units = {p.unit for p in graph.ports if p.unit and p.var.type == "real"} | {"s"} | {x.unit for x in states}
    definitions = ET.Element("UnitDefinitions")
    for name in sorted(units | {rate_unit(x.unit) for x in states}):
        unit = ET.SubElement(definitions, "Unit", name=name)
        if (attributes := base_unit(name)) is not None:
            ET.SubElement(unit, "BaseUnit", attributes)
    return definitions
