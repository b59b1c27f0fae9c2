"""Conversion of the time of a table to s.

The time may be given as numbers with a unit of measure, as counts since 1970, as dates with times of day, or as a
sampling rate. Examples of dates and times of day are ``2026-11-22T10:15:00.125Z``, ``22.11.2026 10:15:00,125`` and
``10:15:00 PM``. The date is used only if it changes. Day and month are distinguished by the separator, by a number
above 12, or by AM and PM. Ambiguous dates are refused.
"""

import datetime
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.data.reader.table import TIME, Column, Stamps, Table

_DATE = r"(\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4})[T,; ]\s*"
_CLOCK = r"(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d*)?)"
_STAMP = re.compile(rf"^(?:{_DATE})?{_CLOCK}\s*([AaPp]\.?[Mm]\.?)?\s*(Z|UTC|GMT|[+-]\d{{2}}:?\d{{2}})?$", re.MULTILINE)
_DAY = 86400.0


def is_stamp(cell: str) -> bool:
    """Return whether a cell is a time of day, with or without a date."""
    return _STAMP.fullmatch(cell) is not None


def stamps(cells: Sequence[str], place: Callable[[int], str]) -> Stamps:
    """Convert a column of times of day, with or without dates, to `Stamps`; `place` identifies a row in a message.

    Raises
    ------
    InputError
        A cell is not a time of day, or the dates are ambiguous.
    """
    found = _STAMP.findall("\n".join(cells))
    if len(found) != len(cells):
        k = next(k for k, c in enumerate(cells) if not is_stamp(c))
        raise InputError(f"{place(k)}: The time must be a clock, e.g. 10:15:00.125. Got {cells[k][:40]!r} instead.")
    dates, hours, minutes, seconds, halves, zones = zip(*found, strict=True)
    h = np.array(hours, dtype=np.float64)
    if any(halves):
        h = h % 12 + np.array([12.0 if half[:1] in "pP" and half else 0.0 for half in halves])
    s = [text.replace(",", ".") for text in seconds]
    t = 3600 * h + 60 * np.array(minutes, dtype=np.float64)
    if len(set(zones)) > 1:
        t -= np.array([_offset(zone) for zone in zones])
    day = _days(dates, any(halves), place) if len(set(dates)) > 1 else np.zeros(len(t))
    if not dates[0]:
        # a time that is more than half a day less than the previous time is on the next day
        day = np.cumsum(np.diff(t, prepend=t[0]) < -_DAY / 2).astype(np.float64)
    whole = _DAY * day + t
    return Stamps(
        whole - whole[0] + (np.array(s, dtype=np.float64) - float(s[0])),
        np.array([10.0 ** -len(text.partition(".")[2]) for text in s]),
        cells[0],
    )


def _offset(zone: str) -> float:
    """Return the time difference (s) between a time zone and UTC, positive east of Greenwich."""
    if zone[:1] not in ("+", "-"):
        return 0.0
    return float(f"{zone[0]}1") * (3600 * int(zone[1:3]) + 60 * int(zone[-2:]))


def _days(dates: Sequence[str], american: bool, place: Callable[[int], str]) -> np.ndarray:
    """Return the number of days (n,) from a fixed day to each date.

    `american` states whether a time contains AM or PM; then the month precedes the day.
    """
    different = dict.fromkeys(dates)
    parts = {d: [int(p) for p in re.split(r"[-/.]", d)] for d in different if d}
    if len(parts) < len(different):
        k = next(k for k, d in enumerate(dates) if not d)
        raise InputError(f"{place(k)}: The time must have a date, as the other rows. Got none.")
    iso = all(d[:4].isdigit() for d in parts)
    german = all("." in d for d in parts) or any(p[0] > 12 for p in parts.values())
    american |= any(p[1] > 12 for p in parts.values())
    if not iso and german == american:
        raise InputError(
            f"{place(0)}: The date must be clear. Got {dates[0]!r}, in which day and month are ambiguous: write the "
            "year first, or give the sample rate in Hz (--rate)."
        )
    order = (0, 1, 2) if iso else (2, 1, 0) if german else (2, 0, 1)
    number = {}
    for d, p in parts.items():
        year, month, day = (p[k] for k in order)
        try:
            number[d] = datetime.date(year + (2000 if year < 100 else 0), month, day).toordinal()
        except ValueError as e:
            k = dates.index(d)
            raise InputError(f"{place(k)}: The date must be one of the calendar. Got {d!r} instead: {e}.") from None
    return np.array([number[d] for d in dates], dtype=np.float64)


