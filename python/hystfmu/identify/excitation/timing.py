"""Order of input and output in time: lag of the sensor, its dead time, and feedback from the output to the input.

Lag. A sensor that is read before the input is written, or that averages, lags by whole rows. A model without a delay
cannot represent this lag, and the loops become wider with faster inputs. A sum of plays and a cubic is fitted to the
training rows with the input delayed by 0, 1, 2, ... rows. The residual has its minimum at the lag. Dynamics of the
device have the same effect, and creep moves the minimum by a row. So the lag is reported and not removed.

Dead time. With a late sensor or a delay, the output does not respond at first, and then responds fully. Dynamics
respond at once but gradually. Kinks and jumps of the input show the difference: there, the second difference of the
input is a pulse. The response to this pulse follows from a regression: the second differences of y on the second
differences of u, shifted row by row. The weights for shifts with y before u show the effect of chance, noise and
hysteresis. The response begins with the first weight that exceeds these weights at the 5 % level.

Feedback. In open loop the noise of the output does not reach the input. Under feedback the noise reaches the input, and
a fit then attributes the controller to the device (Ljung, System Identification, 2nd ed. 1999, section 13.4). The
residual of the sum of plays and the increments of the input are whitened by linear prediction. Under feedback the
residual of a row is correlated with later increments, and hardly with earlier increments. Rank correlation is used, so
that jumps of a command have little effect. Feedback is not detected if the noise is far below the residual.
"""

from __future__ import annotations

from statistics import NormalDist
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.model.accuracy import rms

PLAYS = 12
MOST_ROWS = 2000  # of a regression: thinned evenly for the lag, consecutive for the feedback
MOST_LAG = 8  # rows
CLEARLY = 1.15  # times the residual without the lag exceeds that with it
FOLLOWED = 0.25  # of the residual with the lag: a model whose error is below follows the lag itself
LEAST = 0.1  # % of the span: the residual that the lag takes away

LEAD, TAIL = 8, 8  # shifts before the answer, and after the lag
CHANCE = 0.05  # of all shifts before the lag together
CLEAR = 5.0  # standard errors of the largest weight, or the record has too few kinks
PART, LEADING = 0.1, 0.25  # of the largest weight: a smaller one is no answer; larger leading ones are a smooth input
ROWS = 20  # per weight, at least

ORDER = 12  # of the prediction
LATER = 10  # rows between residual and increment
SURE = 60.0  # sum of LATER squared normal variables: its mean is 10, and 60 is exceeded once in 3e8
SURELY = 3.0  # times the sum for earlier increments, which a poor model makes as large


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
    """Return the lag of the output in rows, 0 if no lag is relevant, and the result of `residuals`."""
    found = residuals(u, y, train)
    best = int(np.argmin(found))
    clear = found[0] > CLEARLY * found[best] and found[0] - found[best] > LEAST and best < len(found) - 1
    return (best if clear else 0), found


def residuals(u: Array, y: Array, train: slice) -> Array:
    """Return the RMS residual (% of the span of y) of a sum of plays for a lag of 0, 1, ... rows, shape (m,)."""
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
    """Return columns (rows, 16) up to the last training row: a constant, powers of the input up to 3, and plays."""
    u = u[: train.stop]
    x = (u - u[train].mean()) / np.ptp(u[train])
    bank = plays(u, thresholds(u[train], PLAYS), float(u[0]))
    return np.column_stack([np.ones(len(u)), x, x**2, x**3, bank])


def _left(a: Array, y: Array) -> Array:
    """Return what a regression of y on columns leaves."""
    return np.asarray(y - a @ np.linalg.lstsq(a, y, rcond=None)[0])


def dead_time(u: Array, y: Array, late: int) -> int | None:
    """Return the rows before the first response inside a lag of `late` >= 1 rows; None if no kinks show it."""
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
    """Return weights and their standard errors for the input from `LEAD` rows later to late + `TAIL` rows earlier."""
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
    """Return a warning in one line if the record looks like closed-loop data."""
    record = data.longest()
    later, earlier = correlation(record.u, record.y, record.train)
    if later < SURE or later < SURELY * earlier:
        return []
    return [
        "the input follows the error of the output, as in closed-loop data: the fit may take the controller for a part "
        "of the device; record with the loop open, or with an input that does not come from the output"
    ]


def correlation(u: Array, y: Array, train: slice) -> tuple[float, float]:
    """Return the correlation of the residual with later and with earlier increments of the input.

    Returns
    -------
    later, earlier : float
        Sums of squared correlations times the number of rows; each is about 10 without correlation.
    """
    rows = slice(train.start, min(train.stop, train.start + MOST_ROWS))
    if rows.stop - rows.start < 20 * ORDER:
        return 0.0, 0.0
    e = _ranks(_whitened(_left(_columns(u, train)[rows], y[rows])))
    v = _ranks(_whitened(np.diff(u[rows], prepend=u[rows][0])))
    scale = len(e) / float((e @ e) * (v @ v))
    later, earlier = (scale * sum(float(p[:-k] @ q[k:]) ** 2 for k in range(1, LATER + 1)) for p, q in ((e, v), (v, e)))
    return later, earlier


def _whitened(v: Array) -> Array:
    """Return the residual of a linear prediction of v (n,) from previous rows, shape (n - 12,)."""
    v = v - v.mean()
    n = len(v)
    past = np.column_stack([v[ORDER - 1 - j : n - 1 - j] for j in range(ORDER)])
    return np.asarray(v[ORDER:] - past @ np.linalg.lstsq(past, v[ORDER:], rcond=1e-10)[0])


def _ranks(v: Array) -> Array:
    """Return the ranks of v (n,), from -1/2 to 1/2."""
    return np.argsort(np.argsort(v)) / len(v) - 0.5
