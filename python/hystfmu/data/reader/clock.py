"""Time of a table in s: from its column, by the unit of measure or the size of epoch stamps, or from a stated step."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data.reader.measures import TIME
from hystfmu.data.reader.table import Table

_YEARS = (9e8, 4.2e9)  # s since 1970, of 1998 and of 2103: no other unit of measure has stamps of the size
_EXCEL = (20e3, 80e3)  # days since 1900, of 1954 and of 2119
_EPOCH = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}  # counts in a second


@dataclass(frozen=True)
class Clock:
    """Times of the rows.

    Parameters
    ----------
    t : array, shape (n,)
        Times (s).
    digits : function, optional
        Returns the value (s) of one count of the last digit of each; None for times that are even as they are made.
    said : str
        Unit of measure, and what was assumed.
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
    numbers : array, shape (n,)
        The numbers of the column, if it is one of numbers.

    Raises
    ------
    InputError
        A column that is no time; a unit of measure in which stamps make no sense.
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
    t: Array = numbers
    sized = next((u for u, per in _EPOCH.items() if _YEARS[0] * per <= t[0] < _YEARS[1] * per), "") if len(t) else ""
    counts, seconds = TIME[column.unit or sized or "s"]
    if sized and column.unit and t[0] / counts * seconds >= _YEARS[1]:
        raise InputError(
            f"{table.where}The {column.name!r} column must be a time in {column.unit}. Got {t[0]:.12g}, the size of "
            f"{sized} since 1970: correct the heading, or give the sample rate in Hz (--rate)."
        )
    said = f"in {column.unit}" if column.unit else f"in {sized} (by its size)" if sized else _guessed(table, t)
    if sized and _YEARS[0] <= t[0] / counts * seconds:
        start = datetime.datetime.fromtimestamp(t[0] / counts * seconds, datetime.UTC)
        t, said = table.source.since(k), f"{said} since 1970, from {start:%Y-%m-%d %H:%M:%S} UTC"
    scaled: Array = t / counts * seconds
    return Clock(scaled, lambda: table.source.digits(k) / counts * seconds, said)


def _guessed(table: Table, t: Array) -> str:
    """Say that seconds are assumed, and what speaks against them."""
    doubts = ["no unit of measure is stated"]
    if len(t) > 1 and t[-1] > t[0]:
        step = float(t[-1] - t[0]) / (len(t) - 1)
        if table.step and abs(step / table.step - 1) > 0.01:
            doubts.append(f"the header states {1 / table.step:.6g} Hz")
        elif step == 1 and (np.diff(t) == 1).all():
            doubts.append("a step of 1: if it counts rows, state --rate")
        elif _EXCEL[0] < t[0] < _EXCEL[1] and t[-1] - t[0] < 1:
            doubts.append("if it counts days, as Excel does, state --rate")
    return f"in s ({'; '.join(doubts)})"
