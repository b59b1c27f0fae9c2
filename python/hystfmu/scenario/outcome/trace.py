"""Outputs of a run on the fine time grid, exception for a stopped run, and excerpts and files of the outputs.

A run yields chunks of consecutive rows. Each chunk is a `Trace`. If the caller does not store the chunks, the memory
does not grow with the length of the run.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hystfmu.base import Array, InputError, written
from hystfmu.data.columns import csv_head, csv_rows
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.spec import MetricSpec
from hystfmu.scenario.system.system import SHORTEST_CHUNK, Rows, System, signals

if TYPE_CHECKING:
    import pandas

MOST_VALUES = 50_000_000  # largest number of values in a trace


class Stopped(Exception):
    """A run stopped because a unit refused a step or a value is not finite. This is a failure, not an invalid input.

    Parameters
    ----------
    why : str
    status : {"stopped", "timeout", "killed", "memory"}
        Status of the run in the results of a study.
    """

    def __init__(self, why: str, status: str = "stopped") -> None:
        super().__init__(why)
        self.status = status


@dataclass
class Sweeps:
    """Number of sweeps of an iterative coupling: total, largest number in a step, and number of steps."""

    all: int = 0
    most: int = 0
    steps: int = 0

    def add(self, other: "Sweeps") -> None:
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
        Column of every output `unit.output` in `values`.
    ripple : int
        Number of fine steps in a step.
    final_states : dict of str to str
        Hash of the final states of every unit, if the case requires hashes. Only the last chunk of a run contains
        hashes.
    first : int
        Number of the fine step of the first row. It is above 0 in later chunks of a run.
    sweeps : Sweeps
        Number of sweeps of an iterative coupling.
    """

    t: Array
    values: Array
    columns: dict[str, int]
    ripple: int
    final_states: dict[str, str] = field(default_factory=dict)
    first: int = 0
    sweeps: Sweeps = field(default_factory=Sweeps)

    @classmethod
    def joined(cls, chunks: "Iterable[Trace]", n_rows: int) -> "Trace":
        """Return the `chunks` of a run as one trace with `n_rows` rows.

        Raises
        ------
        InputError
            The run has more values than a trace may contain.
        """
        whole: Trace | None = None
        for chunk in chunks:
            if len(chunk.t) == n_rows:
                return chunk
            if whole is None:
                width = chunk.values.shape[1]
                if n_rows * width > MOST_VALUES:
                    raise InputError(
                        f"a trace would contain {n_rows} rows of {width} values, more than {MOST_VALUES}: "
                        "use its chunks"
                    )
                whole = cls(np.empty(n_rows), np.empty((n_rows, width)), chunk.columns, chunk.ripple)
            rows = slice(chunk.first, chunk.first + len(chunk.t))
            whole.t[rows], whole.values[rows] = chunk.t, chunk.values
            whole.final_states.update(chunk.final_states)
            whole.sweeps.add(chunk.sweeps)
        assert whole is not None  # a run has at least one row
        return whole

    def __repr__(self) -> str:
        names = [*list(self.columns)[:4], *(["..."] if len(self.columns) > 4 else [])]
        return f"Trace({len(self.t)} rows to t = {self.t[-1]:g} s, {', '.join(names)})"

    def to_pandas(self) -> "pandas.DataFrame":
        """Return a data frame with the index ``t [s]`` and a column for each output ``unit.output``.

        Raises
        ------
        MissingExtra
            pandas is not installed.
        """
        from hystfmu.base import extras

        with extras("to_pandas()"):
            import pandas
        frame = pandas.DataFrame(self.values, index=pandas.Index(self.t, name="t [s]"))
        return frame.set_axis(sorted(self.columns, key=self.columns.__getitem__), axis="columns")

    def __getitem__(self, end: str) -> Array:
        return self.values[:, self.columns[end]]


MOST_ROWS = 1 << 17  # largest number of rows that a plot stores completely


class Excerpt:
    """Selected rows of some signals.

    Parameters
    ----------
    ends : iterable of str
        Outputs (`unit.output`).
    rows : array of int, shape (n,)
        Increasing numbers of fine steps.
    """

    def __init__(self, ends: Iterable[str], rows: Rows) -> None:
        self._ends, self._rows = list(dict.fromkeys(ends)), rows
        self._pieces: list[Trace] = []

    def add(self, chunk: Trace) -> None:
        """Add the next rows of the run."""
        places = self._places(chunk)
        if not len(places) and self._pieces:  # the memory must not grow with the number of chunks
            return
        columns = [chunk.columns[e] for e in self._ends]
        values = chunk.values[places[:, None], columns]
        names = {e: k for k, e in enumerate(self._ends)}
        self._pieces.append(Trace(chunk.t[places], values, names, chunk.ripple, chunk.final_states, chunk.first))

    def _places(self, chunk: Trace) -> Rows:
        begin, end = np.searchsorted(self._rows, [chunk.first, chunk.first + len(chunk.t)]).tolist()
        return np.asarray(self._rows[begin:end] - chunk.first)

    def trace(self) -> Trace:
        """The stored rows."""
        if len(self._pieces) > 1:
            t, values = (np.concatenate([getattr(p, of) for p in self._pieces]) for of in ("t", "values"))
            last = self._pieces[-1]
            self._pieces = [Trace(t, values, last.columns, last.ripple, last.final_states)]
        return self._pieces[0]


class Picture(Excerpt):
    """Rows of the signals that a case names, for plots. A run of at most MOST_ROWS rows is stored completely.

    For a longer run, every 2nd, 4th, 8th, ... row is stored. In each interval between these rows, the rows with the
    smallest and the largest error of the plotted metric are also stored.
    """

    def __init__(self, system: System) -> None:
        end, self._stride = system.n_steps + 1, 1
        while self._stride < SHORTEST_CHUNK and end > MOST_ROWS // (1 if self._stride == 1 else 3) * self._stride:
            self._stride *= 2
        rows = np.union1d(np.arange(0, end, self._stride), [end - 1])
        super().__init__((e for _, ends in signals(system.case) for e in ends), rows)
        self._drawn = drawn(system.case)

    def _places(self, chunk: Trace) -> Rows:
        places, k = super()._places(chunk), self._stride
        if k == 1 or self._drawn is None or self._drawn.against is None:
            return places
        e = chunk[self._drawn.signal] - chunk[self._drawn.against]
        found = [places]
        whole = len(e) // k * k  # a chunk begins at the beginning of an interval; the last interval may be shorter
        for begin, pieces in ((0, e[:whole].reshape(-1, k)), (whole, e[None, whole:])):
            if pieces.size:
                at = begin + k * np.arange(len(pieces))
                found += [at + pieces.argmin(axis=1), at + pieces.argmax(axis=1)]
        return np.unique(np.concatenate(found))


def drawn(case: Case) -> MetricSpec | None:
    """Return the metric whose error is plotted."""
    return next((m for m in case.metrics.values() if m.against is not None and m.kind.endswith("_percent")), None)


@contextmanager
def row_file(path: str | Path, system: System) -> Iterator[Callable[[Trace], None]]:
    """Write a file with t (s) and every output of the system. Yield a function that receives the chunks of rows.

    The file is created at the end of the run.
    """
    with written(path) as file:
        file.write(csv_head(["t", *system.columns]).encode())

        def add(chunk: Trace) -> None:
            file.write(csv_rows([chunk.t, *chunk.values.T]).encode())

        yield add
