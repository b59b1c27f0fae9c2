"""Parameters and constant inputs of a foreign FMU as a parameter set of an SSP archive (SSV), with their types."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Any

from hystfmu.base.errors import InputError
from hystfmu.fmu.archive.xml_file import xml_file
from hystfmu.fmu.foreign.carried import carried
from hystfmu.fmu.foreign.finding import Finding
from hystfmu.fmu.foreign.instance import REAL
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Part

SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
SetValue = float | int | bool | str
_WORDS = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}
_NO_XML = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")


def changes(part: Part, where: str) -> dict[str, SetValue]:
    """Return the parameters and constant inputs of a unit that differ from the start values of its FMU.

    Parameters
    ----------
    part : Part
        Start values of a foreign FMU cannot be changed; in own FMUs they are written directly, so nothing remains.
    where : str
        The case, for messages.

    Raises
    ------
    InputError
        A value that a parameter set cannot contain.
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
    """A value as the type of its variable: a float, an int of 32 bits, a bool or a str."""
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
