"""Units of measure of an exported block. The ports are in SI units, the components in units of the data."""

from __future__ import annotations

import math

# SI unit and factor of each unit of measure of data; an unknown unit appears only in the description of a port
_SI = {
    **{u: (u, 1.0) for u in ("m", "V", "A", "A/m", "V/m", "N", "Pa", "T", "rad", "K", "Hz", "C", "s")},
    **{"mm": ("m", 1e-3), "um": ("m", 1e-6), "nm": ("m", 1e-9), "pm": ("m", 1e-12), "cm": ("m", 1e-2)},
    **{"mV": ("V", 1e-3), "kV": ("V", 1e3), "mA": ("A", 1e-3)},
    **{"kA/m": ("A/m", 1e3), "Oe": ("A/m", 250 / math.pi)},
    **{"kV/mm": ("V/m", 1e6), "kV/cm": ("V/m", 1e5)},
    **{"mN": ("N", 1e-3), "kN": ("N", 1e3), "MPa": ("Pa", 1e6), "mT": ("T", 1e-3)},
    **{"mrad": ("rad", 1e-3), "urad": ("rad", 1e-6), "deg": ("rad", math.pi / 180)},
    **{"kHz": ("Hz", 1e3), "ms": ("s", 1e-3)},
    "degC": ("K", 1.0),
}
_ZERO = {"degC": 273.15}  # SI value of 0 in the unit of measure


def si(unit: str) -> tuple[str, float]:
    """Return SI unit and conversion factor of a unit of measure; ("", 1.0) for a pure number or an unknown unit.

    >>> si("um")
    ('m', 1e-06)
    """
    return _SI.get(unit, ("", 1.0))


def zero(unit: str) -> float:
    """Return the SI value of 0 in a unit of measure.

    >>> zero("degC")
    273.15
    """
    return _ZERO.get(unit, 0.0)


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
