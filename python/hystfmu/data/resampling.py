"""Unevenly sampled rows onto even steps, on request only: straight lines between rows, turning points kept, no gaps.

A straight line between two rows invents nothing that the rows do not say, but it cuts a turning point that lies between
two new rows, and an extremum is what hysteresis remembers.  So the new row nearest to a turning point of u takes its
values as they were measured: it is late or early by at most half a step, where u stands still.  There is no low-pass:
take the rate near that of the data.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data.reversals import reversals

GAP = 2.5  # median steps: one lost sample is bridged, two are not
FASTER = 2.0  # times the mean rate of the rows: more would be rows without a measurement near them


def resample(t: Array, u: Array, y: Array, rate: float | None, where: str) -> tuple[Array, Array, Array]:
    """Rows at even steps.

    Parameters
    ----------
    t, u, y : array, shape (n,)
        Time in s, strictly increasing; input; output, NaN where none was measured.
    rate : float or None
        New rate in Hz; None: one over the median step.
    where : str
        Name of the data, for messages.

    Returns
    -------
    t, u, y : array, shape (m,)
        From the first time on, to the last one or up to a step less.

    Raises
    ------
    InputError
        A step longer than 2.5 median steps; a rate that is not in reach.
    """
    steps = np.diff(t)
    median, mean = float(np.median(steps)), float(t[-1] - t[0]) / len(steps)
    n = int(np.argmax(steps))
    if steps[n] > GAP * median:
        raise InputError(
            f"{where}: row {n + 1}: a gap of {steps[n]:.6g} s; at most {GAP} median steps of {median:.6g} s are "
            "bridged when resampling: split the data there"
        )
    rate = 1 / median if rate is None else rate
    if not (np.isfinite(rate) and 0 < rate <= FASTER / mean):
        raise InputError(
            f"{where}: the rate to resample to must be above 0 and at most {FASTER:g} times the {1 / mean:.6g} Hz of "
            f"the data; got {rate:g}"
        )
    grid: Array = t[0] + np.arange(int((t[-1] - t[0]) * rate * (1 + 1e-12)) + 1) / rate
    u_new, y_new = np.interp(grid, t, u), np.interp(grid, t, y)
    turns = reversals(u)
    nearest = np.clip(np.rint((t[turns] - t[0]) * rate).astype(int), 0, len(grid) - 1)
    u_new[nearest], y_new[nearest] = u[turns], y[turns]
    return grid, u_new, y_new
