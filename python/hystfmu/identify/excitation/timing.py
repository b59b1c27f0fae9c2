"""Timing of input and output in a record: lag of the output, dead time, and feedback from the output to the input.

Lag. The measured output lags by whole rows if the sensor is read before the input is written, or if the sensor averages
several samples. A model without a delay cannot represent this lag: the measured loops become wider with faster inputs.
To find the lag, a sum of plays and a cubic polynomial is fitted to the training rows, with the input delayed by 0, 1,
2, ... rows. The residual has its minimum at the lag. Dynamics of the device have the same effect, and creep can move
the minimum by one row. Therefore the lag is reported but not removed.

Dead time. A late sensor or a delay causes a dead time, during which the output does not respond to the input at all.
With dynamics, the output responds at once, but gradually. Kinks and jumps of the input show the difference, because the
second difference of the input is a pulse at a kink or a jump. The response to this pulse is estimated by a regression
of the second differences of y on shifted second differences of u. If y precedes u, the weight is only an effect of
chance, noise and hysteresis. The dead time ends at the first shift whose weight is significantly larger than the
weights with y before u (5 % level).

Feedback. Without feedback, noise of the output does not affect the input. With feedback it does, and a fit would
attribute properties of the controller to the device (Ljung, System Identification, 2nd ed. 1999, section 13.4). To
detect feedback, the residual of the sum of plays and the increments of the input are whitened by linear prediction.
With feedback, the residual of a row is correlated with the next increments, and much less with earlier and with much
later increments. A poor model of a device with a regular input, such as tones, is correlated with all of them. Rank
correlation is used, so that jumps of a reference have little effect. Feedback cannot be detected if the noise is much
smaller than the residual.
"""

from statistics import NormalDist
from typing import Any

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.model import rms

PLAYS = 12
MOST_ROWS = 2000  # maximum number of rows: thinned evenly for the lag, consecutive rows for the feedback
MOST_LAG = 8  # largest lag (rows)
CLEARLY = 1.15  # required ratio of the residuals without and with the lag
FOLLOWED = 0.25  # a model with an error below this share of the residual with the lag represents the lag
LEAST = 0.1  # required reduction of the residual by the lag (% of the span)

LEAD, TAIL = 8, 8  # number of shifts for which y precedes u, and number of shifts after the lag
CHANCE = 0.05  # total false-alarm probability of all shifts up to the largest weight
CLEAR = 5.0  # required ratio of the largest weight to its standard error; otherwise the record has too few kinks
# a weight below the share PART of the largest weight is no response; if the RMS of the weights with y before u exceeds
# the share LEADING, the input is smooth and shows no dead time
PART, LEADING = 0.1, 0.25
ROWS = 20  # minimum number of rows per weight

ORDER = 12  # order of the linear prediction
LATER = 10  # largest number of rows between residual and increment
SURE = 60.0  # limit of a sum of LATER squared normal variables, whose mean is 10; chance exceeds it once in 3e8 records
SURELY = 3.0  # required ratio to the sums for other shifts, because a poor model increases all sums
FIRSTS = range(1, 10 * LATER, LATER)  # first shifts of the sums


def told(data: Dataset, error: float) -> tuple[dict[str, Any], list[str]]:
    """Return the lag of the output that a record shows, and a warning if the model does not represent this lag.

    Parameters
    ----------
    data : Dataset
        Data to which the model is fitted.
    error : float
        RMS residual of the model in percent of the span.

    Returns
    -------
    dict
        Entries for ``fit`` of the model: the lag ``lag_rows`` (rows), the text ``lag``, and the part of the lag that is
        dead time, ``dead_rows`` (rows), if the record shows this part. The dict is empty if there is no lag.
    list of str
        The warning, which also states a remedy. The list is empty if no warning is needed.
    """
    record = data.longest()
    rows, found = lag(record.u, record.y, record.train)
    if not rows:
        return {}, []
    dead = dead_time(record.u, record.y, rows)
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


def lag(u: Array, y: Array, train: slice) -> tuple[int, Array]:
    """Return the lag of the output in rows, which is 0 if it is not significant, and the result of `residuals`."""
    found = residuals(u, y, train)
    best = int(np.argmin(found))
    clear = found[0] > CLEARLY * found[best] and found[0] - found[best] > LEAST and best < len(found) - 1
    return (best if clear else 0), found


