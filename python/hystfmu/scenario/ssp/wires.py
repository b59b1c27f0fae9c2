"""Connections of an SSP archive: source of each input, and check that both ends have the same unit of measure.

Readers convert between the units of measure of two connectors (SSP 1.0, section 4.5.2) unless the connection suppresses
it. HystFMU does not convert, so a connection that needs a conversion is refused.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Container

from hystfmu.base.errors import InputError
from hystfmu.scenario.ssp.write import SSC, SSD

_EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_Wrong = Callable[[str], InputError]
_End = tuple[str | None, str | None]


def connections(root: ET.Element, system: ET.Element, units: Container[str | None], wrong: _Wrong) -> dict[str, str]:
    """Return the output that drives each connected input, as `unit.connector`.

    Parameters
    ----------
    root, system : Element
        The description, and its system.
    units : container of str
        Names of the components.
    wrong : function
        Converts a sentence to an error.

    Raises
    ------
    InputError
        A connection without a connector, with a transformation or a conversion of units, or to an input that is already
        connected.
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
    """Return whether a number means the same in both units; a missing unit counts as that of the other end."""
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
