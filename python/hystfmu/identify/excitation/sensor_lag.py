"""Lag of the sensor: delay of the output in whole rows.

A sensor that is read before the input is written, or that averages, lags by whole rows. A model without a delay cannot
represent this lag, and the loops become wider with faster inputs. A sum of plays and a cubic is fitted to the training
rows with the input delayed by 0, 1, 2, ... rows. The residual has its minimum at the lag. Dynamics of the device have
the same effect, and creep moves the minimum by a row. So the lag is reported and not removed. Kinks of the input show
how much of the lag is dead time (`hystfmu.identify.excitation.dead_time`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.identify.excitation.dead_time import dead_time
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.model.accuracy import rms

MOST_LAG = 8  # rows
PLAYS = 12
MOST_ROWS = 2000  # of the regression; more are thinned evenly
CLEARLY = 1.15  # times the residual without the lag exceeds that with it
FOLLOWED = 0.25  # of the residual with the lag: a model whose error is below follows the lag itself
LEAST = 0.1  # % of the span: the residual that the lag takes away


def columns(data: Dataset) -> Array:
    """Return columns (rows, 16) up to the last training row: a constant, powers of the input up to 3, and plays."""
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
    """Return the lag of the output in rows, 0 if no lag is relevant, and the result of `residuals`."""
    found = residuals(data)
    best = int(np.argmin(found))
    clear = found[0] > CLEARLY * found[best] and found[0] - found[best] > LEAST and best < len(found) - 1
    return (best if clear else 0), found


def told(data: Dataset, error: float) -> tuple[dict[str, Any], list[str]]:
    """Return the entries of a fit about the lag, and a warning with the remedy unless the model represents it.

    Parameters
    ----------
    data : Dataset
        Training data.
    error : float
        RMS residual of the model in percent of the span.

    Returns
    -------
    dict
        ``lag_rows``: the lag. ``dead_rows``: the part of the lag that is dead time, if the record shows this part.
        ``lag``: a text with these numbers. Empty without a lag.
    list of str
        The warning, if any.
    """
    rows, found = lag(data)
    if not rows:
        return {}, []
    record = data.longest()
    dead = dead_time(record, rows)
    words = f"the output lags the input by about {_rows(rows)}, {rows * data.h:.4g} s"
    if dead is not None:
        sharpest = int(np.argmax(np.abs(np.diff(record.u, 2)))) + 1
        words += f", of which {_rows(dead)} dead time: kinks of the input, such as that at row {sharpest}, show "
        words += "no answer before" if dead else "an answer at once"
    noted: dict[str, Any] = {"lag_rows": rows, **({} if dead is None else {"dead_rows": dead}), "lag": words}
    if error < FOLLOWED * found[rows]:
        return noted, []
    late = f"if the sensor is late, align the record with --lag {dead or rows}; if the device is, "
    return noted, [
        f"{words} (a sum of plays leaves {found[rows]:.2g} % of the span with that lag, {found[0]:.2g} % without): "
        f"{late * (dead != 0)}take a kind of model with {'dynamics' if dead == 0 else 'a delay'}"
    ]


def _rows(count: int) -> str:
    return f"{count} row{'s' * (count != 1)}"
