"""The outputs of a run on the fine grid, or the reason why it stopped.

A run comes in chunks of consecutive rows, each a `Trace`; without keeping them, memory does not grow with the run.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError

if TYPE_CHECKING:
    import pandas

MOST_VALUES = 50_000_000  # doubles of a trace in memory


class Stopped(Exception):
    """A run stopped: a unit refused a step, or a value is not finite.  This is a failure, not bad input.

    Parameters
    ----------
    why : str
    status : {"stopped", "timeout", "killed", "memory"}
        Status of the run in a study.
    """

    def __init__(self, why: str, status: str = "stopped") -> None:
        super().__init__(why)
        self.status = status


@dataclass
class Sweeps:
    """Number of sweeps of an iterative coupling: the total, the most in a step, and the steps counted."""

    all: int = 0
    most: int = 0
    steps: int = 0

    def add(self, other: Sweeps) -> None:
        """Add the sweeps of more steps."""
        self.all, self.most, self.steps = self.all + other.all, max(self.most, other.most), self.steps + other.steps


@dataclass(frozen=True)
class Trace:
    """All outputs of all units of one run.

    Parameters
    ----------
    t : array, shape (n + 1,)
        Times of the fine grid (s).
    values : array, shape (n + 1, n_values)
    columns : dict of str to int
        Place of every output `unit.output` among the values.
    ripple : int
        Fine steps in a step.
    final_states : dict of str to str
        Hashes of the final states of every unit, where the case asks for them; in the last chunk of a run.
    first : int
        Fine step of the first row: above 0 in a chunk of a run.
    sweeps : Sweeps
        Of an iterative coupling.
    """

    t: Array
    values: Array
    columns: dict[str, int]
    ripple: int
    final_states: dict[str, str] = field(default_factory=dict)
    first: int = 0
    sweeps: Sweeps = field(default_factory=Sweeps)

    @classmethod
    def joined(cls, chunks: Iterable[Trace], n_rows: int) -> Trace:
        """A whole run of `n_rows` rows from its `chunks`.

        Raises
        ------
        InputError
            It has more values than a trace may hold.
        """
        whole: Trace | None = None
        for chunk in chunks:
            if len(chunk.t) == n_rows:
                return chunk
            if whole is None:
                width = chunk.values.shape[1]
                if n_rows * width > MOST_VALUES:
                    raise InputError(
                        f"a trace would hold {n_rows} rows of {width} values, more than {MOST_VALUES}: take its chunks"
                    )
                whole = cls(np.empty(n_rows), np.empty((n_rows, width)), chunk.columns, chunk.ripple)
            rows = slice(chunk.first, chunk.first + len(chunk.t))
            whole.t[rows], whole.values[rows] = chunk.t, chunk.values
            whole.final_states.update(chunk.final_states)
            whole.sweeps.add(chunk.sweeps)
        assert whole is not None  # a run has a row
        return whole

    def __repr__(self) -> str:
        names = [*list(self.columns)[:4], *(["..."] if len(self.columns) > 4 else [])]
        return f"Trace({len(self.t)} rows to t = {self.t[-1]:g} s, {', '.join(names)})"

    def to_pandas(self) -> pandas.DataFrame:
        """Return a data frame: index ``t [s]``, a column for each output ``unit.output``.

        Raises
        ------
        MissingExtra
            pandas is not installed.
        """
        from hystfmu.base.extras import extras

        with extras("to_pandas()"):
            import pandas
        frame = pandas.DataFrame(self.values, index=pandas.Index(self.t, name="t [s]"))
        return frame.set_axis(sorted(self.columns, key=self.columns.__getitem__), axis="columns")

    def __getitem__(self, end: str) -> Array:
        return self.values[:, self.columns[end]]
