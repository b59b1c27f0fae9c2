"""A compared controller structure with figures for the user: error of each reference, and step response."""

from __future__ import annotations

from dataclasses import dataclass

from hystfmu.design.race import Tuned
from hystfmu.start.step_response import StepResponse


@dataclass(frozen=True)
class Contender:
    """One row of the table.

    Attributes
    ----------
    tuned : Tuned
    errors : dict of str to float
        Expected RMS error by reference, in percent of peak to peak; of references that do not jump.
    step : StepResponse or None
        Of the first reference that jumps, simulated with the identified device.
    """

    tuned: Tuned
    errors: dict[str, float]
    step: StepResponse | None
