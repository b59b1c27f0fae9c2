"""Stiffness, capacitance, mass and damping of an actuator from a data sheet, a mode, or defaults.

If the mode (natural frequency and damping ratio) is not known, the actuator has no mass. Otherwise, mass and damping
are computed for small vibrations about the initial voltage. In such a vibration, the outputs of plays are constant, and
another operator has its slope directly after a reversal. Then the position x (m) and the force F (N) satisfy

    K(s) x = F,   K = k/(1 + k sigma d/(1 + s tau + R sigma s/(d (1 + s R C0)))),

where k (N/m) is the stiffness, sigma (m/V) is the slope, d (m/C) is the stroke per charge, tau (s) is the time constant
of the relaxation, R (ohm) is the resistance of the leads, and C0 (F) is the capacitance without motion. Mass m and
damping c solve the equation m s^2 + c s + K(s) = 0 at the poles of the mode. For a magnetostrictive rod, sigma is in
m/A and d in m/Wb. There R = 0, because the current is prescribed.
"""

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from hystfmu.base import InputError


@dataclass(frozen=True)
class Sheet:
    """Values of a data sheet in SI units. A value that the data sheet does not state is None.

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
        Inductance (H) of the coil of a current-driven actuator without load. It is the mean over the current range.
    resistance : float or None
        Resistance (ohm) of this coil.
    resonance : float or None
        Resonance (Hz) without load, with one end fixed.
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
    def of(cls, values: Mapping[str, object]) -> "Sheet":
        """Return a data sheet from values by name.

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


@dataclass(frozen=True)
class Form:
    """One form of actuator: its names in the library, and the defaults of values that no data sheet states.

    Attributes
    ----------
    unit : str
        Unit of the input: V or A.
    base, text : str
        Base class, and description of an exported class.
    limit, start : str
        Parameters of the base class for range and start of the input.
    store, symbol, store_unit : str
        Element that stores the electrical energy: name in the data sheet, parameter, and unit.
    stiffness : float
        Stiffness while the input is held (N/m).
    size, coupled : str
        Example device with this stiffness, and example material with the assumed coupling.
    resistance : float
        Resistance of the leads or of the coil (ohm).
    tau : float
        Time constant of the relaxation, or lag of the eddy currents (s).
    leads : bool
        Whether the resistance affects small vibrations. It has no effect if the current is prescribed.
    warmed : str
        Text that names the source of the temperature, for a hysteresis that depends on a temperature.
    """

    unit: str
    base: str
    text: str
    limit: str
    start: str
    store: str
    symbol: str
    store_unit: str
    stiffness: float
    size: str
    coupled: str
    resistance: float
    tau: float
    leads: bool
    warmed: str


# Square of the coupling factor of both forms if no data sheet gives it.  d33^2/(s33 eps33), IEEE Std 176-1987, of the
# soft ceramic PIC255 (PI Ceramic, Piezo Material Data: 400e-12 m/V, 20.7e-12 m2/N, 1750 eps0; its measured k33 of 0.69
# gives 0.48); k33 of Terfenol-D is 0.7 (Engdahl, Handbook of Giant Magnetostrictive Materials, 2000).
COUPLING = 0.5
PIEZO = Form(
    "V",
    "Piezo",
    "Piezo actuator",
    "v_max",
    "v_start",
    "capacitance",
    "C",
    "F",
    2e7,  # A/(s33 L) is 3.4e7 for the bare ceramic
    "in short circuit, of the size of a stack of 5 x 5 x 36 mm",
    "as d33, s33 and eps33 of PIC255 do",
    1.0,
    1e-5,
    True,
    "the temperature of the heat port, else T_fixed",
)
ROD = Form(
    "A",
    "Magnetostrictive",
    "Magnetostrictive actuator",
    "i_max",
    "i_start",
    "inductance",
    "L",
    "H",
    3e7,  # E A/L with 30 GPa at constant field
    "at constant current, of the size of a rod of Terfenol-D of 8 x 50 mm",
    "as k33 of Terfenol-D, 0.7, does",
    2.0,
    1e-4,
    False,
    "T_fixed",
)
FORMS = {f.unit: f for f in (PIEZO, ROD)}


DAMPING = 0.02  # damping ratio if no data sheet states it
KNOWN = 0.1  # frequencies and damping ratios with a larger relative standard error count as unknown
SETTLING = 1e4  # Hz: without a mass, the damping of the ceramic settles within some 0.1 ms


