"""Records that look like closed-loop data: the input follows the error of the output.

In open loop the noise of the output does not reach the input. Under feedback the noise reaches the input, and a fit
then attributes the controller to the device (Ljung, System Identification, 2nd ed. 1999, section 13.4). The test
computes the residual of a sum of plays and a cubic. The residual and the increments of the input are whitened by linear
prediction. Under feedback the residual of a row is correlated with later increments, and hardly with earlier
increments. Rank correlation is used, so that jumps of a command have little effect. Feedback is not detected if the
noise is far below the error of the sum of plays.
"""

from __future__ import annotations

import numpy as np
from threadpoolctl import threadpool_limits

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.identify.excitation.sensor_lag import columns

MOST_ROWS = 2000  # consecutive training rows that are looked at
ORDER = 12  # of the prediction
LATER = 10  # rows between residual and increment
SURE = 60.0  # sum of LATER squared normal variables: its mean is 10, and 60 is exceeded once in 3e8
CLEARLY = 3.0  # times the sum for earlier increments, which a poor model makes as large


def correlation(data: Dataset) -> tuple[float, float]:
    """Return the correlation of the residual with later and with earlier increments of the input.

    Returns
    -------
    later, earlier : float
        Sums of squared correlations times the number of rows; each is about 10 without correlation.
    """
    data = data.longest()
    first = data.train.start
    rows = slice(first, min(data.train.stop, first + MOST_ROWS))
    if rows.stop - rows.start < 20 * ORDER:
        return 0.0, 0.0
    with threadpool_limits(1):
        a, y = columns(data)[rows], data.y[rows]
        e = _ranks(_whitened(y - a @ np.linalg.lstsq(a, y, rcond=None)[0]))
        v = _ranks(_whitened(np.diff(data.u[rows], prepend=data.u[rows][0])))
    scale = len(e) / float((e @ e) * (v @ v))
    later, earlier = (scale * sum(float(p[:-k] @ q[k:]) ** 2 for k in range(1, LATER + 1)) for p, q in ((e, v), (v, e)))
    return later, earlier


def warnings(data: Dataset) -> list[str]:
    """Return a warning in one line if the record looks like closed-loop data."""
    later, earlier = correlation(data)
    if later < SURE or later < CLEARLY * earlier:
        return []
    return [
        "the input follows the error of the output, as in closed-loop data: the fit may take the controller for a part "
        "of the device; record with the loop open, or with an input that does not come from the output"
    ]


def _whitened(v: Array) -> Array:
    """Return the residual of a linear prediction of v (n,) from previous rows, shape (n - 12,)."""
    v = v - v.mean()
    n = len(v)
    past = np.column_stack([v[ORDER - 1 - j : n - 1 - j] for j in range(ORDER)])
    return np.asarray(v[ORDER:] - past @ np.linalg.lstsq(past, v[ORDER:], rcond=1e-10)[0])


def _ranks(v: Array) -> Array:
    """Return the ranks of v (n,), from -1/2 to 1/2."""
    return np.argsort(np.argsort(v)) / len(v) - 0.5
