"""Named arrays of MAT, HDF5 and other files and of data frames as a `Table`: arrays of equal length are its columns.

No package of data frames is imported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.base.told_arrays import since_first
from hystfmu.data.reader.headings import stated_step
from hystfmu.data.reader.table import Column, Stamps, Table
from hystfmu.data.record_rows import LEAST_ROWS

MOST_COLUMNS = 10_000


@dataclass(frozen=True)
class Named:
    """An array in a file, not read yet.

    Parameters
    ----------
    name : str
        Name of the array, with its group if there is one, ``run1/u``; empty for the only array of a file.
    shape : tuple of int
    unit : str
        Unit of measure that the file states, or empty.
    first : str
        First time stamp of an array of times, whose numbers are seconds since this stamp; otherwise empty.
    """

    name: str
    shape: tuple[int, ...]
    unit: str = ""
    first: str = ""


def table_of(
    path: str | Path, kind: str, arrays: Sequence[Named], read: Callable[[str], np.ndarray], most: int
) -> Table:
    """Make a table of the arrays of a file.

    Parameters
    ----------
    path : path
        The file.
    kind : str
        Format of the file, for the line with the assumptions; may be empty.
    arrays : sequence of Named
        Arrays of numbers. An array of one number may state the sample step; other arrays of one number are ignored.
    read : function
        Returns the values of an array by name.
    most : int
        Largest size of all columns together, in bytes.

    Raises
    ------
    InputError
        No column, or too many columns; on reading, columns that are too large or of different lengths.
    """
    sized = [(a, *_columns(a.shape)) for a in arrays]
    places = [_Place(a, n, i, k) for a, n, k in sized if n > 1 for i in range(k)]
    if not places:
        raise InputError(f"{path}: The file must have arrays of numbers, a column each. Got none.")
    if len(places) > MOST_COLUMNS:
        raise InputError(f"{path}: The file must have at most {MOST_COLUMNS} columns. Got {len(places)} instead.")
    columns = tuple(p.column for p in places)
    step, left = 0.0, []
    for a in (a for a, n, _ in sized if n <= 1):
        stated = 0.0
        if a.shape in ((), (1,), (1, 1)) and stated_step(a.name, 1.0, a.unit):
            stated = stated_step(a.name, float(np.asarray(read(a.name)).reshape(-1)[0]), a.unit)
        step = step or stated
        left += [] if stated or "@" in a.name else [a.name]  # no attributes
    assumed = (*([kind] if kind else []), *([f"left out {', '.join(left)[:80]}"] if left else []))
    return Table(str(path), columns, "", assumed, Arrays(path, places, read, most), None, step)


@dataclass(frozen=True)
class _Place:
    """Column `i` of an array with `k` columns and `n` rows."""

    array: Named
    n: int
    i: int
    k: int

    @property
    def column(self) -> Column:
        label, unit = self.array.name, self.array.unit
        label = label if self.k == 1 or not label else f"{label}(:,{self.i + 1})"
        kind = Column.of(label, unit, "clock" if self.array.first else "number")
        return Column(label, label, unit, kind.kind) if unit else kind


class Arrays:
    """The cells of a file of arrays, a `Source`.

    Parameters
    ----------
    path, read, most
        As in `table_of`.
    places : sequence
        The columns.
    """

    def __init__(
        self, path: str | Path, places: Sequence[_Place], read: Callable[[str], np.ndarray], most: int
    ) -> None:
        self._path, self._places, self._read, self._most = path, places, read, most

    def _values(self, j: int) -> np.ndarray:
        p = self._places[j]
        if 8 * p.n * p.k > self._most:
            raise InputError(
                f"{self._path}: The array {p.array.name!r} must have at most {self._most} bytes. "
                f"Got {8 * p.n * p.k} instead."
            )
        found = np.asarray(self._read(p.array.name))
        if found.dtype.kind not in "biuf":
            raise InputError(
                f"{self._path}: The array {p.array.name!r} must hold real numbers. Got {found.dtype} instead."
            )
        if 1 in found.shape:
            return found.reshape(-1)
        return (found if found.shape[0] == p.n else found.T).reshape(p.n, p.k)[:, p.i]

    def numbers(self, order: Sequence[int]) -> Array:
        """Return the columns `order`, shape (n, len(order))."""
        lengths = {self._places[j].n for j in order}
        if len(lengths) > 1:
            names = ", ".join(f"{self._places[j].array.name} ({self._places[j].n})" for j in order)
            raise InputError(f"{self._path}: The columns must have equal lengths. Got {names} instead.")
        return np.column_stack([self._values(j).astype(np.float64) for j in order])

    def digits(self, k: int) -> Array:
        """Return the spacing of floating-point numbers at each value of column `k`."""
        column = self._values(k)
        kind = np.float32 if column.dtype == np.float32 else np.float64
        counts: Array = np.spacing(np.abs(column).astype(kind)).astype(np.float64)
        return counts

    def words(self, k: int) -> list[str]:
        """Return column `k` as text."""
        return [f"{v:.12g}" for v in self._values(k)]

    def since(self, k: int) -> Array:
        """Return column `k` minus its first value."""
        column = self._values(k)
        column = column.astype(np.int64) if column.dtype.kind in "biu" else column.astype(np.float64)
        since: Array = (column - column[0]).astype(np.float64)
        return since

    def stamps(self, k: int) -> Stamps:
        """Return the times of column `k`, seconds since a stamp in nanoseconds."""
        t = self._values(k).astype(np.float64)
        return Stamps(t, np.full(len(t), 1e-9), self._places[k].array.first)


def _columns(shape: tuple[int, ...]) -> tuple[int, int]:
    """Return rows and columns of an array; an array with up to three long rows is transposed."""
    if len(shape) == 2 and shape[0] < LEAST_ROWS <= shape[1]:
        return shape[1], shape[0]
    if len(shape) in (1, 2):
        return shape[0], shape[1] if len(shape) == 2 else 1
    return 0, 0


NAME = "data frame"


class DataFrame(Protocol):
    """Protocol of a data frame of pandas or polars, or a table of pyarrow."""

    @property
    def columns(self) -> Any:
        """Names of the columns, or the columns."""

    def __getitem__(self, key: Any, /) -> Any:
        """Return a column."""


Frame: TypeAlias = DataFrame | Mapping[str, ArrayLike] | NDArray[Any]
"""Data with columns. The columns of an array (n, 3) without names are time, input and output."""


Columns: TypeAlias = DataFrame | Mapping[str, ArrayLike]
"""Data with named columns."""


def is_frame(given: object) -> bool:
    """Return whether `given` has columns."""
    return isinstance(given, (Mapping, np.ndarray)) or hasattr(given, "column_names") or hasattr(given, "columns")


def frame(given: Any, most: int) -> Table:
    """Read the columns of numbers and times; a pandas index other than row numbers is a column.

    Parameters
    ----------
    given : data frame, mapping of str to array, or array
    most : int
        Largest size of a column in bytes.

    Raises
    ------
    InputError
        No columns of numbers.
    """
    arrays: list[Named] = []
    values: dict[str, np.ndarray] = {}
    for name, column in _frame_columns(given):
        found, first = column, ""
        if column.dtype.kind == "M" and column.ndim == 1 and len(column):
            found, first = since_first(column)
        elif column.dtype.kind == "m":
            found, first = column / np.timedelta64(1, "s"), "0 s"
        elif column.dtype.kind not in "biuf":
            continue
        if name in values:
            raise InputError(f"{NAME}: The column {name!r} must occur once. Got two.")
        values[name] = found
        arrays.append(Named(name, found.shape, "s" if first else "", first))
    return table_of(NAME, "", arrays, values.__getitem__, most)


def _frame_columns(given: Any) -> Iterator[tuple[str, np.ndarray]]:
    if isinstance(given, np.ndarray) and given.dtype.names is None:
        yield "", given
        return
    names = list(given) if isinstance(given, Mapping) else getattr(given, "column_names", None)
    names = names if not isinstance(given, np.ndarray) else given.dtype.names
    for name in given.columns if names is None else names:
        yield str(name), _array(given[name])
    index = getattr(given, "index", None)
    if index is not None and not callable(index) and type(index).__name__ != "RangeIndex":
        column = _array(index)
        if column.dtype.kind in "fmM" or index.name:
            yield str(index.name or "index"), column


def _array(column: Any) -> np.ndarray:
    """Return a column as an array; times with a zone are taken in UTC."""
    if getattr(getattr(column, "dtype", None), "tz", None) is not None:
        column = column.dt.tz_convert(None) if hasattr(column, "dt") else column.tz_convert(None)
    try:
        return np.asarray(column)
    except (TypeError, ValueError):
        return np.empty(0, dtype=object)  # ragged: no numbers