@dataclass(frozen=True)
class Mode:
    """Natural frequency and damping ratio of the mechanical mode of a model.

    Attributes
    ----------
    f_n, zeta : float or None
        Natural frequency (Hz) and damping ratio; None if they are not known.
    why : str
        Source and accuracy of the values, or the reason why they are not known.
    """

    f_n: float | None
    zeta: float | None
    why: str

    @classmethod
    def of(cls, found: Mapping[str, Any]) -> "Mode":
        """Return the mode from the results of a fit, see `Model.fit`."""
        if "f_n" not in found:
            return cls(None, None, "the model has no mode")
        f_n, zeta = float(found["f_n"]), float(found["zeta"])
        if "f_n_se" not in found:
            why = f"f_n = {f_n:.4g} Hz is at a bound of its search, or the model does not state its standard error"
            return cls(None, None, why)
        error = float(found["f_n_se"]) / f_n
        if not error < KNOWN:
            return cls(None, None, f"f_n = {f_n:.4g} Hz has a standard error of {100 * error:.2g} %")
        damped = float(found.get("zeta_se", math.inf)) / zeta < KNOWN
        return cls(f_n, zeta if damped else None, f"f_n = {f_n:.4g} Hz, standard error {100 * error:.2g} %")

    @property
    def lag(self) -> float | None:
        """Time constant (s) of the slower of two real poles; None if the poles are complex or unknown."""
        if self.f_n is None or self.zeta is None or self.zeta < 1:
            return None
        return (self.zeta + math.sqrt(self.zeta**2 - 1)) / (2 * math.pi * self.f_n)


@dataclass(frozen=True)
class Mechanics:
    """Parameters of the base class of an actuator in SI units, and a text about the source of each parameter.

    `most` is the range of voltage or current. `C` is the capacitance or inductance. `m` and `f_n` are None without a
    moving mass. `lowest` (Hz) is the resonance that results if the slope for small vibrations equals the mean slope
    over the whole range of the input.
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
    """Compute the mechanical and electrical parameters of an actuator.

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
        The actuator would produce more work than it receives, or the data sheet has a value that only the other form of
        actuator (piezoelectric or magnetostrictive) has.
    """
    told = []
    for name, why in (("capacitance", "A"), ("inductance", "V"), ("resistance", "V")):
        if form.unit == why and getattr(sheet, name) is not None:
            raise InputError(f"The data sheet of an actuator that is driven by {why} has no value {name!r}.")
    if sheet.stroke is None or sheet.blocking_force is None:
        k_held = form.stiffness
        told.append(f"stiffness assumed, {k_held:g} N/m {form.size}: state stroke and blocking_force (--sheet)")
    else:
        k_held = sheet.blocking_force / sheet.stroke
        told.append(f"stiffness from the data sheet, {k_held:.3g} N/m {form.size.split(',')[0]}")
    work = stroke**2 * k_held / most**2  # F or H; with this capacitance or inductance, the coupling factor would be 1
    given = sheet.inductance
    if sheet.capacitance is not None:
        given = sheet.capacitance * sheet.capacitance_ratio
    if given is None:
        C = work / COUPLING
        told.append(
            f"{form.store} assumed, {C:.2g} {form.store_unit}, for a squared coupling factor of "
            f"{COUPLING}, {form.coupled}: state {form.store} (--sheet)"
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
        told.append(f"resistance of the coil assumed, {resistance:g} ohm: state resistance (--sheet)")
    k = k_held / (1 - coupling / share)
    tau = form.tau
    if mode.lag is not None and not form.leads:
        tau = mode.lag
        told.append(f"lag of the eddy currents from the identified poles, {tau:.3g} s")
        mode = Mode(None, None, "the poles of the model are real, those of the eddy currents")
    f_n = sheet.resonance or mode.f_n
    if f_n is None:
        told.insert(0, f"no mass, because {mode.why}: state resonance (--sheet)")
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
    """Linear model of an actuator for small vibrations.

    `k` is the stiffness (N/m), `slope` the slope of the operator (m/V), and `d` the stroke per charge (m/C).
    `resistance`, `tau` and `c0` describe the circuit.
    """

    k: float
    slope: float
    d: float
    resistance: float
    tau: float
    c0: float

    def stiffness(self, s: complex, speed: float) -> complex:
        """Return the dynamic stiffness (N/m) at the complex frequency `s` (1/s).

        The default time constants of the circuit are divided by `speed`.
        """
        resistance = self.resistance / speed
        leads = resistance * self.slope * s / (self.d * (1 + s * resistance * self.c0))
        return self.k / (1 + self.k * self.slope * self.d / (1 + s * self.tau / speed + leads))

    def mass(self, f_n: float, zeta: float) -> tuple[float, float, float]:
        """Return mass (kg), damping constant (N s/m), and the factor that divides the time constants of the circuit.

        The factor is doubled until a positive damping constant can give the damping ratio of the mode.
        """
        w = 2 * math.pi * f_n
        zeta = 1 + 1e-6 if abs(zeta - 1) < 1e-6 else zeta  # two equal poles do not determine mass and damping
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
