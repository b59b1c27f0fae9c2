"""Time of a table in s: from its column, by the unit of measure or the size of epoch stamps, or from a stated step."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data.reader.measures import TIME
from hystfmu.data.reader.table import Column, Table

_YEARS = (9e8, 4.2e9)  # s since 1970, of 1998 and of 2103: no other unit of measure has stamps of the size
_DAYS = ((20e3, 80e3), (7.1e5, 7.7e5))  # days since 1900 and since the year 0, of the last and of this century
_LEAST_STEP = 1e-6  # s: times of that size are no seconds if their steps are shorter
_AGREE = 0.01  # relative difference of two statements of one step
_EPOCH = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}  # counts in a second


@dataclass(frozen=True)
class Clock:
    """Times of the rows.

    Parameters
    ----------
    t : array, shape (n,)
        Times (s).
    digits : function, optional
        Returns the value (s) of one count of the last digit of each time; None for times that are uniform by
        construction.
    said : str
        Unit of measure, and the assumptions.
    """

    t: Array
    digits: Callable[[], Array] | None
    said: str


def clock_of(table: Table, k: int | None, rate: float | None, n: int, numbers: Array) -> Clock:
    """Return the times of `n` rows.

    Parameters
    ----------
    table : Table
    k : int or None
        Column of the time; None without one.
    rate : float, optional
        Sample rate (Hz), which the time column does not change.
    n : int
        Rows.
    numbers : array, shape (n,)
        The numbers of the column, if it is one of numbers.

    Raises
    ------
    InputError
        A column that is not a time; a unit of measure that does not fit the stamps.
    """
    rows: Array = np.arange(n, dtype=np.float64)
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
    step = float(numbers[-1] - numbers[0]) / (n - 1) if n > 1 else 0.0
    said, counts, first = _scale(table, column, float(numbers[0]) if n else 0.0, step)
    t = numbers if not first else table.source.since(k)
    scaled: Array = t / counts
    return Clock(scaled, lambda: table.source.digits(k) / counts, f"{said}{first}")


def _scale(table: Table, column: Column, first: float, step: float) -> tuple[str, float, str]:
    """Find the unit of measure of times: text for the reader, counts per second, and for stamps their origin."""
    sized = next((u for u, per in _EPOCH.items() if _YEARS[0] * per <= first < _YEARS[1] * per), "")
    counts, seconds = TIME[column.unit or sized or "s"]
    counts = counts / seconds
    if sized and first / counts >= _YEARS[1]:
        raise InputError(
            f"{table.where}The {column.name!r} column must be a time in {column.unit}. Got {first:.12g}, the size of "
            f"{sized} since 1970: correct the heading, or give the sample rate in Hz (--rate)."
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
