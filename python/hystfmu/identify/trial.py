"""A candidate of ``auto`` and the results of its fits (see `hystfmu.identify.race`)."""

from dataclasses import dataclass, field

import numpy as np

from hystfmu.base import Array
from hystfmu.identify.catalogue import STRUCTURE, Candidate, Options
from hystfmu.model import Model, rms


@dataclass
class Trial:
    """A candidate and the results of its fits so far.

    `model` is the fit without the first fold. `errors` (m,) contains the errors on the rows of all folds so far, and
    `by_block` contains the RMS error on each block. `others` contains one output (n,) for each fit, for an input with
    another memory. `leaves` is whether the first of these outputs leaves the range of the record by more than the span.
    `first` is the mean square error on the first fold. `outside` is the share of the states of other signals that have
    no near training row. `whole` is the RMS error of `model` over all training rows. It is used because a large error
    on fitted rows is also an error of the candidate, for example in a sweep at the end of a record, which no block
    contains. `complete` is the fit to all rows of a candidate that chooses its components, otherwise None.
    """

    name: str
    key: str
    candidate: Candidate
    model: Model
    errors: Array
    outside: float
    others: list[Array]
    leaves: bool = False
    folds: int = 1
    by_block: list[float] = field(default_factory=list)
    whole: float = 0.0
    complete: Model | None = None
    first: float = field(init=False)

    def __post_init__(self) -> None:
        self.first = self.square

    @property
    def options(self) -> Options:
        """Options of the fits to the rows outside a fold; they keep the components of `complete`."""
        fixed = {} if self.complete is None else self.complete.fit[STRUCTURE]
        return {**self.candidate.options, **fixed}

    @property
    def square(self) -> float:
        """Mean square error on the rows of all folds so far, or on all training rows if this value is larger."""
        return max(float(np.mean(self.errors**2)), self.whole**2)

    @property
    def parameters(self) -> int:
        """Number of fitted parameters."""
        return int(self.model.fit["parameters"])

    @property
    def spread(self) -> float:
        """RMS of the standard error of the output for an input with another memory; 0 if there is only one fit."""
        n = len(self.others)
        if n < 2:
            return 0.0
        with np.errstate(over="ignore", invalid="ignore"):
            found = (n - 1) ** 0.5 * rms(np.array(self.others) - np.mean(self.others, axis=0))
        return found if np.isfinite(found) else np.inf
