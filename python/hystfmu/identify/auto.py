"""Which model?  Minor loops tell the class of memory; every method is fitted on part of the rows, judged on the rest.

A sum of plays returns to its path after a minor loop, a Bouc-Wen operator does not, and neither follows the other to
better than some percent: the error on rows that were not fitted separates them by orders of magnitude.  The split only
chooses; it is no measure of what the model does on another kind of signal.  Where the data cannot identify memory, the
model carries warnings.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hystfmu.data import Dataset
from hystfmu.identify.excitation import BOUC_WEN, RETURN_POINT, Excitation, examine
from hystfmu.identify.options import Option

OPTIONS: tuple[Option, ...] = ()
CANDIDATES = (  # from the simplest to the largest
    "prandtl_ishlinskii",
    "bouc_wen",
    "prandtl_ishlinskii_asym",
    "prandtl_ishlinskii_rate",
    "zhao_tan_mlp",
    "play_bank_mlp",
)
SHARE = 0.7
AS_GOOD = 1.05  # within 5 % of the best, the first in the list (the simpler one) is taken


def choose(data: Dataset, seed: int, progress: Callable[[float], None]) -> tuple[str, dict[str, Any], dict[str, Any]]:
    """The method to use, and why.

    Returns
    -------
    key : str
    fit : dict
        For `Model.fit`: ``memory`` (class of the minor loops), ``gap_percent``, ``loops``, ``warnings`` (list of str).
    provenance : dict
        For `Model.provenance`: ``auto``, the RMS error of every candidate on the rows held back in percent of the span
        of y, and ``auto_parameters``, their numbers of parameters.
    """
    from hystfmu.identify import errors, fit

    first, end = data.train.start, data.train.stop
    middle = first + round(SHARE * (end - first))
    part = data.with_train((first, middle))
    scores: dict[str, float] = {}
    parameters: dict[str, int] = {}
    for i, key in enumerate(CANDIDATES):
        progress(i / (len(CANDIDATES) + 1))
        model = fit(part, key, seed)
        score = errors(model.predict(data.u, data.h)[middle:end], data.y[middle:end], data.span)["rms_percent"]
        scores[key] = score if np.isfinite(score) else np.inf
        parameters[key] = model.fit["parameters"]
    least = min(scores.values())
    key = next(key for key in CANDIDATES if scores[key] <= AS_GOOD * least)
    seen = examine(data)
    told = {"memory": seen.memory, "loops": seen.loops, "gap_percent": seen.gap, "warnings": [*_warnings(key, seen)]}
    return key, told, {"auto": scores, "auto_parameters": parameters}


def _warnings(key: str, seen: Excitation) -> tuple[str, ...]:
    if seen.memory == (RETURN_POINT if key == "bouc_wen" else BOUC_WEN):
        other = (
            f"the best model on the held-out rows is {key}, but the minor loops in the data have a gap of "
            f"{seen.gap:.2g} % of the span of y ({seen.memory} memory): rate dependence, creep or drift opens them, "
            "or no candidate fits"
        )
        return (*seen.warnings, other)
    return seen.warnings
