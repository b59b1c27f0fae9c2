"""Units of measure of connected variables in an SSP archive, which must not need a conversion."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hystfmu.fmu.foreign.instance import unit_of

SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
_EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_KEYS = (*_EXPONENTS, "factor", "offset")
_Meaning = tuple[tuple[int, ...], float, float]  # exponents of the base units, factor, offset
_PLAIN: _Meaning = ((0,) * len(_EXPONENTS), 1.0, 0.0)


@dataclass(frozen=True)
class Unit:
    """A unit of measure; its meaning is None if no file defines it."""

    name: str
    meaning: _Meaning | None


Measure = Unit | None
"""Unit of measure of an end of a connection, or None."""


def stated(root: ET.Element, name: str | None) -> Measure:
    """Return a unit of measure by its name in a system structure; `root` contains its definition."""
    if name is None:
        return None
    bases = (u.find(f"{{{SSC}}}BaseUnit") for u in root.iter(f"{{{SSC}}}Unit") if u.get("name") == name)
    base = next((b for b in bases if b is not None), None)
    return Unit(name, None if base is None else _meaning(base.attrib))


def declared(description: Any, variable: Any) -> Measure:
    """Return the unit of measure of a variable in the model description of its FMU."""
    name = unit_of(variable)
    if not name:
        return None
    base = next((u.baseUnit for u in description.unitDefinitions if u.name == name), None)
    return Unit(name, None if base is None else _meaning({k: getattr(base, k) for k in _KEYS}))


def _meaning(base: Mapping[str, str | float]) -> _Meaning | None:
    """Return the meaning of the attributes of a base unit; None if an attribute is no number."""
    try:
        powers = tuple(int(base.get(n, 0)) for n in _EXPONENTS)
        return powers, float(base.get("factor", 1)), float(base.get("offset", 0))
    except ValueError:
        return None


def same(one: Unit, other: Unit) -> bool:
    """Return whether two units of measure are equal. A pure number equals any other unit."""
    meanings = one.meaning, other.meaning
    return _PLAIN in meanings or (one.meaning is not None and one.meaning == other.meaning)


def converts(one: Unit, other: Unit) -> bool:
    """Return whether a simulator converts between two units of measure, because both are defined and differ."""
    return one.name != other.name and None not in (one.meaning, other.meaning) and not same(one, other)


def not_converted(of: str, one: Unit, to: str, other: Unit) -> str:
    """Return the text of an error for a connection that needs a conversion."""
    return (
        f"connection of {of} ({one.name}) with {to} ({other.name}): units of measure are not converted. Give both ends "
        'one unit, or suppressUnitConversion="true".'
    )
