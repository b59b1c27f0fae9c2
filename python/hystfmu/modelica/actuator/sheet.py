"""Values of the data sheet of an actuator, and those derived from them: stiffness, mass, damping, coupling."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

from hystfmu.base.errors import InputError

# Where no sheet says them.  Square of the coupling factor: d33^2/(s33 eps33), IEEE Std 176-1987, of the soft ceramic
# PIC255 (PI Ceramic, Piezo Material Data: 400e-12 m/V, 20.7e-12 m2/N, 1750 eps0; its measured k33 of 0.69 gives 0.48).
# Stiffness in short circuit, N/m: of the size of a stack of 5 x 5 x 36 mm; A/(s33 L) is 3.4e7 for the bare ceramic.
STIFFNESS, COUPLING = 2e7, 0.5


@dataclass(frozen=True)
class Sheet:
    """Values of a data sheet in SI units; None: not said.

    Attributes
    ----------
    stroke : float or None
        Free stroke (m) over the range in which the blocking force counts.
    blocking_force : float or None
        Force (N) that holds it back.
    capacitance : float or None
        Small-signal capacitance (F).
    capacitance_ratio : float
        Mean capacitance over the range in parts of the small-signal one. A stack of 38 um, 900 N and 3.1 uF at 120 V,
        the default of the class DataSheet, has the coupling of its ceramic, 0.69 squared, with the default of 1.6.
    resonance : float or None
        Resonance (Hz) without load, one end held.
    damping : float
        Damping ratio there.
    """

    stroke: float | None = None
    blocking_force: float | None = None
    capacitance: float | None = None
    capacitance_ratio: float = 1.6
    resonance: float | None = None
    damping: float = 0.02

    @classmethod
    def of(cls, values: Mapping[str, object]) -> Sheet:
        """The sheet of some values by name.

        Raises
        ------
        InputError
            An unknown name, a value that is no positive number, or a stroke without its blocking force.
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


@dataclass(frozen=True)
class Mechanics:
    """Parameters of `HystFMU.Actuators.BaseClasses.Piezo`, in SI units; `f_n` is None without a moving mass."""

    v_max: float
    stroke: float
    C: float
    k: float
    m: float
    c: float
    share: float
    f_n: float | None


def mechanics(sheet: Sheet, v_max: float, stroke: float, f_n: float | None, zeta: float | None) -> Mechanics:
    """Return the parameters of an actuator.

    Parameters
    ----------
    sheet : Sheet
        Data sheet.
    v_max, stroke : float
        Range of voltage (V) of the identified model, and its stroke (m) over it.
    f_n, zeta : float or None
        Identified dynamics; None: those of the sheet.

    Raises
    ------
    InputError
        The stack would give more work than it takes.
    """
    k_short = STIFFNESS if sheet.stroke is None or sheet.blocking_force is None else sheet.blocking_force / sheet.stroke
    work = stroke**2 * k_short / v_max**2  # F; a coupling of 1 if it were the capacitance
    C = work / COUPLING if sheet.capacitance is None else sheet.capacitance * sheet.capacitance_ratio
    coupling = work / C
    if not coupling < 1:
        raise InputError(
            f"The capacitance of the data sheet times capacitance_ratio must exceed {work:.3g} F, else stroke and "
            f"blocking force are more work than the voltage supplies. Got {C:.3g} F instead."
        )
    share = 0.9 + 0.1 * coupling
    f, damping = f_n or sheet.resonance, sheet.damping if zeta is None else zeta
    w = 2 * math.pi * (f or 1e4)  # without a mass, the damping of the ceramic settles within some 0.1 ms
    k = k_short / (1 - coupling / share)
    return Mechanics(v_max, stroke, C, k, k_short / w**2, 2 * damping * k_short / w, share, f)
