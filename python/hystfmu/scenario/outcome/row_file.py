"""Write all rows of a run to a CSV file, chunk by chunk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from hystfmu.base.files import written
from hystfmu.data.csv_file import csv_head, csv_rows
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.system import System


@contextmanager
def row_file(path: str | Path, system: System) -> Iterator[Callable[[Trace], None]]:
    """Write columns t (s) and every output of the system; the file appears when the run has come to its end.

    Parameters
    ----------
    path : path
    system : System

    Yields
    ------
    callable
        Takes the chunks of rows in turn.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    with written(path) as file:
        file.write(csv_head(["t", *system.columns]).encode())

        def add(chunk: Trace) -> None:
            file.write(csv_rows([chunk.t, *chunk.values.T]).encode())

        yield add
