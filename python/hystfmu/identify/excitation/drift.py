"""Drift of the output over the training rows, which no model of the input can represent.

The residuals of a fit are averaged over chunks of consecutive rows. The slope of a straight line through the averages
is the drift. The scatter of the averages about this line gives the standard error of the drift. Averages are used
because neighbouring residuals of a hysteresis model are not independent. Wide plays, which move rarely, absorb part of
the drift, so the result is a lower bound. Creep is not drift: creep follows the input, and models with lags represent
creep.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array

CHUNKS = 20
SURE = 5.0  # standard errors that a reported drift must exceed
SAID = 0.5  # percent of the span: smaller drift is not reported


def drift(e: Array) -> tuple[float, float]:
    """Estimate the drift from the first row to the last and its standard error.

    Parameters
    ----------
    e : array, shape (n,)
        Measured minus model.

    Returns
    -------
    total, error : float
        Drift and standard error, in the unit of measure of e.
    """
    n = min(CHUNKS, len(e) // 2)
    means = np.array([part.mean() for part in np.array_split(e, n)])
    t = (np.arange(n) + 0.5) / n - 0.5
    slope = float(t @ means) / float(t @ t)
    left = means - means.mean() - slope * t
    error = float(np.sqrt(left @ left / max(n - 2, 1) / (t @ t)))
    return slope, error


def warnings(e: Array, span: float) -> list[str]:
    """Return a warning if the output drifts, for residuals e (n,) and the span of y; else an empty list."""
    total, error = drift(e)
    percent = 100 * total / span
    if abs(percent) < SAID or abs(total) < SURE * error:
        return []
    return [
        f"the output drifts by {percent:+.2g} % of its span or more over the train rows, which no model of the input "
        "represents; remove the drift from the data, or train on fewer rows"
    ]
