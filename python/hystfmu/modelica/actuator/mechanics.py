"""Stiffness, capacitance, mass and damping of an actuator from a data sheet, a mode, or defaults.

An actuator without a known mode has no mass. With a known mode, mass and damping are computed for small vibrations
about the initial voltage. For these vibrations plays do not move, and an operator has its slope after a reversal. Then
the position is the linear response

    K(s) x = F,   K = k/(1 + k sigma d/(1 + s tau + R sigma s/(d (1 + s R C0)))),

where sigma (m/V) is the slope, d (m/C) is the stroke per charge, and C0 is the capacitance without motion. The equation
m s^2 + c s + K(s) = 0 at the poles of the mode gives m and c. For a rod sigma is in m/A and d in m/Wb, and R = 0
because the current is held.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.modelica.actuator.form import COUPLING, Form
from hystfmu.modelica.actuator.sheet import Sheet

DAMPING = 0.02  # where no sheet says it
KNOWN = 0.1  # greatest relative standard error of a frequency or damping ratio that counts
SETTLING = 1e4  # Hz: without a mass, the damping of the ceramic settles within some 0.1 ms


@dataclass(frozen=True)
class Mode:
    """Data on the mode of a model.

    Attributes
    ----------
    f_n, zeta : float or None
        Natural frequency (Hz) and damping ratio; None if they are not known.
    why : str
        Text about the known values, or the reason why they are not known.
    """

    f_n: float | None
    zeta: float | None
    why: str

    @classmethod
    def of(cls, found: Mapping[str, Any]) -> Mode:
        """Return the mode in `Model.fit`."""
        if "f_n" not in found:
            return cls(None, None, "the model has no mode")
        f_n, zeta = float(found["f_n"]), float(found["zeta"])
        if "f_n_se" not in found:
            why = f"f_n = {f_n:.4g} Hz is at a bound of its search, or the model does not state its standard error"
            return cls(None, None, why)
        error = float(found["f_n_se"]) / f_n
        if not error < KNOWN:
            return cls(None, None, f"f_n = {f_n:.4g} Hz is known to {100 * error:.2g} % only (standard error)")
        damped = float(found.get("zeta_se", math.inf)) / zeta < KNOWN
        return cls(f_n, zeta if damped else None, f"f_n = {f_n:.4g} Hz, standard error {100 * error:.2g} %")

    @property
    def lag(self) -> float | None:
        """Time constant (s) of the slower of two real poles; None if the poles are complex or not known."""
        if self.f_n is None or self.zeta is None or self.zeta < 1:
            return None
        return (self.zeta + math.sqrt(self.zeta**2 - 1)) / (2 * math.pi * self.f_n)


@dataclass(frozen=True)
class Mechanics:
    """Parameters of the base class of a form, in SI units, with the origin of each.

    `most` is the range of voltage or current. `C` is the capacitance or inductance. `m` and `f_n` are None without a
    moving mass. `lowest` (Hz) is the resonance if the material responds to the force with the slope over the whole
    range of the input.
    """

    most: float
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


def mechanics(form: Form, sheet: Sheet, most: float, stroke: float, slope: float, mode: Mode) -> Mechanics:
    """Return the parameters of an actuator.

    Parameters
    ----------
    form : Form
    sheet : Sheet
        Data sheet; its resonance has priority over an identified one.
    most, stroke : float
        Range of the input (V or A) of the identified model, and its stroke (m) over this range.
    slope : float
        Slope of the model (m/V or m/A) for small vibrations about the initial input.
    mode : Mode
        Identified mode.

    Raises
    ------
    InputError
        The actuator would produce more work than it receives, or the sheet has a value for the other form.
    """
    told = []
    for name, why in (("capacitance", "A"), ("inductance", "V"), ("resistance", "V")):
        if form.unit == why and getattr(sheet, name) is not None:
            raise InputError(f"The data sheet of an actuator that is driven by {why} has no value {name!r}.")
    if sheet.stroke is None or sheet.blocking_force is None:
        k_held = form.stiffness
        told.append(f"stiffness assumed, {k_held:g} N/m {form.size}: give stroke and blocking_force of its data sheet")
    else:
        k_held = sheet.blocking_force / sheet.stroke
        told.append(f"stiffness from the data sheet, {k_held:.3g} N/m {form.size.split(',')[0]}")
    work = stroke**2 * k_held / most**2  # F or H; a coupling of 1 if it were the capacitance or inductance
    given = sheet.inductance
    if sheet.capacitance is not None:
        given = sheet.capacitance * sheet.capacitance_ratio
    if given is None:
        C = work / COUPLING
        told.append(
            f"{form.store} assumed, {C:.2g} {form.store_unit}, which makes the square of the coupling factor "
            f"{COUPLING}, {form.coupled}: give {form.store} of its data sheet"
        )
    else:
        C = given
        told.append(f"{form.store} from the data sheet, {C:.3g} {form.store_unit} as the mean over the range")
    coupling = work / C
    if not coupling < 1:
        raise InputError(
            f"The {form.store} of the data sheet, its mean over the range, must exceed {work:.3g} {form.store_unit}, "
            f"else stroke and blocking force are more work than the input supplies. Got {C:.3g} {form.store_unit} "
            "instead."
        )
    share = 0.9 + 0.1 * coupling
    resistance = sheet.resistance or form.resistance
    if form.unit == "A" and sheet.resistance is None:
        told.append(f"resistance of the coil assumed, {resistance:g} ohm: give resistance of its data sheet")
    k = k_held / (1 - coupling / share)
    tau = form.tau
    if mode.lag is not None and not form.leads:
        tau = mode.lag
        told.append(f"lag of the eddy currents from the identified poles, {tau:.3g} s")
        mode = Mode(None, None, "the poles of the model are real, those of the eddy currents")
    f_n = sheet.resonance or mode.f_n
    if f_n is None:
        told.insert(0, f"no mass, because {mode.why}: give resonance of its data sheet")
        w = 2 * math.pi * SETTLING
        c = 2 * DAMPING * k_held / w
        return Mechanics(most, stroke, C, k, None, c, share, resistance, tau, None, None, tuple(told))
    zeta = sheet.damping or (None if sheet.resonance else mode.zeta)
    source = f"the data sheet, resonance {f_n:.4g} Hz" if sheet.resonance else f"the identified mode, {mode.why}"
    damped = f"damping ratio {zeta:.3g}" if zeta else f"damping ratio assumed, {DAMPING:g}"
    leads = resistance if form.leads else 0.0
    small = _Small(k, slope, stroke / (share * C * most), leads, tau, (1 - share) * C)
    m, c, speed = small.mass(f_n, zeta or DAMPING)
    told.insert(0, f"mass {m:.3g} kg and damping from {source}, {damped}")
    lowest = math.sqrt(k_held / m) / (2 * math.pi)
    if form.leads:
        resistance /= speed
    return Mechanics(most, stroke, C, k, m, c, share, resistance, tau / speed, f_n, lowest, tuple(told))


@dataclass(frozen=True)
class _Small:
    """An element with small vibrations: stiffness k (N/m), slope (m/V), stroke d (m/C) per charge, circuit."""

    k: float
    slope: float
    d: float
    resistance: float
    tau: float
    c0: float

    def stiffness(self, s: complex, speed: float) -> complex:
        """Return the force per position at the complex frequency s (1/s); the circuit is `speed` times faster."""
        resistance = self.resistance / speed
        leads = resistance * self.slope * s / (self.d * (1 + s * resistance * self.c0))
        return self.k / (1 + self.k * self.slope * self.d / (1 + s * self.tau / speed + leads))

    def mass(self, f_n: float, zeta: float) -> tuple[float, float, float]:
        """Return mass, damping, and the factor by which the circuit must be faster than its default.

        The factor is doubled until a damping of the element can give the damping ratio of the mode.
        """
        w = 2 * math.pi * f_n
        root = cmath.sqrt(zeta**2 - 1)
        poles = (w * (-zeta + root), w * (-zeta - root))
        speed = 1.0
        while True:
            rows = np.array([[s * s, s] for s in poles])
            right = [-self.stiffness(s, speed) for s in poles]
            m, c = (float(x.real) for x in np.linalg.solve(rows, np.array(right)))
            if c > zeta * m * w or speed > 1e6:
                return m, c, speed
            speed *= 2
