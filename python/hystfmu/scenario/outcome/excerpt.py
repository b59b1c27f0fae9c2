"""Rows kept from the chunks of a run: given rows, and rows for a plot."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.spec import MetricSpec
from hystfmu.scenario.system.system import SHORTEST_CHUNK, Rows, System, signals

MOST_ROWS = 1 << 17  # of a picture: a run of as many rows is kept as a whole


class Excerpt:
    """Stated rows of some signals.

    Parameters
    ----------
    ends : iterable of str
        Outputs (`unit.output`).
    rows : array of int, shape (n,)
        Fine steps, increasing.
    """

    def __init__(self, ends: Iterable[str], rows: Rows) -> None:
        self._ends, self._rows = list(dict.fromkeys(ends)), rows
        self._pieces: list[Trace] = []

    def add(self, chunk: Trace) -> None:
        """Take the next rows of the run."""
        places = self._places(chunk)
        if not len(places) and self._pieces:  # nothing may grow with the number of chunks
            return
        columns = [chunk.columns[e] for e in self._ends]
        values = chunk.values[places[:, None], columns]
        names = {e: k for k, e in enumerate(self._ends)}
        self._pieces.append(Trace(chunk.t[places], values, names, chunk.ripple, chunk.final_states, chunk.first))

    def _places(self, chunk: Trace) -> Rows:
        begin, end = np.searchsorted(self._rows, [chunk.first, chunk.first + len(chunk.t)]).tolist()
        return np.asarray(self._rows[begin:end] - chunk.first)

    def trace(self) -> Trace:
        """The rows that were kept."""
        if len(self._pieces) > 1:
            t, values = (np.concatenate([getattr(p, of) for p in self._pieces]) for of in ("t", "values"))
            last = self._pieces[-1]
            self._pieces = [Trace(t, values, last.columns, last.ripple, last.final_states)]
        return self._pieces[0]


class Picture(Excerpt):
    """The signals that a case names: all rows of a run of at most MOST_ROWS.

    For a longer run every 2nd, 4th, ... row, and between them the rows with the lowest and the highest error of the
    drawn metric.
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
        whole = len(e) // k * k  # a chunk begins where a piece does; the last one may be shorter
        for begin, pieces in ((0, e[:whole].reshape(-1, k)), (whole, e[None, whole:])):
            if pieces.size:
                at = begin + k * np.arange(len(pieces))
                found += [at + pieces.argmin(axis=1), at + pieces.argmax(axis=1)]
        return np.unique(np.concatenate(found))


def drawn(case: Case) -> MetricSpec | None:
    """The metric whose error is drawn."""
    return next((m for m in case.metrics.values() if m.against is not None and m.kind.endswith("_percent")), None)
