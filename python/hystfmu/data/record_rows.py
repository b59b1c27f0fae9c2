"""Rows of a record: fitted rows, starts of records, checks of values and of time steps, names for messages."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError

LEAST_ROWS = 4
SAME_STEP = 1e-3  # relative difference of the steps of records; rounded times make it
_RANGE = re.compile(r"\s*(\d*)\s*:\s*(\d*)\s*\Z")


def train_rows(train: slice | Sequence[int] | str | None, n: int, where: str = "data") -> slice:
    """Convert training rows, e.g. "first:end", to a slice whose first row and end lie inside 0..n.

    Raises
    ------
    InputError
        The form is wrong, or the rows are fewer than 4 or outside the data.
    """
    if train is None:
        return slice(0, n)
    shown: object = train
    if isinstance(train, str):
        m = _RANGE.match(train)
        if not m:
            raise InputError(f"{where}: The train rows must read first:end, e.g. 2000:4200. Got {train!r} instead.")
        first, end = (int(m[1]) if m[1] else 0), (int(m[2]) if m[2] else n)
    elif isinstance(train, slice):
        shown = f"{train.start}:{train.stop}"
        if any(k is not None and not isinstance(k, (int, np.integer)) for k in (train.start, train.stop)):
            raise InputError(f"{where}: The train rows must be integers. Got {shown} instead.")
        if train.step not in (None, 1):
            raise InputError(f"{where}: The train rows must be consecutive. Got step {train.step} instead.")
        first = 0 if train.start is None else int(train.start)
        end = n if train.stop is None else int(train.stop)
    else:
        if len(train) != 2:
            raise InputError(f"{where}: The train rows must be two, first and end. Got {len(train)} instead.")
        first, end = (int(k) for k in train)
    if not 0 <= first < end <= n or end - first < LEAST_ROWS:
        raise InputError(
            f"{where}: The train rows must be at least {LEAST_ROWS} rows inside 0:{n}. Got {shown} instead."
        )
    return slice(first, end)


def starts_of(starts: Sequence[int], n: int, where: str) -> tuple[int, ...]:
    """Check the first rows of records."""
    found = tuple(int(s) for s in starts)
    if found[:1] != (0,) or any(b - a < LEAST_ROWS for a, b in zip(found, (*found[1:], n), strict=True)):
        raise InputError(
            f"{where}: The starts of records must be rows from 0 on, at least {LEAST_ROWS} apart, before {n}. "
            f"Got {found} instead."
        )
    return found


def check_one_step(t: Array, records: Sequence[slice], where: str) -> None:
    """Check that all records have the same step."""
    steps = [float(t[r][-1] - t[r][0]) / (r.stop - r.start - 1) for r in records]
    for k, step in enumerate(steps):
        if abs(step - steps[0]) > SAME_STEP * steps[0]:
            raise InputError(
                f"{where}: The records must have one step. Got {step:.6g} s in record {k + 1} after "
                f"{steps[0]:.6g} s in the first: resample them (--resample HZ)."
            )


def row_of(where: str, row: int, first: int = 0) -> str:
    """Name a row for a message; the row belongs to a part that begins at row `first`."""
    return f"{where}: row {first + row}"


def line_of(where: str, lines: Sequence[int], row: int) -> str:
    """Name a row of a file for a message, as an editor counts lines."""
    return f"{where}: line {lines[row]}"


def check_finite(column: Array, name: str, place: Callable[[int], str]) -> None:
    """Check that the values (n,) of a column are finite."""
    bad = ~np.isfinite(column)
    if bad.any():
        n = int(np.argmax(bad))
        raise InputError(f"{place(n)}: The {name!r} column must hold finite numbers. Got {column[n]} instead.")


STEP_TOLERANCE = 1e-6  # relative to the step


def check_increasing(t: Array, place: Callable[[int], str]) -> None:
    """Check that the times (n,) increase.

    Parameters
    ----------
    t : array, shape (n,)
        Times (s).
    place : function
        Name of a row, for messages.

    Raises
    ------
    InputError
        The time of a row is not after the time of the row before.
    """
    back = np.diff(t) <= 0
    if back.any():
        n = int(np.argmax(back)) + 1
        hint = " Stamps that are too coarse need the sample rate in Hz (--rate)." if t[n] == t[n - 1] else ""
        raise InputError(f"{place(n)}: The time must increase. Got {t[n]:.12g} after {t[n - 1]:.12g} instead.{hint}")


def check_time(t: Array, place: Callable[[int], str], digits: Callable[[], Array] | None) -> Array:
    """Check that the time has equal steps; replace rounded printed times by the uniform grid.

    Steps may differ by 1e-6 of the step. Printed times may differ from the uniform grid by half a count of the last
    digit, if this count is at most a quarter of the step. Coarser digits could hide a missing sample.

    Parameters
    ----------
    t : array, shape (n,)
        Times (s).
    place : function
        Name of a row, for messages.
    digits : function, optional
        Returns the value (s) of one count in the last printed digit of each time. It is called only if it is needed.

    Returns
    -------
    array, shape (n,)
        The times, or the uniform grid from which the times were rounded.

    Raises
    ------
    InputError
        Times do not increase, or have unequal steps.
    """
    check_increasing(t, place)
    h = float(t[-1] - t[0]) / (len(t) - 1)
    error: Array = np.abs(np.diff(t) - h)
    if (error <= STEP_TOLERANCE * h + 4 * np.spacing(np.abs(t).max())).all():
        return t
    if digits:
        unit = digits()
        grid: Array = t[0] + h * np.arange(len(t))
        slack = STEP_TOLERANCE * h + 0.5 * unit + 0.5 * max(unit[0], unit[-1])
        if unit.max() <= h / 4 and (np.abs(t - grid) <= slack).all():
            return grid
    n = int(np.argmax(error)) + 1
    raise InputError(
        f"{place(n)}: The time must increase in equal steps (to 1e-6 of the step, or to the digits printed). "
        f"Got a step of {t[n] - t[n - 1]:.9g} s, the mean is {h:.9g} s: resample on request (--resample)."
    )
