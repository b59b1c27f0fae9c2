"""Data frames of pandas, polars and pyarrow, dicts and arrays, as a `Table`; none of these packages is imported."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystfmu.base.errors import InputError
from hystfmu.base.told_arrays import since_first
from hystfmu.data.reader.arrays import Named, table_of
from hystfmu.data.reader.table import Table

NAME = "data frame"


class DataFrame(Protocol):
    """A data frame of pandas or polars, a table of pyarrow."""

    @property
    def columns(self) -> Any:
        """Names of the columns, or the columns."""

    def __getitem__(self, key: Any, /) -> Any:
        """Return a column."""


Frame: TypeAlias = DataFrame | Mapping[str, ArrayLike] | NDArray[Any]
"""Data with columns: those of an array (n, 3) without names are time, input and output."""


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
    for name, column in _columns(given):
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


def _columns(given: Any) -> Iterator[tuple[str, np.ndarray]]:
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
