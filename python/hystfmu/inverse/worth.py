"""Kind of inverse of a model, and whether the inverse is useful; `auto` uses these answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.inverse import inverse, invert
from hystfmu.inverse.dynamic import split
from hystfmu.inverse.ports import over_range
from hystfmu.model import Model
from hystfmu.model.inputs import with_starts

BACK = 1e-6  # of the range of the output: smaller steps against the direction are rounding
POOR = 5.0  # RMS of inverse and model in cascade (% of the span) above which an inverse is of no use
ENDS = (np.linspace(-1.0, 1.0, 200), np.linspace(1.0, -1.0, 200))
METHODS = ("exact", "implicit")  # a learned inverse exists for every model; it is fitted on request


@dataclass(frozen=True)
class Inverses:
    """Answers to the questions of `auto` about the inverses of models."""

    def kind(self, model: Model) -> str:
        """Return the first of `METHODS` for the model, else ``learned``, or a text if the output is not monotone."""
        if _folded(model):
            return "none: not monotone"
        for method in METHODS:
            try:
                invert(model, method)
            except InputError:
                continue
            return method
        return "learned"

    def fault(self, model: Model) -> str:
        """Return the reason why no inverse of `METHODS` is useful; empty if one of them is useful."""
        if _folded(model):
            return "the output is not monotone in the input: a wanted output has several inputs"
        reason = ""
        for method in METHODS:
            try:
                made = inverse(model, method)
            except InputError as e:
                reason = reason or str(e)
                continue
            off = made.fit.get("cascade_rms_percent", 0.0)
            if off <= POOR:
                return ""
            reason = f"the {method} inverse and the model in cascade are off by {off:.2g} % of the span"
        return reason


def _at_rest(model: Model, u: Array) -> Array:
    """Return the output along u (n,) with covariates at their start values."""
    return np.asarray(model.predict(with_starts(model.graph, u)))


def _folded(model: Model) -> bool:
    """Return whether the output of a static model reverses while the input rises or falls over its range.

    If the output reverses, several inputs give the same output. Models with creep or lags are not tested: their output
    may continue in its direction after a reversal of the input, and the inverse uses the present slope.
    """
    if split(model) is not None:
        return False
    u = over_range(model, np.concatenate([*ENDS, *ENDS]))
    y, n = _at_rest(model, u), len(ENDS[0])
    room = BACK * float(np.ptp(y))
    if np.abs(_at_rest(model, np.repeat(u, 2))[1::2] - y).max() > room:
        return False
    up, down = np.diff(y[-2 * n : -n]), np.diff(y[-n:])
    return not any((s * up >= -room).all() and (s * down <= room).all() for s in (1, -1))
