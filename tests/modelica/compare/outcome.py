"""What a comparison found about one model, its row of the report, and the committed reference of the model."""

import os
from dataclasses import dataclass
from pathlib import Path

import library
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NAN = float("nan")
RECORDING = "HYSTFMU_RECORD" in os.environ  # writes the references anew
REFERENCE_ROWS = 20
REFERENCES = library.ROOT / "Resources" / "ReferenceResults"


@dataclass(frozen=True)
class Outcome:
    """What the report prints about one model; a bound is nan where there is nothing to compare with."""

    name: str
    rows: int
    events: int
    seconds: float
    error_c: float = NAN
    bound_c: float = NAN
    error_reference: float = NAN
    tube: float = NAN

    @property
    def bad(self) -> list[str]:
        """What is not as it should, in words."""
        found = [
            f"{self.name}: {error:.1e} from {of}, allowed {bound:.0e}"
            for of, error, bound in (
                ("the C core", self.error_c, self.bound_c),
                ("the committed reference", self.error_reference, self.tube),
            )
            if not (error <= bound or np.isnan(bound))
        ]
        if np.isnan([self.bound_c, self.tube]).all():
            found.append(f"{self.name}: nothing to compare with; a test with HYSTFMU_RECORD=1 writes its reference")
        return found


def line(o: Outcome) -> str:
    """One row of the report."""
    errors = "  ".join(f"{e:8.1e}" for e in (o.error_c, o.error_reference))
    return f"{o.name:58} {o.rows:6} {o.events:6}  {errors}  {o.seconds:5.1f}  {'BAD' if o.bad else 'good'}"


def relative(got: Array, expected: Array) -> float:
    """Largest difference over the largest value; the columns of one port share their scale."""
    return float(np.abs(got - expected).max() / np.abs(expected).max())


def reference_file(name: str) -> Path:
    """Where the reference of a model lies."""
    return REFERENCES.joinpath(*name.split(".")[1:]).with_suffix(".csv")


def against_reference(name: str, t: Array, got: Array, tube: float) -> tuple[float, float]:
    """Largest distance to the committed reference, relative to its largest value, and `tube`; nan if there is none.

    An Example has one, because no unit of the C core stands for it; a Validation model may have one.
    """
    file = reference_file(name)
    if RECORDING and (file.is_file() or name.startswith("HystFMU.Examples.")):
        record(file, t, got)
    if not file.is_file():
        return NAN, NAN
    table = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
    assert len(table) >= REFERENCE_ROWS // 2, f"{file}: too few rows to tell a change"
    at = np.searchsorted(t, table[:, 0] + 1e-9) - 1
    assert np.abs(t[at] - table[:, 0]).max() < 1e-9, "the simulation has no row at a time of the reference"
    return relative(got[at], table[:, 1:]), tube


def record(file: Path, t: Array, got: Array) -> None:
    """Write the reference of a model: its outputs at about twenty rows, if possible none at an event."""
    after = np.diff(t, append=t[-1] + 1) > 1e-9
    alone = np.flatnonzero((np.diff(t, prepend=-1.0) > 1e-9) & after)
    if len(alone) < 50:  # every row is a sample: its right limit
        alone = np.flatnonzero(after)
    at = alone[:: max(len(alone) // REFERENCE_ROWS, 1)]
    file.parent.mkdir(parents=True, exist_ok=True)
    header = ",".join(["time", *(f"output_{i + 1}" for i in range(got.shape[1]))])
    np.savetxt(file, np.column_stack([t[at], got[at]]), "%.12g", ",", header=header, comments="")
