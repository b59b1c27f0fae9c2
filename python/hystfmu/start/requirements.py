"""Requirements of a loop, from options of the command line, keys of a TOML file, or arguments in Python."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from hystfmu.base import InputError
from hystfmu.design.race import MS_DB
from hystfmu.design.structures import STRUCTURES

SHAPES = ("sine", "nested", "triangle", "step", "staircase")
OVERSHOOT = 10.0  # percent of a step, where nothing is asked for
JUMPS = ("step", "staircase")
TURN = 0.1  # share of a triangle in its turn-arounds


_MOST = {"error": 100.0, "bandwidth": math.inf, "ms": 40.0, "settling": math.inf, "overshoot": math.inf}


@dataclass(frozen=True)
class Wanted:
    """A required reference of the loop.

    Attributes
    ----------
    shape : str
        One of `SHAPES`, or "file".
    frequency : float
        Frequency (Hz), or 0 for the mean cycle frequency of the record. For a step and a staircase, it is the number of
        levels per second.
    file : str
        CSV file with columns t and r, for the shape "file".
    """

    shape: str
    frequency: float = 0.0
    file: str = ""

    @classmethod
    def of(cls, text: str) -> "Wanted":
        """Return the reference for a text such as ``triangle:100`` or ``step``, or for the path of a file."""
        shape, _, rest = text.partition(":")
        if shape not in SHAPES:
            if not Path(text).is_file():
                raise InputError(
                    f"The reference must be one of {', '.join(SHAPES)}, with or without :HZ, or a file. "
                    f"Got {text!r} instead."
                )
            return cls("file", file=text)
        if not rest:
            return cls(shape)
        return cls(shape, _number(rest, "frequency of the reference", "a float in (0, inf)", 0.0))


@dataclass(frozen=True)
class Amplifier:
    """Limits of the amplifier in the unit of measure of the input. A missing limit is infinite.

    Attributes
    ----------
    slew : float
        Largest slew rate (unit of measure of u per second).
    low, high : float
        Smallest and largest command.
    """

    slew: float = math.inf
    low: float = -math.inf
    high: float = math.inf

    @classmethod
    def of(cls, text: str) -> "Amplifier":
        """Return the limits in a text ``slew=..,max=..,min=..,current=..,capacitance=..``.

        A current limit I (A) limits the slew rate: dU/dt = I / C. Therefore it needs the capacitance C (F) of the
        actuator.
        """
        values: dict[str, float] = {}
        for part in text.split(","):
            key, _, value = part.strip().partition("=")
            if key not in ("slew", "max", "min", "current", "capacitance"):
                raise InputError(
                    "The key of the amplifier must be one of slew, max, min, current, capacitance. "
                    f"Got {key!r} instead."
                )
            values[key] = _number(value, f"'{key}' of the amplifier", "a finite float", -math.inf)
        for key in ("slew", "current", "capacitance"):
            if not values.get(key, 1.0) > 0:
                raise InputError(
                    f"The '{key}' of the amplifier must be a float in (0, inf). Got {values[key]:g} instead."
                )
        slew = values.get("slew", math.inf)
        if "current" in values:
            if "capacitance" not in values:
                raise InputError(
                    "The 'current' of the amplifier must come with the 'capacitance' of the actuator (F), because both "
                    "determine the slew rate. Got no capacitance."
                )
            slew = min(slew, values["current"] / values["capacitance"])
        low, high = values.get("min", -math.inf), values.get("max", math.inf)
        if not low < high:
            raise InputError(f"The 'min' of the amplifier must be below its 'max'. Got {low:g} and {high:g} instead.")
        return cls(slew, low, high)


@dataclass(frozen=True)
class Requirements:
    """Requirements of a loop. None means that a quantity is not limited.

    Attributes
    ----------
    error : float or None
        Largest allowed RMS error, in percent of the peak-to-peak value of the reference.
    controller : str or None
        Structure of the controller, or "none" for a loop without feedback. ``hystfmu design --help`` lists all
        structures. By default, the command compares all structures and selects the best one.
    bandwidth : float or None
        Required bandwidth (Hz). The sensitivity must be below -3 dB up to this frequency.
    ms : float
        Largest allowed peak of the sensitivity (dB) for the identified plant. The default is 6 dB.
    settling : float or None
        Longest allowed settling time (s) of a step response. The settling time ends when the error stays within 2 % of
        the step.
    overshoot : float or None
        Largest allowed overshoot of a step response in percent of the step. By default, the overshoot has no limit, and
        the filter for steps of the reference is designed for an overshoot of 10 %.
    reference : tuple of Wanted
        Reference of the loop. It is a shape (sine, nested, triangle, step or staircase), optionally followed by a
        frequency (Hz) as in triangle:100, or a CSV file with the columns t and r.

        By default, the references are a sine, nested reversals, a triangle and a step. Their frequency is the mean
        cycle frequency of the record.
    delay : int
        Delay of the loop in steps, from a measurement to the command that is computed from this measurement. The
        default is 1.
    resonance : (float, float) or None
        Frequency (Hz) and damping ratio of a resonance that is known from another source, such as a data sheet. It
        replaces the resonance that the command assumes at an unknown frequency above the excited band.
    amplifier : Amplifier or None
        Limits of the amplifier. The names are slew (largest rate of u), min and max (smallest and largest u), current
        (largest current, A) and capacitance (of the actuator, F).
    """

    error: float | None = None
    controller: str | None = None
    bandwidth: float | None = None
    ms: float = MS_DB
    settling: float | None = None
    overshoot: float | None = None
    reference: tuple[Wanted, ...] = ()
    delay: int = 1
    resonance: tuple[float, float] | None = None
    amplifier: Amplifier | None = None

    @property
    def wanted(self) -> tuple[Wanted, ...]:
        """Required references of the loop.

        A step is added if settling time or overshoot is limited but no reference has steps. A sine is added if all
        references have steps: an error that the jump itself causes would hide the oscillation of a loop.
        """
        kinds = {w.shape in JUMPS for w in self.reference}
        missing = []
        if self.reference and (self.settling or self.overshoot) and True not in kinds:
            missing.append(Wanted("step"))
        if self.reference and False not in kinds:
            missing.append(Wanted("sine"))
        return (*self.reference, *missing)

    def __post_init__(self) -> None:
        """Raise an InputError for contradictory or impossible values."""
        for name, most in _MOST.items():
            value = getattr(self, name)
            if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
                raise InputError(f"The '{name}' must be a number. Got {value!r} instead.")
            if value is not None and not 0.0 < value <= most:
                raise InputError(f"The '{name}' must be a float in (0, {most:g}]. Got {value:g} instead.")
        if isinstance(self.delay, bool) or not isinstance(self.delay, int):
            raise InputError(f"The 'delay' must be an int. Got {self.delay!r} instead.")
        if not 0 <= self.delay <= 1000:
            raise InputError(f"The 'delay' must be an int in [0, 1000] steps. Got {self.delay} instead.")
        known = (*STRUCTURES, "none")
        if self.controller is not None and self.controller not in known:
            raise InputError(f"The 'controller' must be one of {', '.join(known)}. Got {self.controller!r} instead.")
        if self.resonance is not None and not (self.resonance[0] > 0 and 0 < self.resonance[1] < 1):
            f, zeta = self.resonance
            raise InputError(f"The 'resonance' must be HZ > 0 and 0 < ZETA < 1. Got {f:g}, {zeta:g} instead.")

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> "Requirements":
        """Return the requirements in options of the command line or in keys of a TOML file. Empty values are ignored.

        Raises
        ------
        InputError
            A key is unknown, or a value is out of range.
        """
        values: dict[str, Any] = {}
        known = {f.name for f in fields(cls)}
        for key, value in given.items():
            if key not in known:
                raise InputError(f"The requirement must be one of {', '.join(sorted(known))}. Got {key!r} instead.")
            if value is None or value == ():
                continue
            values[key] = _READ[key](value) if key in _READ else value
        try:
            return cls(**values)
        except TypeError:
            raise InputError(f"The requirements must be numbers and words. Got {values} instead.") from None


def _references(given: str | Sequence[str]) -> tuple[Wanted, ...]:
    if not isinstance(given, (str, list, tuple)) or not all(isinstance(text, str) for text in given):
        raise InputError(
            f"The 'reference' must be SHAPE, SHAPE:HZ or a file, or a list of these. Got {given!r} instead."
        )
    return tuple(Wanted.of(text) for text in ([given] if isinstance(given, str) else given))


def _resonance(given: str | float | Sequence[float]) -> tuple[float, float]:
    parts = given.split(",") if isinstance(given, str) else given if isinstance(given, (list, tuple)) else [given]
    numbers = [_number(str(p), "resonance", "HZ or HZ,ZETA", 0.0) for p in parts]
    if len(numbers) not in (1, 2):
        raise InputError(f"The 'resonance' must be HZ or HZ,ZETA. Got {given!r} instead.")
    return numbers[0], numbers[1] if len(numbers) == 2 else 0.01


_READ: dict[str, Callable[[Any], Any]] = {
    "reference": _references,
    "resonance": _resonance,
    "amplifier": lambda given: given if isinstance(given, Amplifier) else Amplifier.of(str(given)),
}


def _number(text: str, what: str, rule: str, above: float) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > above):
        raise InputError(f"The {what} must be {rule}. Got {text!r} instead.")
    return value
