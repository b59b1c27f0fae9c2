"""Common result of all file readers: named columns whose numbers are converted on demand; their headings.

A heading has a name and a unit of measure: ``Zeit [ms]``, ``u (V)``, ``t / ms``, ``Weg in µm``, ``time_ms``. A line
above the rows may state the sample rate or interval: ``Abtastrate [Hz];2000``, ``# fs = 2 kHz``, ``Sample
Interval,4e-07,s`` of an oscilloscope, ``Delta_X`` of LabVIEW.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

from hystfmu.base.arrays import Array
from hystfmu.base.printable import printable

TIME = {  # unit of time: counts of it in a second, or seconds in a count
    "s": (1.0, 1.0),
    "ms": (1e3, 1.0),
    "us": (1e6, 1.0),
    "ns": (1e9, 1.0),
    "min": (1.0, 60.0),
    "h": (1.0, 3600.0),
}
DRIVES = ("V", "mV", "kV", "A", "mA", "A/m", "kA/m", "Oe", "V/m", "kV/mm", "kV/cm")
LENGTHS = ("m", "mm", "um", "nm", "pm", "cm")
MORE = ("N", "mN", "kN", "Pa", "MPa", "T", "mT", "rad", "mrad", "urad", "deg", "K", "degC", "%", "Hz", "kHz", "C", "1")
KNOWN = frozenset((*TIME, *DRIVES, *LENGTHS, *MORE))
_WORDS = {  # other spellings, in small letters
    **dict.fromkeys(("sec", "secs", "second", "seconds", "sek", "sekunde", "sekunden", "seconde", "secondes"), "s"),
    **dict.fromkeys(("msec", "millisecond", "milliseconds", "millisekunden"), "ms"),
    **dict.fromkeys(("usec", "microsecond", "microseconds", "mikrosekunden"), "us"),
    **dict.fromkeys(("minute", "minutes", "minuten"), "min"),
    **dict.fromkeys(("hour", "hours", "stunden"), "h"),
    **dict.fromkeys(("volt", "volts"), "V"),
    **dict.fromkeys(("millivolt", "millivolts"), "mV"),
    **dict.fromkeys(("ampere", "amperes", "amps", "amp"), "A"),
    **dict.fromkeys(
        ("micron", "microns", "micrometer", "micrometers", "micrometre", "micrometres", "mikrometer"), "um"
    ),
    **dict.fromkeys(("nanometer", "nanometers", "nanometre", "nanometres"), "nm"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    "newton": "N",
    "hertz": "Hz",
}
_BRACKETS = re.compile(r"(.*?)[\s,_]*(?:\[([^\[\]]*)\]|\(([^()]*)\))")
_BEHIND = re.compile(r"(.*?\S)(\s*/\s*|\s+in\s+|\s*,\s*|_|\s+)([^\s/,_]+)")
_TIMES = ("t", "time", "zeit")  # names before a unit of measure of one letter, t_s


def spelling(unit: str) -> str:
    """Return the notation of this package for a unit of measure, ``um`` for ``µm``; other units unchanged."""
    unit = unit.strip().replace("\u00b5", "u").replace("\u03bc", "u").replace("°C", "degC").replace("²", "2")
    if unit in KNOWN:
        return unit
    return _WORDS.get(unit.lower().rstrip("."), unit)


def is_unit(text: str) -> bool:
    """Return whether a cell of a heading is a unit of measure, with or without brackets."""
    bare = text.strip()
    if bare[:1] + bare[-1:] in ("[]", "()"):
        bare = bare[1:-1]
    return spelling(bare) in KNOWN


def split_name(label: str) -> tuple[str, str]:
    """Split a heading into the name and the unit of measure after it.

    Text in square brackets is always a unit of measure. Text in round brackets, or after a slash, ``in`` or a comma, is
    a unit of measure only if it is known. Text after an underscore or a blank is a unit of measure if it is known and
    cannot be an index, as in ``u_min``, ``y_m`` or ``Channel A``.
    """
    if m := _BRACKETS.fullmatch(label):
        unit = m[2] if m[2] is not None else m[3]
        if m[2] is not None or spelling(unit) in KNOWN:
            return m[1].strip(), spelling(unit)
    if label.startswith("in ") and is_unit(label[3:]):  # the time of an oscilloscope, "in s"
        return label, spelling(label[3:])
    if (m := _BEHIND.fullmatch(label)) and spelling(m[3]) in KNOWN and m[3] != "1":
        name, unit = m[1].strip(), m[3]
        loose = m[2] == "_" or m[2].isspace()
        if not loose or name.lower() in _TIMES or unit == "V" or (len(unit) > 1 and unit != "min"):
            return name, spelling(unit)
    return label.strip(), ""


_RATES = re.compile(r"fs|rate|(sampl(e|ing)|acquisition|scan|mess|abtast)(rate|frequency|frequenz)")
_STEPS = re.compile(
    r"d(elta)?[tx]|ts|xincr(ement)?|timestep|sampl(e|ing)(interval|time|period)|abtast(zeit|intervall|periode)"
)
_HERTZ = {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "GHz": 1e9}
_OF_SIGNALS = re.compile(r"(vertical|y)?(unit|einheit)(s|en|label)?")
_OF_TIME = re.compile(r"(horizontal|x)unit(s|label)?")
_NUMBER = r"(?P<number>[+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)"
_LINE = re.compile(
    rf"[\s#%/!\"]*(?P<name>[^\W\d][\w .-]*?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*[:=;,\t\" ]\s*{_NUMBER}"
    r"(?:[;,\t\" ]*[\[(]?(?P<behind>[A-Za-zµμ/]+))?"
)


def stated_step(name: str, value: float, unit: str = "") -> float:
    """Return the sample step (s) that a named number states; 0 if the number is not a sample step or rate.

    The name is e.g. ``fs``, ``Sample Interval``, ``run/dt``; the unit of measure is by default Hz or s.
    """
    name, behind = split_name(re.split(r"[/@]", name)[-1])
    key, unit = _key(name), unit or behind
    if not (math.isfinite(value) and value > 0):
        return 0.0
    if _RATES.fullmatch(key):
        per_second = re.sub(r"S(a|amples)?/s(ec)?|samples/s|1/s", "Hz", unit or "Hz")
        return 1 / (value * _HERTZ[per_second]) if per_second in _HERTZ else 0.0
    if _STEPS.fullmatch(key) and spelling(unit or "s") in TIME:
        counts, seconds = TIME[spelling(unit or "s")]
        return value / counts * seconds
    return 0.0


def step_in(lines: Iterable[str], comma: bool) -> float:
    """Return the first sample step (s) that a line above the rows states; 0 if no line states a step.

    `comma` states whether numbers have a decimal comma.
    """
    for line in lines:
        if m := _LINE.match(line):
            if comma and re.fullmatch(r"\d{1,3}\.\d{3}", m["number"]):  # 2.000 is 2 or 2000
                continue
            number = m["number"].replace(",", ".") if comma else m["number"].partition(",")[0]
            behind = m["behind"] or ""
            of_a_step = spelling(behind) in TIME or "Hz" in behind or behind.endswith("/s")
            unit = m["unit"] or (behind if of_a_step else "")
            if step := stated_step(m["name"], float(number), unit.strip()):
                return step
    return 0.0


def units_in(rows: Iterable[list[str]], columns: int) -> list[str]:
    """Return the units of measure of `columns` columns of numbers, from the cells of the lines above the rows.

    The first unit belongs to the time if it is a unit of time. The result is empty if the units are unknown.
    """
    found = [""] * columns
    for name, *cells in rows:
        given = [spelling(c) for c in cells if c and is_unit(c)]
        if not given or len(given) < sum(map(bool, cells)):
            continue
        if _OF_TIME.fullmatch(_key(name)) and columns > 1:
            found[0] = found[0] or given[0]
        elif _OF_SIGNALS.fullmatch(_key(name)) and len(given) <= columns:
            first = 0 if len(given) == columns else 1
            found[first : first + len(given)] = given[: columns - first]
    return found


def _key(name: str) -> str:
    return re.sub(r"[\W_]", "", name).lower()


Kind = Literal["number", "clock", "text", "empty"]
"""Content of the cells of a column; a clock is a time of day, with or without a date."""


class Stamps(NamedTuple):
    """Times t (n,) in s since the first row, value (n,) in s of one count of the last digit, the first stamp."""

    t: Array
    digits: Array
    first: str


class Source(Protocol):
    """Cells of a file. Columns `k` are counted from 0. All errors are InputError with line and column."""

    def numbers(self, order: Sequence[int]) -> Array:
        """Return the numbers of some columns, shape (n, len(order))."""

    def words(self, k: int) -> list[str]:
        """Return the cells as text."""

    def digits(self, k: int) -> Array:
        """Return the value (n,) of one count of the last printed digit of a column."""

    def since(self, k: int) -> Array:
        """Return a column minus its first value, without rounding errors of large numbers."""

    def stamps(self, k: int) -> Stamps:
        """Return the times of a column of clocks."""


@dataclass(frozen=True)
class Column:
    """Heading of a column: label as the file writes it, ``Zeit [ms]``, or empty; name; unit; kind of cells.

    The name is the label without its unit of measure. The unit is in the spelling of the package, or empty.
    """

    label: str
    name: str
    unit: str
    kind: Kind = "number"

    def __post_init__(self) -> None:
        for key in ("label", "name", "unit"):  # a heading goes on to terminals, models and FMUs
            object.__setattr__(self, key, printable(getattr(self, key)))

    @classmethod
    def of(cls, label: str, unit: str = "", kind: Kind = "number") -> Column:
        """Split a label into name and unit of measure; a `unit` that is stated elsewhere has priority."""
        name, found = split_name(label)
        return cls(label, name, unit or found, kind)


@dataclass(frozen=True)
class Table:
    """Columns of a file with their headings, in the order of the file; `source` has the cells.

    `named_in` is the location of the headings, for messages; `assumed` are findings and assumptions of the reader, each
    in a few words. `lines` are the lines of the rows as an editor counts lines; None for files without lines. `step` is
    the sample step (s) that the file states outside its columns, or 0.
    """

    path: str
    columns: tuple[Column, ...]
    named_in: str
    assumed: tuple[str, ...]
    source: Source
    lines: Sequence[int] | None = None
    step: float = 0.0

    @property
    def where(self) -> str:
        """Begin of a message about the headings."""
        return f"{self.path}: {self.named_in}: " if self.named_in else f"{self.path}: "

    def title(self, k: int) -> str:
        """Name a column for a message: by its name, or by its number from 1."""
        return repr(self.columns[k].name) if self.columns[k].name else f"number {k + 1}"
