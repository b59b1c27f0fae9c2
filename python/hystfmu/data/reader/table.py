"""Tables: the common result of all file readers. Cells are converted to numbers only when they are needed.

A heading contains a name and a unit of measure, as in ``Zeit [ms]``, ``u (V)``, ``t / ms``, ``Weg in µm`` or
``time_ms``. A line above the rows may state the sampling rate or the time step. Examples are ``Abtastrate [Hz];2000``,
``# fs = 2 kHz``, ``Sample Interval,4e-07,s`` of an oscilloscope, and ``Delta_X`` of LabVIEW.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, Protocol

from hystfmu.base import Array, InputError
from hystfmu.base.printable import printable

TIME = {  # for each unit of time: counts per second, seconds per count; one of both numbers is 1
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
_WORDS = {  # other spellings, in lower case
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
_WIDE = str.maketrans("\uff08\uff09\uff3b\uff3d", "()[]")  # full-width brackets of East Asian keyboards
_BEHIND = re.compile(r"(.*?\S)(\s*/\s*|\s+in\s+|\s*,\s*|_|\s+)([^\s/,_]+)")
STEPS_AGREE = 1e-6  # permitted relative difference between the time steps of the columns of one record
FIRST_AGREE = 0.5  # permitted difference between their first times, relative to the step
_TIMES = ("t", "time", "zeit")  # names that may precede a unit of one letter, as in t_s


def spelling(unit: str) -> str:
    """Return a unit of measure in the spelling of this package, e.g. ``um`` for ``µm``. Other units stay unchanged."""
    unit = unit.strip().replace("\u00b5", "u").replace("\u03bc", "u").replace("°C", "degC").replace("²", "2")
    if unit in KNOWN:
        return unit
    return _WORDS.get(unit.lower().rstrip("."), unit)


def is_unit(text: str) -> bool:
    """Return whether a text is a known unit of measure, with or without brackets."""
    bare = text.strip()
    if bare[:1] + bare[-1:] in ("[]", "()"):
        bare = bare[1:-1]
    return spelling(bare) in KNOWN


def split_name(label: str) -> tuple[str, str]:
    """Return the name and the unit of measure of a heading.

    Text in square brackets is always a unit of measure. Text in round brackets, or after a slash, ``in`` or a comma, is
    a unit of measure only if it is known. Text after an underscore or a blank is a unit of measure if it is known and
    cannot be an index, as in ``u_min``, ``y_m`` or ``Channel A``.
    """
    label = label.translate(_WIDE)
    if m := _BRACKETS.fullmatch(label):
        unit = m[2] if m[2] is not None else m[3]
        if m[2] is not None or spelling(unit) in KNOWN:
            return m[1].strip(), spelling(unit)
    if label.startswith("in ") and is_unit(label[3:]):  # heading "in s" of the time column of an oscilloscope
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

_PARTED = re.compile(r"[._']\d|[ \u00a0\u202f]\d{3}(?!\d)")
_PREFIX = re.compile(r"\s*[kMGmun\u00b5\u03bc]")


def stated_step(name: str, value: float, unit: str = "") -> float:
    """Return the time step (s) that a named number states; 0 if it is neither a time step nor a sampling rate.

    The name is for example ``fs``, ``Sample Interval`` or ``run/dt``. If the unit is empty, a rate is in Hz and a step
    in s.
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
    """Return the first time step (s) that a line above the rows states; 0 if no line states a step.

    `comma` states whether the numbers have a decimal comma.
    """
    for line in lines:
        if m := _LINE.match(line):
            number = m["number"].replace(",", ".") if comma else m["number"].partition(",")[0]
            behind = m["behind"] or ""
            of_a_step = spelling(behind) in TIME or "Hz" in behind or behind.endswith("/s")
            unit = m["unit"] or (behind if of_a_step else "")
            if _is_unclear(m, number, unit, comma):
                continue
            if step := stated_step(m["name"], float(number), unit.strip()):
                return step
    return 0.0


def _is_unclear(m: re.Match[str], number: str, unit: str, comma: bool) -> bool:
    """Return whether a number may have parted thousands or an unknown prefix: 2.000, 2 000, 2,000 or 2 kSps."""
    line, first, end = m.string, m.start("number"), m.end("number")
    if comma and re.fullmatch(r"\d{1,3}\.\d{3}", m["number"]):
        return True
    second = "" if comma else "".join(line[first:].split(",")[1:2]).strip()  # another channel has the same number
    if second[:1].isdigit() and not second.startswith(number):
        return True
    return bool(_PARTED.match(line, end) or (not unit and _PREFIX.match(line, end)))