_YEARS = (9e8, 4.2e9)  # s since 1970 in the years 1998 and 2103; counts in other units are outside this range
_DAYS = ((20e3, 80e3), (7.1e5, 7.7e5))  # days since 1900, and since the year 0, for dates of the last and this century
_LEAST_STEP = 1e-6  # s: times of this size are not in seconds if their steps are shorter
_AGREE = 0.01  # permitted relative difference between two stated values of one time step
_EPOCH = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}  # counts per second


@dataclass(frozen=True)
class Clock:
    """Times t (n,) in s of the rows of a table, and a text `said` with the unit of measure and the assumptions.

    The function `digits` returns the value (s) of one unit of the last digit of each time. It is None if the times
    were computed from a sampling rate.
    """

    t: Array
    digits: Callable[[], Array] | None
    said: str


def clock_of(table: Table, k: int | None, rate: float | None, numbers: Array, record: slice) -> Clock:
    """Return the times of the n rows of a table, whose time column `k` contains the `numbers` (n,) or time stamps.

    If there is no time column, `k` is None. If a sampling `rate` (Hz) is given, the time column is not used. `record`
    contains the rows of the first record, whose time step may show the unit of measure.

    Raises
    ------
    InputError
        The column does not contain times, or the size of its numbers contradicts its unit of measure.
    """
    rows: Array = np.arange(len(numbers), dtype=np.float64)
    if rate is not None:
        return Clock(rows / np.float64(rate), None, f"{rate:g} Hz")
    if k is None:
        return Clock(rows * np.float64(table.step), None, f"{1 / table.step:.6g} Hz, as the file states")
    column = table.columns[k]
    if column.kind == "clock":
        stamps = table.source.stamps(k)
        return Clock(stamps.t, lambda: stamps.digits, f"as date and clock from {stamps.first[:40]}")
    if column.unit and column.unit not in TIME:
        raise InputError(
            f"{table.where}The {column.name!r} column must be a time in {', '.join(TIME)}. Got [{column.unit}] "
            "instead: give the sample rate in Hz (--rate)."
        )
    steps = np.diff(numbers[record])
    said, counts, first = _scale(table, column, float(numbers[0]), float(steps.mean()) if len(steps) else 0.0)
    t = numbers if not first else table.source.since(k)
    scaled: Array = t / counts
    return Clock(scaled, lambda: table.source.digits(k) / counts, f"{said}{first}")


def _scale(table: Table, column: Column, first: float, step: float) -> tuple[str, float, str]:
    """Return a text with the unit of measure of a time column, its counts per second, and a text with its first date.

    The values `first` and `step` are the first time and the time step, in the unit of the column.
    """
    sized = next((u for u, per in _EPOCH.items() if _YEARS[0] * per <= first < _YEARS[1] * per), "")
    counts, seconds = TIME[column.unit or sized or "s"]
    counts = counts / seconds
    if sized and first / counts >= _YEARS[1]:
        raise InputError(
            f"{table.where}The {column.name!r} column must be a time in {column.unit}. Got {first:.12g}, which may "
            f"be a count of {sized} since 1970: correct the heading, or give the sample rate in Hz (--rate)."
        )
    if sized and first / counts >= _YEARS[0]:
        start = datetime.datetime.fromtimestamp(first / counts, datetime.UTC)
        how = "" if column.unit else " (by its size)"
        return f"in {column.unit or sized} since 1970{how}", counts, f", from {start:%Y-%m-%d %H:%M:%S} UTC"
    if column.unit:
        return f"in {column.unit}", counts, ""
    if table.step and step > 0:
        for unit, per in {**_EPOCH, "rows": 1 / table.step}.items():
            if abs(step / per / table.step - 1) < _AGREE:
                return f"in {unit} (by the {1 / table.step:.6g} Hz that the file states)", per, ""
    days = any(a < first < b for a, b in _DAYS)
    if days and 0 < step < _LEAST_STEP:
        return "in days (by its size)", 1 / 86400, ", as spreadsheets count them"
    doubts = ["no unit of measure is stated"]
    doubts += [f"the file states {1 / table.step:.6g} Hz"] if table.step else []
    doubts += ["if it counts rows, state --rate"] if step == 1 else []
    return f"in s ({'; '.join(doubts)})", 1.0, ""
