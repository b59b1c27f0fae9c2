"""Data in the lines above the rows: sample rate or interval, units of measure.

``Abtastrate [Hz];2000``, ``# fs = 2 kHz``, ``Sample Interval,4e-07,s`` of an oscilloscope, ``Delta_X`` of LabVIEW.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from hystfmu.data.reader.measures import TIME, is_unit, spelling, split_name

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
    """Return the sample step (s) given by a named number; 0 if it gives none.

    Parameters
    ----------
    name : str
        E.g. ``fs``, ``Sample Interval``, ``run/dt``.
    value : float
    unit : str
        Unit of measure; by default Hz and s.
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
    """Return the first sample step (s) that a line states; 0 if none does.

    Parameters
    ----------
    lines : iterable of str
        Lines above the rows.
    comma : bool
        Whether numbers have a decimal comma.
    """
    for line in lines:
        if m := _LINE.match(line):
            if comma and re.fullmatch(r"\d{1,3}\.\d{3}", m["number"]):  # 2.000 is 2 or 2000
                continue
            number = m["number"].replace(",", ".") if comma else m["number"].partition(",")[0]
            unit = m["unit"] or (m["behind"] if m["behind"] and _is_of_a_step(m["behind"]) else "")
            if step := stated_step(m["name"], float(number), unit.strip()):
                return step
    return 0.0


def _is_of_a_step(unit: str) -> bool:
    return spelling(unit) in TIME or "Hz" in unit or unit.endswith("/s")


def units_in(rows: Iterable[list[str]], columns: int) -> list[str]:
    """Return the units of measure of `columns` columns, the first for the time if the first unit is one of time.

    Empty if unknown.

    Parameters
    ----------
    rows : iterable of list of str
        The cells of the lines above the rows.
    columns : int
        Columns that hold numbers.
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
