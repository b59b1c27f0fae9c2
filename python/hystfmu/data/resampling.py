"""Resampling of uneven steps to a fixed rate, on request only: linear interpolation, turning points kept, no gaps.

Linear interpolation adds no information, but it cuts a turning point that lies between two new rows, and extrema are
what hysteresis remembers.  So the new row nearest to a turning point of u takes the measured values of that point.  Its
time error is at most half a step, at a point where u is stationary.  There is no low-pass filter: choose a rate near
that of the data.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data.record_rows import train_rows
from hystfmu.data.reversals import reversals
from hystfmu.data.time_grid import check_increasing

GAP = 2.5  # median steps: one lost sample is bridged, two are not
FASTER = 2.0  # times the mean rate of the data: a higher rate would make rows without a measurement near them


def resample(
    t: Array, u: Array, y: Array, rate: float | None, where: str, place: Callable[[int], str] | None = None
) -> tuple[Array, Array, Array]:
    """Resample to even steps.

    Parameters
    ----------
    t, u, y : array, shape (n,)
        Time (s), strictly increasing; input; output, NaN where none was measured.
    rate : float or None
        New rate (Hz); None takes one over the median step.
    where : str
        Name of the data, for messages.
    place : function, optional
        Name of a data row, for messages; default "where: row k".

    Returns
    -------
    t, u, y : array, shape (m,)
        From the first time to the last one, or at most one step less.

    Raises
    ------
    InputError
        A gap longer than 2.5 median steps; a rate that is not positive or above twice the mean rate.
    """
    steps = np.diff(t)
    median, mean = float(np.median(steps)), float(t[-1] - t[0]) / len(steps)
    n = int(np.argmax(steps))
    if steps[n] > GAP * median:
        at = place(n + 1) if place else f"{where}: row {n + 1}"
        raise InputError(
            f"{at}: The gap between two samples must be at most {GAP} median steps of {median:.6g} s when resampling. "
            f"Got {steps[n]:.6g} s instead: split the data there."
        )
    rate = 1 / median if rate is None else rate
    if not (np.isfinite(rate) and 0 < rate <= FASTER / mean):
        raise InputError(
            f"{where}: The rate to resample to must be above 0 and at most {FASTER:g} times the {1 / mean:.6g} Hz of "
            f"the data. Got {rate:g} instead."
        )
    grid: Array = t[0] + np.arange(int((t[-1] - t[0]) * rate * (1 + 1e-12)) + 1) / rate
    u_new, y_new = np.interp(grid, t, u), np.interp(grid, t, y)
    turns = reversals(u)
    nearest = np.clip(np.rint((t[turns] - t[0]) * rate).astype(int), 0, len(grid) - 1)
    u_new[nearest], y_new[nearest] = u[turns], y[turns]
    return grid, u_new, y_new


def resample_rows(
    t: Array, u: Array, y: Array, rows: slice, rate: float | None, where: str, place: Callable[[int], str]
) -> tuple[Array, Array, Array, slice]:
    """Resample as `resample` does, and carry rows of the data over.

    Parameters
    ----------
    t, u, y, rate, where, place
        As of `resample`; t need not increase.
    rows : slice
        Rows of the data.

    Returns
    -------
    t, u, y : array, shape (m,)
    rows : slice
        New rows that cover the time of the old ones.

    Raises
    ------
    InputError
        Times that do not increase, or what `resample` refuses; fewer than 4 rows are left.
    """
    check_increasing(t, place)
    new, u, y = resample(t, u, y, rate, where, place)
    first, end = np.searchsorted(new, t[rows][[0, -1]] + [-1e-9, 1e-9] * np.diff(new[:2]))
    return new, u, y, train_rows((int(first), int(end)), len(new), f"{where}, resampled")
