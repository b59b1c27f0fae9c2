"""Elements of an SSP archive: parameter sets (SSV) with types, and connections without unit conversion.

Readers convert between the units of measure of two connectors (SSP 1.0, section 4.5.2) unless the connection suppresses
the conversion. HystFMU does not convert. Therefore a connection that needs a conversion is an InputError.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Container, Mapping
from typing import Any

from hystfmu.base.errors import InputError
from hystfmu.fmu.archive import xml_file
from hystfmu.fmu.foreign.instance import REAL, Finding, carried
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Part

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
SetValue = float | int | bool | str
_WORDS = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}
_NO_XML = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")


def changes(part: Part, where: str) -> dict[str, SetValue]:
    """Return the parameters and constant inputs of a unit that differ from the start values of its FMU.

    Start values of a foreign FMU cannot be changed. The start values of own FMUs are written directly, so that an own
    FMU has no such parameters. A value that a parameter set cannot contain is an InputError.
    """
    if not isinstance(part.graph, Foreign):
        return {}
    variables = {v.name: v for v in part.graph.description.modelVariables}
    found = {n: _typed(f"{where}: {part.name}", variables[n], v) for n, v in part.graph.settings.items()}
    for p in part.graph.ports:
        for n, start in zip(p.scalar_names, p.start, strict=True):
            if float(part.constants.get(n, start)).hex() != float(start).hex():  # -0.0 is not 0.0
                found[n] = _typed(f"{where}: {part.name}", p.variable, part.constants[n] if p.size == 1 else [])
    return found


def _typed(unit: str, v: Any, value: Any) -> SetValue:
    """Convert a value to the type of its variable: a float, an int of 32 bits, a bool or a str."""
    if isinstance(value, list):
        raise InputError(f"{unit}.{v.name}: the value of an array has no place in an SSP")
    if isinstance(value, str):
        if _NO_XML.search(value):
            raise InputError(f"{unit}.{v.name}: {value!r} has no place in an SSP: XML has no such characters")
        return value
    try:
        number = carried(v, value)
    except Finding as e:
        raise InputError(f"{unit}.{e}") from None
    if v.type == "Boolean":
        return bool(number)
    if v.type in REAL or not -(2**31) <= number < 2**31:  # an Integer of SSP has 32 bits
        if not math.isfinite(number) or float(number) != number:
            raise InputError(f"{unit}.{v.name}: {number} has no place in an SSP: no Integer and no Real holds it")
        return float(number)
    return int(number)


def parameter_set(name: str, values: Mapping[str, SetValue], version: str) -> bytes:
    """Return the file of a parameter set."""
    root = ET.Element(f"{{{SSV}}}ParameterSet", name=name, version=version)
    listed = ET.SubElement(root, f"{{{SSV}}}Parameters")
    for key, value in values.items():
        kind, text = _WORDS[type(value)], str(value).lower() if isinstance(value, bool) else str(value)
        ET.SubElement(ET.SubElement(listed, f"{{{SSV}}}Parameter", name=key), f"{{{SSV}}}{kind}", value=text)
    return xml_file(root)


_EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_Wrong = Callable[[str], InputError]
_End = tuple[str | None, str | None]


def connections(root: ET.Element, system: ET.Element, units: Container[str | None], wrong: _Wrong) -> dict[str, str]:
    """Return the output that drives each connected input, as `unit.connector`.

    `units` contains the names of the components. `wrong` converts a sentence to an error. An error is raised for a
    connection without a connector, with a transformation or a unit conversion, or to a connected input.
    """
    found: dict[str, str] = {}
    kinds: dict[_End, str | None] = {}
    measures: dict[_End, str | None] = {}
    for e in system.iter(f"{{{SSD}}}Component"):
        for c in e.iter(f"{{{SSD}}}Connector"):
            kinds[e.get("name"), c.get("name")] = c.get("kind")
            measures[e.get("name"), c.get("name")] = next((x.get("unit") for x in c if x.get("unit")), None)
    wires = system.find(f"{{{SSD}}}Connections")
    for c in wires if wires is not None else ():
        a, b = ((c.get(f"{side}Element"), c.get(f"{side}Connector")) for side in ("start", "end"))
        if a[0] is None or b[0] is None:
            continue  # a connector of the system: nothing is outside
        if len(c):
            raise wrong(f"connection of {a[0]}.{a[1]}: transformations are not read")
        for end in (a, b):
            if end[0] not in units or end not in kinds:
                raise wrong(f"a connection names {end[0]}.{end[1]}, which does not exist")
        if kinds[a] == "input" and kinds[b] == "output":
            a, b = b, a  # a connection has no direction
        to, of = f"{b[0]}.{b[1]}", f"{a[0]}.{a[1]}"
        if found.get(to, of) != of:
            raise wrong(f"{to} is connected twice, with {found[to]} and with {of}")
        one, other = measures[a], measures[b]
        if one != other and c.get("suppressUnitConversion") not in ("true", "1") and not _same(root, one, other):
            raise wrong(
                f"connection of {of} ({one}) with {to} ({other}): units of measure are not converted. Give both ends "
                'one unit, or suppressUnitConversion="true".'
            )
        found[to] = of
    return found


def _same(root: ET.Element, one: str | None, other: str | None) -> bool:
    """Return whether a number has the same meaning in two units. A missing unit equals the unit of the other end."""
    meanings = [_meaning(root, unit) for unit in (one, other)]
    plain = ((0,) * len(_EXPONENTS), 1.0, 0.0)
    return None in (one, other) or plain in meanings or (meanings[0] is not None and meanings[0] == meanings[1])


def _meaning(root: ET.Element, unit: str | None) -> tuple[tuple[int, ...], float, float] | None:
    """Return exponents of the base units, factor and offset; None for an undefined unit."""
    for u in root.iter(f"{{{SSC}}}Unit"):
        base = u.find(f"{{{SSC}}}BaseUnit")
        if u.get("name") == unit and base is not None:
            try:
                powers = tuple(int(base.get(n, "0")) for n in _EXPONENTS)
                return powers, float(base.get("factor", "1")), float(base.get("offset", "0"))
            except ValueError:
                return None
    return None
