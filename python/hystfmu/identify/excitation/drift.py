"""Drift in the training rows: what no model of the input can take, said in percent of the span of y.

The residuals of a fit are averaged over blocks of consecutive rows; a straight line through the averages is the drift,
and the scatter of the averages about it tells how sure it is.  Blocks, because neighbouring residuals of a hysteresis
model are not independent.  Wide plays, which move now and then, hide a part of it: what is found is a lower bound.
Creep is no drift: it follows the input, and models with lags take it.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array

BLOCKS = 20
SURE = 5.0  # standard errors
SAID = 0.5  # percent of the span: less drift is not worth a word


def drift(e: Array) -> tuple[float, float]:
    """Drift from the first row to the last, and its standard error.

    Parameters
    ----------
    e : array, shape (n,)
        Measured minus model, in the unit of y.
    """
    n = min(BLOCKS, len(e) // 2)
    means = np.array([part.mean() for part in np.array_split(e, n)])
    t = (np.arange(n) + 0.5) / n - 0.5
    slope = float(t @ means) / float(t @ t)
    left = means - means.mean() - slope * t
    error = float(np.sqrt(left @ left / max(n - 2, 1) / (t @ t)))
    return slope, error


def warnings(e: Array, span: float) -> list[str]:
    """One sentence where the output drifts, for residuals e (n,) and the span of y; else nothing."""
    total, error = drift(e)
    percent = 100 * total / span
    if abs(percent) < SAID or abs(total) < SURE * error:
        return []
    return [
        f"the output drifts by {percent:+.2g} % of its span or more over the train rows, which no model of the input "
        "takes; take it out of the data, or train on fewer rows"
    ]
