"""Lag of the sensor: whole rows by which the output follows the input late.

A sensor that is read before the input is written, or that averages, lags by whole rows.  No model without a delay can
follow it, and its loops look the wider the faster the input.  A sum of plays and a cubic, fitted to the training rows
for the input delayed by 0, 1, 2, ... rows, shows it: the residual has its minimum at the lag.  Dynamics of the device
look the same, and creep moves the minimum by a row, so the lag is reported and not removed.
"""

from __future__ import annotations

import numpy as np
from threadpoolctl import threadpool_limits

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.model.accuracy import rms

MOST_LAG = 8  # rows
PLAYS = 12
MOST_ROWS = 2000  # of the regression; more are thinned evenly
CLEARLY = 1.15  # times the residual without the lag exceeds that with it
FOLLOWED = 0.25  # of the residual with the lag: a model whose error is below follows the lag itself
LEAST = 0.1  # % of the span: the residual that the lag takes away


def columns(data: Dataset) -> Array:
    """Return a constant, the powers of the input to the third, and plays, up to the last training row; (rows, 16)."""
    rows = data.train
    u = data.u[: rows.stop]
    x = (u - u[rows].mean()) / np.ptp(u[rows])
    bank = plays(u, thresholds(u[rows], PLAYS), float(u[0]))
    return np.column_stack([np.ones(len(u)), x, x**2, x**3, bank])


def residuals(data: Dataset) -> Array:
    """Return the RMS residual (% of the span of y) of a sum of plays for a lag of 0, 1, ... rows, shape (m,)."""
    data = data.longest()
    rows = data.train
    first, end = rows.start, rows.stop
    most = min(MOST_LAG, (end - first) // 10)
    if most < 1 or end - first < 4 * PLAYS:
        return np.zeros(1)
    table = columns(data)
    asked = np.arange(max(first, most), end)[:: -(-(end - first) // MOST_ROWS)]
    y = data.y[asked]

    def residual(lag: int) -> float:
        a = table[asked - lag]
        return rms(y - a @ np.linalg.lstsq(a, y, rcond=None)[0])

    with threadpool_limits(1):
        found = [residual(0), residual(1)]
        while len(found) <= most and found[-1] < found[-2]:
            found.append(residual(len(found)))
    return 100 * np.array(found) / data.span


def lag(data: Dataset) -> tuple[int, Array]:
    """Find the lag of the output in rows, 0 if there is none that matters; return it with `residuals`."""
    found = residuals(data)
    best = int(np.argmin(found))
    clear = found[0] > CLEARLY * found[best] and found[0] - found[best] > LEAST and best < len(found) - 1
    return (best if clear else 0), found


def told(data: Dataset, error: float) -> tuple[int, list[str]]:
    """Return the lag in rows, and a warning with the remedy unless the model follows it.

    Parameters
    ----------
    data : Dataset
        Training data.
    error : float
        RMS residual of the model in percent of the span.
    """
    rows, found = lag(data)
    if not rows or error < FOLLOWED * found[rows]:
        return rows, []
    plural = "s" * (rows > 1)
    return rows, [
        f"the output lags the input by about {rows} row{plural}, {rows * data.h:.4g} s (a sum of plays leaves "
        f"{found[rows]:.2g} % of the span with that lag, {found[0]:.2g} % without): if the sensor is late, align the "
        f"record with --lag {rows}; if the device is, take a kind of model with a delay"
    ]