def units_in(rows: Iterable[list[str]], columns: int) -> list[str]:
    """Return the units of measure of `columns` columns of numbers, which a line above the rows may state.

    `rows` contains the cells of these lines. A unit that no line states is empty.
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
"""Content of the cells of a column. A "clock" is a time of day, with or without a date."""


class Stamps(NamedTuple):
    """Time stamps of the rows of a file.

    They consist of times t (n,) in s since the first row, the value (n,) in s of one unit of the last printed digit of
    each time, and the text of the first stamp.
    """

    t: Array
    digits: Array
    first: str


class Source(Protocol):
    """Interface to the cells of a file. The index `k` of a column is counted from 0.

    All methods raise InputError for invalid cells; the message names the line and the column.
    """

    def numbers(self, order: Sequence[int]) -> Array:
        """Return the numbers of the columns with the indices `order`, shape (n, len(order))."""

    def words(self, k: int) -> list[str]:
        """Return the cells of column `k` as text."""

    def digits(self, k: int) -> Array:
        """Return, for each number in column `k`, the value (n,) of one unit of its last printed digit."""

    def since(self, k: int) -> Array:
        """Return column `k` minus its first value, without the rounding errors of large numbers."""

    def stamps(self, k: int) -> Stamps:
        """Return the times of column `k`, which contains times of day."""


@dataclass(frozen=True)
class Column:
    """Heading of a column, e.g. ``Zeit [ms]``, with its name, unit of measure, and kind of cells.

    `label` is the complete heading. `name` is the heading without the unit of measure. The unit has the spelling of
    this package, or is empty.
    """

    label: str
    name: str
    unit: str
    kind: Kind = "number"

    def __post_init__(self) -> None:
        for key in ("label", "name", "unit"):  # terminals, models and FMUs contain the heading, so it must be printable
            object.__setattr__(self, key, printable(getattr(self, key)))

    @classmethod
    def of(cls, label: str, unit: str = "", kind: Kind = "number") -> "Column":
        """Return the column with the heading `label`. A nonempty `unit` replaces the unit of measure in the heading."""
        name, found = split_name(label)
        return cls(label, name, unit or found, kind)


@dataclass(frozen=True)
class Table:
    """Columns of a file in their order, with headings; `source` gives access to the cells.

    `named_in` is the location of the headings, for messages. `assumed` contains the assumptions of the reader. `lines`
    contains the line number of each row, or is None for files that do not consist of lines. `step` is the time step (s)
    that the file states outside its columns, or 0. `own_times` contains the time step (s) and the first time (s) that
    the file states for each column alone, or 0; it is empty for files of text.
    """

    path: str
    columns: tuple[Column, ...]
    named_in: str
    assumed: tuple[str, ...]
    source: Source
    lines: Sequence[int] | None = None
    step: float = 0.0
    own_times: tuple[tuple[float, float], ...] = ()

    def stepped(self, order: Sequence[int], timed: bool) -> "Table":
        """Return the table with the time step of the columns with the indices `order`.

        Raises
        ------
        InputError
            The columns have different time steps or first times, and no column of times (`timed`) replaces them.
        """
        own = {k: self.own_times[k] for k in order if self.own_times and self.own_times[k][0]}
        if not own:
            return self
        steps, firsts = zip(*own.values(), strict=True)
        for what, values, slack in (("time steps", steps, STEPS_AGREE), ("first times", firsts, FIRST_AGREE)):
            if not timed and max(values) - min(values) > slack * min(steps):
                told = ", ".join(f"{self.title(k)} ({value:.9g} s)" for k, value in zip(own, values, strict=True))
                raise InputError(f"{self.where}The columns must have equal {what}. Got {told} instead.")
        return replace(self, step=steps[0])

    @property
    def where(self) -> str:
        """First part of an error message about the headings: the file, and the location of the headings."""
        return f"{self.path}: {self.named_in}: " if self.named_in else f"{self.path}: "

    def title(self, k: int) -> str:
        """Return the name of a column for a message; without a name, its number counted from 1."""
        return repr(self.columns[k].name) if self.columns[k].name else f"number {k + 1}"
