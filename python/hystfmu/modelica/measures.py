"""Units of measure of an exported block. The ports are in SI units, the components in units of the data."""

from functools import cache

from hystfmu.fmu.write.measures import parsed

_NAMES = ("m", "V", "A", "A/m", "V/m", "N", "Pa", "T", "rad", "K", "Hz", "C", "s")  # SI units of ports


@cache
def _in_si(unit: str) -> tuple[str, float, float]:
    """Return the SI unit of a unit of measure, the conversion factor, and the SI value of 0."""
    for name in _NAMES:
        of, found = parsed(name), parsed(unit)
        if of is not None and found is not None and of.exponents == found.exponents:
            return name, found.factor, found.offset
    return "", 1.0, 0.0  # an unknown unit appears only in the description of a port


def si(unit: str) -> tuple[str, float]:
    """Return SI unit and conversion factor of a unit of measure; ("", 1.0) for a pure number or an unknown unit.

    >>> si("um")
    ('m', 1e-06)
    """
    return _in_si(unit)[:2]


def zero(unit: str) -> float:
    """Return the SI value of 0 in a unit of measure.

    >>> zero("degC")
    273.15
    """
    return _in_si(unit)[2]


def to_si(value: float, unit: str) -> float:
    """Return a value, given in a unit of measure, in SI units.

    >>> to_si(20, "degC")
    293.15
    """
    return value * si(unit)[1] + zero(unit)


def per_second(unit: str) -> str:
    """Return the unit of the time derivative of a signal, in the notation of Modelica."""
    if not unit:
        return "1/s"
    return unit.replace("/m", "/(m.s)") if "/" in unit else f"{unit}/s"
