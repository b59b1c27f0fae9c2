"""Files of named arrays, MAT and HDF5, as a `Table`: arrays of equal length are its columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data.reader.table import Column, Table

MOST_COLUMNS = 10_000


@dataclass(frozen=True)
class Named:
    """An array in a file, not read yet.

    Parameters
    ----------
    name : str
        Its name; of an array in a group with the group, ``run1/u``.
    shape : tuple of int
    unit : str
        Unit of measure that the file states, or empty.
    """

    name: str
    shape: tuple[int, ...]
    unit: str = ""


def table_of(
    path: str | Path, kind: str, arrays: Sequence[Named], read: Callable[[str], np.ndarray], most: int
) -> Table:
    """Make a table of the arrays of a file.

    Parameters
    ----------
    path : path
        The file.
    kind : str
        Its format, for the line of what was assumed.
    arrays : sequence of Named
        Arrays of numbers; those of one number are left out.
    read : function
        Returns the values of an array by name.
    most : int
        Largest size of all columns together, in bytes.

    Raises
    ------
    InputError
        No column, or too many; later: columns that are too large or of different lengths.
    """
    sized = [(a, *_columns(a.shape)) for a in arrays]
    places = [(a, n, i, k) for a, n, k in sized if n > 1 for i in range(k)]
    if not places:
        raise InputError(f"{path}: The file must have arrays of numbers, a column each. Got none.")
    if len(places) > MOST_COLUMNS:
        raise InputError(f"{path}: The file must have at most {MOST_COLUMNS} columns. Got {len(places)} instead.")
    left = [a.name for a, n, _ in sized if n <= 1]

    def values(j: int) -> np.ndarray:
        array, n, i, k = places[j]
        if 8 * n * k > most:
            raise InputError(
                f"{path}: The array {array.name!r} must have at most {most} bytes. Got {8 * n * k} instead."
            )
        found = np.asarray(read(array.name))
        if found.dtype.kind not in "biuf":
            raise InputError(f"{path}: The array {array.name!r} must hold real numbers. Got {found.dtype} instead.")
        if 1 in found.shape:
            return found.reshape(-1)
        return found.reshape(n, k)[:, i]

    def numbers(order: Sequence[int]) -> Array:
        lengths = {places[j][1] for j in order}
        if len(lengths) > 1:
            names = ", ".join(f"{places[j][0].name} ({places[j][1]})" for j in order)
            raise InputError(f"{path}: The columns must have equal lengths. Got {names} instead.")
        return np.column_stack([values(j).astype(np.float64) for j in order])

    def digits(j: int) -> Array:
        column = values(j)
        kind = np.float32 if column.dtype == np.float32 else np.float64
        counts: Array = np.spacing(np.abs(column).astype(kind)).astype(np.float64)
        return counts

    def words(j: int) -> list[str]:
        return [f"{v:.12g}" for v in values(j)]

    labels = [(a.name if k == 1 else f"{a.name}(:,{i + 1})", a.unit) for a, _, i, k in places]
    columns = tuple(Column(label, label, unit) if unit else Column.of(label) for label, unit in labels)
    assumed = (kind, *([f"left out {', '.join(left)[:80]}"] if left else []))
    return Table(str(path), columns, "", assumed, numbers, words, digits)


def _columns(shape: tuple[int, ...]) -> tuple[int, int]:
    """Return rows and columns of an array; a row of numbers is one column."""
    if len(shape) == 2 and shape[0] == 1:
        return shape[1], 1
    if len(shape) in (1, 2):
        return shape[0], shape[1] if len(shape) == 2 else 1
    return 0, 0
