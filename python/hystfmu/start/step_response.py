"""Overshoot and settling time for a reference with jumps, from a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.scenario import Result
from hystfmu.start.references import Tried

WITHIN = 0.02  # of a step: settled


@dataclass(frozen=True)
class StepResponse:
    """Overshoot and settling time of the worst step of a reference.

    Attributes
    ----------
    name : str
        Name of the reference.
    overshoot : float
        Overshoot beyond the new level, in percent of the step.
    settling : float
        Time until the output stays within 2 % of the step (s). It is infinite if the output does not settle before the
        next step.
    """

    name: str
    overshoot: float
    settling: float


def step_response(tried: Tried, result: Result) -> StepResponse:
    """Measure overshoot and settling time in a run.

    Parameters
    ----------
    tried : Tried
        The reference.
    result : Result
        Result of the case of this reference.
    """
    trace = result.trace
    if trace is None:
        return StepResponse(tried.name, np.inf, np.inf)
    r, y = trace["reference.r"], trace[result.system.case.metrics["tracking"].signal]
    at = np.flatnonzero(np.diff(r)) + 1
    at = at[trace.t[at] > tried.after - 0.5 * result.system.case.step]  # not the way from rest
    overshoot, settling = 0.0, 0.0
    for first, end in zip(at, [*at[1:], len(r)], strict=True):
        size = r[first] - r[first - 1]
        beyond = (y[first:end] - r[first]) / size
        overshoot = max(overshoot, 100 * float(beyond.max()))
        outside = np.flatnonzero(np.abs(beyond) > WITHIN)
        last = int(outside[-1]) + 1 if len(outside) else 0
        settling = max(settling, np.inf if first + last >= end else float(trace.t[first + last] - trace.t[first]))
    return StepResponse(tried.name, overshoot, settling)
