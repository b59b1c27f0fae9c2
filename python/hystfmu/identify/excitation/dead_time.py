"""Dead time: rows without any response of the output to kinks and jumps of the input.

A lag has two parts. Dynamics respond at once but gradually. With a late sensor or a delay, the output does not respond
at first, and then responds fully. A smooth input does not distinguish the two parts. At kinks and jumps of the input
its second difference is a pulse. The response to this pulse follows from a regression: the second differences of y on
the second differences of u, shifted row by row. The weights for shifts with y before u show the effect of chance, noise
and hysteresis. The response begins with the first weight that exceeds these weights at the 5 % level.
"""

from __future__ import annotations

from statistics import NormalDist

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset

LEAD, TAIL = 8, 8  # shifts before the answer, and after the lag
CHANCE = 0.05  # of all shifts before the lag together
CLEAR = 5.0  # standard errors of the largest weight, or the record has too few kinks
PART, LEADING = 0.1, 0.25  # of the largest weight: a smaller one is no answer; larger leading ones are a smooth input
ROWS = 20  # per weight, at least


def answer(data: Dataset, lag: int) -> tuple[Array, Array]:
    """Return weights and their standard errors for the input from `LEAD` rows later to lag + `TAIL` rows earlier."""
    du, dy = np.diff(data.u, 2), np.diff(data.y, 2)
    last = lag + TAIL
    end = len(du) - LEAD
    if end - last < ROWS * (LEAD + last + 1):
        return np.zeros(LEAD + last + 1), np.ones(LEAD + last + 1)
    shifted = np.column_stack([du[last - k : end - k] for k in range(-LEAD, last + 1)])
    inverse = np.linalg.pinv(shifted.T @ shifted)
    w = inverse @ (shifted.T @ dy[last:end])
    sigma = np.sqrt(np.mean((dy[last:end] - shifted @ w) ** 2) * np.diag(inverse))
    chance = np.sqrt(np.mean((w[:LEAD] / np.maximum(sigma[:LEAD], 1e-300)) ** 2))
    return w, sigma * max(chance, 1.0)


def dead_time(data: Dataset, lag: int) -> int | None:
    """Find the dead time inside a lag.

    Parameters
    ----------
    data : Dataset
        One record. All rows are used, also rows outside the training rows.
    lag : int
        Rows by which the output lags the input, at least 1.

    Returns
    -------
    int or None
        Rows before the first response; None if the kinks of the input do not show it.
    """
    w, error = answer(data, lag)
    lead, w, error = w[:LEAD], w[LEAD:], error[LEAD:]
    most = int(np.argmax(w))
    smooth = np.sqrt(np.mean(lead**2)) > LEADING * w[most]
    if smooth or most > lag + 1 or w[most] < CLEAR * error[most]:
        return None
    limit = NormalDist().inv_cdf(1 - CHANCE / max(most, 1))
    begun = (w >= limit * error) & (w >= PART * w[most])
    return int(np.argmax(begun))
