"""Common result of all file readers: named columns whose numbers are converted on demand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

from hystfmu.base.arrays import Array
from hystfmu.base.printable import printable
from hystfmu.data.reader.headings import split_name

Kind = Literal["number", "clock", "text", "empty"]
"""Content of the cells of a column; a clock is a time of day, with or without a date."""


class Stamps(NamedTuple):
    """Times since the first row.

    Parameters
    ----------
    t : array, shape (n,)
        Times (s), the first 0.
    digits : array, shape (n,)
        Value (s) of one count of the last digit.
    first : str
        The first stamp, as the file writes it.
    """

    t: Array
    digits: Array
    first: str


class Source(Protocol):
    """Cells of a file. Columns `k` are counted from 0. All errors are InputError with line and column."""

    def numbers(self, order: Sequence[int]) -> Array:
        """Return the numbers of some columns, shape (n, len(order))."""

    def words(self, k: int) -> list[str]:
        """Return the cells as text."""

    def digits(self, k: int) -> Array:
        """Return the value (n,) of one count of the last printed digit of a column."""

    def since(self, k: int) -> Array:
        """Return a column minus its first value, without rounding errors of large numbers."""

    def stamps(self, k: int) -> Stamps:
        """Return the times of a column of clocks."""


@dataclass(frozen=True)
class Column:
    """Heading of a column.

    Parameters
    ----------
    label : str
        The heading as the file writes it, ``Zeit [ms]``; empty if the file names no columns.
    name : str
        The label without its unit of measure.
    unit : str
        Unit of measure, in the spelling of the package; empty if none is stated.
    kind : {"number", "clock", "text", "empty"}
        Kind of its cells.
    """

    label: str
    name: str
    unit: str
    kind: Kind = "number"

    def __post_init__(self) -> None:
        for key in ("label", "name", "unit"):  # a heading goes on to terminals, models and FMUs
            object.__setattr__(self, key, printable(getattr(self, key)))

    @classmethod
    def of(cls, label: str, unit: str = "", kind: Kind = "number") -> Column:
        """Split a label into name and unit of measure; a `unit` that is stated elsewhere has priority."""
        name, found = split_name(label)
        return cls(label, name, unit or found, kind)


@dataclass(frozen=True)
class Table:
    """Columns of a file.

    Parameters
    ----------
    path : str
        The file.
    columns : tuple of Column
        Headings, in the order of the file.
    named_in : str
        Location of the headings in the file, for messages.
    assumed : tuple of str
        Findings and assumptions of the reader, each in a few words.
    source : Source
        The cells.
    lines : sequence of int, optional
        Line of each row as an editor counts lines; None for files without lines.
    step : float
        Sample step (s) that the file states outside its columns; 0 without such a statement.
    """

    path: str
    columns: tuple[Column, ...]
    named_in: str
    assumed: tuple[str, ...]
    source: Source
    lines: Sequence[int] | None = None
    step: float = 0.0

    @property
    def where(self) -> str:
        """Begin of a message about the headings."""
        return f"{self.path}: {self.named_in}: " if self.named_in else f"{self.path}: "

    def title(self, k: int) -> str:
        """Name a column for a message: by its name, or by its number from 1."""
        return repr(self.columns[k].name) if self.columns[k].name else f"number {k + 1}"
