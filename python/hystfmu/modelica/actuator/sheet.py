"""Values that a data sheet gives for an actuator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

from hystfmu.base.errors import InputError


@dataclass(frozen=True)
class Sheet:
    """Values of a data sheet in SI units; None if a value is not stated.

    Attributes
    ----------
    stroke : float or None
        Free stroke (m) over the voltage range of the blocking force.
    blocking_force : float or None
        Blocking force (N).
    capacitance : float or None
        Small-signal capacitance (F).
    capacitance_ratio : float
        Ratio of the mean capacitance over the range to the small-signal capacitance. The default is 1.6. With this
        ratio, a stack of 38 um, 900 N and 3.1 uF at 120 V, the default of the class DataSheet, has the squared coupling
        factor 0.69^2 of its ceramic.
    inductance : float or None
        Inductance (H) of the coil of a current-driven actuator without load, mean over the range.
    resistance : float or None
        Resistance (ohm) of this coil.
    resonance : float or None
        Resonance (Hz) without load, one end held.
    damping : float or None
        Damping ratio at this resonance.
    """

    stroke: float | None = None
    blocking_force: float | None = None
    capacitance: float | None = None
    capacitance_ratio: float = 1.6
    inductance: float | None = None
    resistance: float | None = None
    resonance: float | None = None
    damping: float | None = None

    @classmethod
    def of(cls, values: Mapping[str, object]) -> Sheet:
        """Return the sheet with these values, given by name.

        Raises
        ------
        InputError
            A name is unknown, a value is not a positive number, or a stroke has no blocking force.
        """
        names = [f.name for f in fields(cls)]
        for name, value in values.items():
            if name not in names:
                raise InputError(f"The data sheet has no value {name!r}. Its values are {', '.join(names)}.")
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not number or not 0 < float(value) < math.inf:  # type: ignore[arg-type]
                raise InputError(f"The {name!r} of a data sheet must be a float in (0, inf). Got {value!r} instead.")
        sheet = cls(**{k: float(v) for k, v in values.items()})  # type: ignore[arg-type]
        if (sheet.stroke is None) != (sheet.blocking_force is None):
            raise InputError("The data sheet must have both stroke and blocking_force, or neither.")
        return sheet
