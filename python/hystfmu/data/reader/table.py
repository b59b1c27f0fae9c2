"""Common result of all file readers: named columns whose numbers are converted on demand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hystfmu.base.arrays import Array
from hystfmu.base.printable import printable
from hystfmu.data.reader.measures import split_name


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
    """

    label: str
    name: str
    unit: str

    def __post_init__(self) -> None:
        for key in ("label", "name", "unit"):  # a heading goes on to terminals, models and FMUs
            object.__setattr__(self, key, printable(getattr(self, key)))

    @classmethod
    def of(cls, label: str, unit: str = "") -> Column:
        """Split a label into name and unit of measure; a `unit` stated elsewhere counts first."""
        name, found = split_name(label)
        return cls(label, name, unit or found)


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
        Where the headings stand, for messages.
    assumed : tuple of str
        What the reader found or assumed, in a few words each.
    numbers : function
        Returns the numbers of some columns, shape (n, number of columns); raises InputError by line and column.
    words : function
        Returns the cells of a column as text, for a column that marks records.
    digits : function
        Returns the value of one count of the last digit (n,) in which the file prints a column.
    lines : sequence of int, optional
        The line of each row as an editor counts it; None for files without lines.
    """

    path: str
    columns: tuple[Column, ...]
    named_in: str
    assumed: tuple[str, ...]
    numbers: Callable[[Sequence[int]], Array]
    words: Callable[[int], list[str]]
    digits: Callable[[int], Array]
    lines: Sequence[int] | None = None

    def title(self, k: int) -> str:
        """Name a column for a message: by its name, or by its number from 1."""
        return repr(self.columns[k].name) if self.columns[k].name else f"number {k + 1}"
