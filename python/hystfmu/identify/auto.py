"""Which class of hysteresis is it?  Fit every method on the first part of the training rows, judge it on the rest.

A sum of plays returns to its path after a minor loop, a Bouc-Wen operator does not, and neither follows the other to
better than some percent: the error on rows that were not fitted separates them by orders of magnitude.  The split only
chooses; it is no measure of what the model does on another kind of signal.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hystfmu.data import Dataset
from hystfmu.identify.options import Option

OPTIONS: tuple[Option, ...] = ()
CANDIDATES = ("prandtl_ishlinskii", "prandtl_ishlinskii_asym", "zhao_tan_mlp", "play_bank_mlp", "bouc_wen")
SHARE = 0.7
AS_GOOD = 1.05  # within 5 % of the best, the first in the list (the simpler one) is taken


def choose(data: Dataset, seed: int, progress: Callable[[float], None]) -> tuple[str, dict[str, float]]:
    """The method to use.

    Returns
    -------
    key : str
    scores : dict
        RMS error of every candidate on the rows held back, in percent of the span of y.
    """
    from hystfmu.identify import errors, fit

    first, end = data.train.start, data.train.stop
    middle = first + round(SHARE * (end - first))
    part = data.with_train((first, middle))
    scores: dict[str, float] = {}
    for i, key in enumerate(CANDIDATES):
        progress(i / len(CANDIDATES))
        y = fit(part, key, seed).predict(data.u, data.h)
        score = errors(y[middle:end], data.y[middle:end], data.span)["rms_percent"]
        scores[key] = score if np.isfinite(score) else np.inf
    least = min(scores.values())
    return next(key for key in CANDIDATES if scores[key] <= AS_GOOD * least), scores