def residuals(u: Array, y: Array, train: slice) -> Array:
    """Return the RMS residual (m,) of a sum of plays, in % of the span of y, for lags of 0, 1, ..., m - 1 rows."""
    first, end = train.start, train.stop
    most = min(MOST_LAG, (end - first) // 10)
    if most < 1 or end - first < 4 * PLAYS:
        return np.zeros(1)
    table = _columns(u, train)
    asked = np.arange(max(first, most), end)[:: -(-(end - first) // MOST_ROWS)]

    def residual(late: int) -> float:
        return rms(_left(table[asked - late], y[asked]))

    found = [residual(0), residual(1)]
    while len(found) <= most and found[-1] < found[-2]:
        found.append(residual(len(found)))
    return 100 * np.array(found) / float(np.ptp(y[train]))


def _columns(u: Array, train: slice) -> Array:
    """Return the regressors (n, 16) up to the last training row: a constant, u, u^2, u^3 and the outputs of 12 plays.

    The input is first centred and divided by its span.
    """
    u = u[: train.stop]
    x = (u - u[train].mean()) / np.ptp(u[train])
    bank = plays(u, thresholds(u[train], PLAYS), float(u[0]))
    return np.column_stack([np.ones(len(u)), x, x**2, x**3, bank])


def _left(a: Array, y: Array) -> Array:
    """Return the residual (n,) of the least-squares regression of y (n,) on the columns of a (n, m)."""
    return np.asarray(y - a @ np.linalg.lstsq(a, y, rcond=None)[0])


def dead_time(u: Array, y: Array, late: int) -> int | None:
    """Return the dead time (rows) within a lag of `late` >= 1 rows; None if kinks of the input do not show it."""
    w, error = answer(u, y, late)
    lead, w, error = w[:LEAD], w[LEAD:], error[LEAD:]
    most = int(np.argmax(w))
    smooth = np.sqrt(np.mean(lead**2)) > LEADING * w[most]
    if smooth or most > late + 1 or w[most] < CLEAR * error[most]:
        return None
    limit = NormalDist().inv_cdf(1 - CHANCE / max(most, 1))
    begun = (w >= limit * error) & (w >= PART * w[most])
    return int(np.argmax(begun))


def answer(u: Array, y: Array, late: int) -> tuple[Array, Array]:
    """Return the response of y to a pulse, from the second differences of u and y, and its standard errors.

    The response begins `LEAD` rows before the pulse and ends `late` + `TAIL` rows after it. If the response before the
    pulse is larger than its standard errors, all standard errors are multiplied by the RMS of this ratio.
    """
    du, dy = np.diff(u, 2), np.diff(y, 2)
    last = late + TAIL
    end = len(du) - LEAD
    if end - last < ROWS * (LEAD + last + 1):
        return np.zeros(LEAD + last + 1), np.ones(LEAD + last + 1)
    shifted = np.column_stack([du[last - k : end - k] for k in range(-LEAD, last + 1)])
    inverse = np.linalg.pinv(shifted.T @ shifted)
    w = inverse @ (shifted.T @ dy[last:end])
    sigma = np.sqrt(np.mean((dy[last:end] - shifted @ w) ** 2) * np.diag(inverse))
    chance = np.sqrt(np.mean((w[:LEAD] / np.maximum(sigma[:LEAD], 1e-300)) ** 2))
    return w, sigma * max(chance, 1.0)


def feedback(data: Dataset) -> list[str]:
    """Return a warning if the input depends on the noise of the output, as in a closed loop."""
    record = data.longest()
    later, other = correlation(record.u, record.y, record.train)
    if later < SURE or later < SURELY * other:
        return []
    return [
        "the input follows the error of the output, as in closed-loop data: the fit may take the controller for a part "
        "of the device; record with the loop open, or with an input that does not come from the output"
    ]


def correlation(u: Array, y: Array, train: slice) -> tuple[float, float]:
    """Return the correlation of the residual of plays with the next increments of the input, and with others.

    Returns
    -------
    later, other : float
        Sums of squared rank correlations over `LATER` shifts, times the number of rows: over the shifts to the next
        increments, and the largest sum over earlier or much later increments. For independent signals, a sum is about
        10.
    """
    rows = slice(train.start, min(train.stop, train.start + MOST_ROWS))
    if rows.stop - rows.start < 20 * ORDER:
        return 0.0, 0.0
    e = _ranks(_whitened(_left(_columns(u, train)[rows], y[rows])))
    v = _ranks(_whitened(np.diff(u[rows], prepend=u[rows][0])))
    scale = len(e) / float((e @ e) * (v @ v))
    blocks = [
        [scale * sum(float(p[:-k] @ q[k:]) ** 2 for k in range(first, first + LATER)) for first in FIRSTS]
        for p, q in ((e, v), (v, e))
    ]
    return blocks[0][0], max(blocks[0][1:] + blocks[1])


def _whitened(v: Array) -> Array:
    """Return the error (n - 12,) of a linear prediction of v (n,) from its previous 12 values."""
    v = v - v.mean()
    n = len(v)
    past = np.column_stack([v[ORDER - 1 - j : n - 1 - j] for j in range(ORDER)])
    return np.asarray(v[ORDER:] - past @ np.linalg.lstsq(past, v[ORDER:], rcond=1e-10)[0])


def _ranks(v: Array) -> Array:
    """Return the ranks of the values v (n,), scaled to the range from -1/2 to 1/2."""
    return np.argsort(np.argsort(v)) / len(v) - 0.5
