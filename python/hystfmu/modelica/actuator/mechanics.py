"""Stiffness, capacitance, mass and damping of an actuator: from a data sheet, from an identified mode, or not at all.

An actuator without a known mode has no mass. With a known mode, mass and damping are computed for small vibrations
about the initial voltage, where plays do not move and an operator has its slope after a reversal. The position is then
the linear response

    K(s) x = F,   K = k/(1 + k sigma d/(1 + s tau + R sigma s/(d (1 + s R C0)))),

sigma (m/V) the slope, d (m/C) the stroke of a charge, C0 the capacitance that does not move.  m s^2 + c s + K(s) = 0 at
the poles of the mode gives m and c.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.modelica.actuator.sheet import Sheet

# Where no sheet says them.  Square of the coupling factor: d33^2/(s33 eps33), IEEE Std 176-1987, of the soft ceramic
# PIC255 (PI Ceramic, Piezo Material Data: 400e-12 m/V, 20.7e-12 m2/N, 1750 eps0; its measured k33 of 0.69 gives 0.48).
# Stiffness in short circuit, N/m: of the size of a stack of 5 x 5 x 36 mm; A/(s33 L) is 3.4e7 for the bare ceramic.
STIFFNESS, COUPLING, DAMPING = 2e7, 0.5, 0.02
KNOWN = 0.1  # greatest relative standard error of a frequency or damping ratio that counts
RESISTANCE, TAU = 1.0, 1e-5  # ohm, s: leads and relaxation, the defaults of the class
SETTLING = 1e4  # Hz: without a mass, the damping of the ceramic settles within some 0.1 ms


@dataclass(frozen=True)
class Mode:
    """Data on the mode of a model.

    Attributes
    ----------
    f_n, zeta : float or None
        Natural frequency (Hz) and damping ratio; None where they are not known.
    why : str
        Text on the known values, or the reason why there are none.
    """

    f_n: float | None
    zeta: float | None
    why: str

    @classmethod
    def of(cls, found: Mapping[str, Any]) -> Mode:
        """The mode of `Model.fit`."""
        if "f_n" not in found:
            return cls(None, None, "the model has no mode")
        f_n, zeta = float(found["f_n"]), float(found["zeta"])
        if "f_n_se" not in found:
            why = f"f_n = {f_n:.4g} Hz is at a bound of its search, or the model does not say how well it is known"
            return cls(None, None, why)
        error = float(found["f_n_se"]) / f_n
        if not error < KNOWN:
            return cls(None, None, f"f_n = {f_n:.4g} Hz is known to {100 * error:.2g} % only (standard error)")
        damped = float(found.get("zeta_se", math.inf)) / zeta < KNOWN
        return cls(f_n, zeta if damped else None, f"f_n = {f_n:.4g} Hz, standard error {100 * error:.2g} %")


@dataclass(frozen=True)
class Mechanics:
    """Parameters of `HystFMU.Actuators.BaseClasses.Piezo`, in SI units, with the origin of each.

    `m` and `f_n` are None without a moving mass; `lowest` (Hz) is the resonance where the polarisation follows the
    force as it follows the voltage over the whole range.
    """

    v_max: float
    stroke: float
    C: float
    k: float
    m: float | None
    c: float
    share: float
    resistance: float
    tau: float
    f_n: float | None
    lowest: float | None
    told: tuple[str, ...]


def mechanics(sheet: Sheet, v_max: float, stroke: float, slope: float, mode: Mode) -> Mechanics:
    """Return the parameters of an actuator.

    Parameters
    ----------
    sheet : Sheet
        Data sheet; its resonance has priority over an identified one.
    v_max, stroke : float
        Range of voltage (V) of the identified model, and its stroke (m) over it.
    slope : float
        Its slope (m/V) for small vibrations about the initial voltage.
    mode : Mode
        Identified mode.

    Raises
    ------
    InputError
        The stack would produce more work than it receives.
    """
    told = []
    if sheet.stroke is None or sheet.blocking_force is None:
        k_short = STIFFNESS
        told.append(
            f"stiffness assumed, {k_short:g} N/m in short circuit, of the size of a stack of 5 x 5 x 36 mm: give "
            "stroke and blocking_force of its data sheet"
        )
    else:
        k_short = sheet.blocking_force / sheet.stroke
        told.append(f"stiffness from the data sheet, {k_short:.3g} N/m in short circuit")
    work = stroke**2 * k_short / v_max**2  # F; a coupling of 1 if it were the capacitance
    if sheet.capacitance is None:
        C = work / COUPLING
        told.append(
            f"capacitance assumed, {C:.2g} F, which makes the square of the coupling factor {COUPLING}, as d33, s33 "
            "and eps33 of PIC255 do: give capacitance of its data sheet"
        )
    else:
        C = sheet.capacitance * sheet.capacitance_ratio
        told.append(f"capacitance from the data sheet, {C:.3g} F as the mean over the range")
    coupling = work / C
    if not coupling < 1:
        raise InputError(
            f"The capacitance of the data sheet times capacitance_ratio must exceed {work:.3g} F, else stroke and "
            f"blocking force are more work than the voltage supplies. Got {C:.3g} F instead."
        )
    share = 0.9 + 0.1 * coupling
    k = k_short / (1 - coupling / share)
    f_n = sheet.resonance or mode.f_n
    if f_n is None:
        told.insert(0, f"no mass, because {mode.why}: give resonance of its data sheet")
        w = 2 * math.pi * SETTLING
        c = 2 * DAMPING * k_short / w
        return Mechanics(v_max, stroke, C, k, None, c, share, RESISTANCE, TAU, None, None, tuple(told))
    zeta = sheet.damping or (None if sheet.resonance else mode.zeta)
    source = f"the data sheet, resonance {f_n:.4g} Hz" if sheet.resonance else f"the identified mode, {mode.why}"
    damped = f"damping ratio {zeta:.3g}" if zeta else f"damping ratio assumed, {DAMPING:g}"
    c0, small = (1 - share) * C, _Small(k, slope, stroke / (share * C * v_max))
    m, c, speed = small.mass(f_n, zeta or DAMPING, c0)
    told.insert(0, f"mass {m:.3g} kg and damping from {source}, {damped}")
    lowest = math.sqrt(k_short / m) / (2 * math.pi)
    return Mechanics(v_max, stroke, C, k, m, c, share, RESISTANCE / speed, TAU / speed, f_n, lowest, tuple(told))


@dataclass(frozen=True)
class _Small:
    """An element that vibrates a little: stiffness k (N/m), slope (m/V), stroke d (m/C) of a charge."""

    k: float
    slope: float
    d: float

    def stiffness(self, s: complex, resistance: float, tau: float, c0: float) -> complex:
        """Force of a unit of position, at the complex frequency s (1/s)."""
        leads = resistance * self.slope * s / (self.d * (1 + s * resistance * c0))
        return self.k / (1 + self.k * self.slope * self.d / (1 + s * tau + leads))

    def mass(self, f_n: float, zeta: float, c0: float) -> tuple[float, float, float]:
        """Mass, damping, and the factor by which the circuit must be faster than its default so that the damping can be
        set."""
        w = 2 * math.pi * f_n
        root = cmath.sqrt(zeta**2 - 1)
        poles = (w * (-zeta + root), w * (-zeta - root))
        speed = 1.0
        while True:
            rows = np.array([[s * s, s] for s in poles])
            right = [-self.stiffness(s, RESISTANCE / speed, TAU / speed, c0) for s in poles]
            m, c = (float(x.real) for x in np.linalg.solve(rows, np.array(right)))
            if c > zeta * m * w or speed > 1e6:
                return m, c, speed
            speed *= 2
