"""A compared controller structure, with an error for each reference and a step response."""

from __future__ import annotations

from dataclasses import dataclass

from hystfmu.design.race import Tuned
from hystfmu.start.step_response import StepResponse


@dataclass(frozen=True)
class Contender:
    """One row of the comparison table.

    Attributes
    ----------
    tuned : Tuned
    errors : dict of str to float
        Expected RMS error in percent of peak to peak, for each reference without jumps.
    step : StepResponse or None
        Response to the first reference with jumps, simulated with the identified device.
    """

    tuned: Tuned
    errors: dict[str, float]
    step: StepResponse | None
