"""Check of equal time steps: tolerance for rounded printed times, and an error for the first row outside it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError

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
        The time of a row is not after that of the row before.
    """
    back = np.diff(t) <= 0
    if back.any():
        n = int(np.argmax(back)) + 1
        hint = " Stamps that are too coarse need the sample rate in Hz (--rate)." if t[n] == t[n - 1] else ""
        raise InputError(f"{place(n)}: The time must increase. Got {t[n]:.12g} after {t[n - 1]:.12g} instead.{hint}")


def check_time(t: Array, place: Callable[[int], str], digits: Callable[[], Array] | None) -> Array:
    """Check that the time has equal steps; correct rounded printed times to the uniform grid.

    Steps may differ by 1e-6 of the step.  Printed times may instead differ from the even grid by half a count of their
    last digit, if that count is at most a quarter of the step: coarser digits could hide a missing sample.

    Parameters
    ----------
    t : array, shape (n,)
        Times (s).
    place : function
        Name of a row, for messages.
    digits : function, optional
        Returns the value (s) of one count in the last printed digit of each time; called only if it matters.

    Returns
    -------
    array, shape (n,)
        The times, or the even grid that they are rounded from.

    Raises
    ------
    InputError
        Times that do not increase, or not in equal steps.
    """
    check_increasing(t, place)
    h, error = _step_error(t)
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


def _step_error(t: Array) -> tuple[float, Array]:
    h = float(t[-1] - t[0]) / (len(t) - 1)
    error: Array = np.abs(np.diff(t) - h)
    return h, error
