"""Covariates: measured inputs in addition to the driving input u, such as load or temperature."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.base.printable import printable

TAKEN = ("t", "u", "y", "time")  # names of other signals
_LABEL = re.compile(r"\s*(.*?)\s*(?:\[([^\[\]]*)\]\s*)?")
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True, eq=False)
class Covariates:
    """Columns of covariates, with names and units of measure.

    Parameters
    ----------
    names : tuple of str
        Names of the inputs of a model; identifiers.
    units : tuple of str
        Units of measure; empty if none is stated.
    values : array, shape (n, m)
        One column for each covariate.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array

    def __bool__(self) -> bool:
        return bool(self.names)

    def __iter__(self) -> Iterator[tuple[str, str, Array]]:
        """Iterate over name, unit of measure and values (n,)."""
        return iter(zip(self.names, self.units, self.values.T, strict=True))

    @property
    def labels(self) -> tuple[str, ...]:
        """Names with their units of measure, ``T [degC]``."""
        return tuple(f"{name} [{unit}]" if unit else name for name, unit in zip(self.names, self.units, strict=True))

    @property
    def ranges(self) -> dict[str, list[float]]:
        """Least and largest value of each covariate."""
        return {name: [float(v.min()), float(v.max())] for name, _, v in self}

    @classmethod
    def none(cls, n: int) -> Covariates:
        """Return the covariates of data of `n` rows that have none."""
        return cls((), (), np.zeros((n, 0)))

    @classmethod
    def of(cls, given: Mapping[str, ArrayLike], n: int, where: str, place: Callable[[int], str]) -> Covariates:
        """Check columns by their labels, ``T`` or ``T [degC]``.

        Parameters
        ----------
        given : mapping of str to array, shape (n,)
        n : int
            Rows of the data.
        where : str
            Name of the data, for messages.
        place : function
            Name of a row, for messages.

        Raises
        ------
        InputError
            A name is not an identifier, is already used or occurs twice, the number of rows is wrong, or a value is not
            finite.
        """
        names: list[str] = []
        units: list[str] = []
        columns: list[Array] = []
        for label, values in given.items():
            name, unit = split(label)
            if not _IDENTIFIER.fullmatch(name) or name in (*TAKEN, *names):
                raise InputError(
                    f"{where}: The name of a covariate must be letters, digits and low lines, begin with a letter, and "
                    f"differ from {', '.join((*TAKEN, *names))}. Got {label!r} instead."
                )
            try:
                column = np.array(values, dtype=np.float64)
            except (TypeError, ValueError):
                raise InputError(f"{where}: The covariate {name!r} must hold numbers. Got {values!r:.60}.") from None
            if column.shape != (n,):
                raise InputError(
                    f"{where}: The covariate {name!r} must have {n} rows. Got shape {column.shape} instead."
                )
            if not np.isfinite(column).all():
                row = int(np.argmin(np.isfinite(column)))
                raise InputError(f"{place(row)}: The covariate {name!r} must be finite. Got {column[row]} instead.")
            names.append(name)
            units.append(printable(unit))
            columns.append(column)
        stacked = np.column_stack(columns) if columns else np.zeros((n, 0))
        stacked.flags.writeable = False
        return cls(tuple(names), tuple(units), stacked)

    def rows(self, which: slice) -> Covariates:
        """Return the selected rows."""
        return Covariates(self.names, self.units, self.values[which])

    def at(self, new: Array, t: Array) -> Covariates:
        """Interpolate from the times t (n,) to the times `new` (m,)."""
        columns = [np.interp(new, t, v) for _, _, v in self]
        return Covariates(self.names, self.units, np.column_stack([*columns, np.zeros((len(new), 0))]))

    @classmethod
    def joined(cls, parts: Sequence[Covariates]) -> Covariates:
        """Concatenate the rows of records with the same covariates."""
        return cls(parts[0].names, parts[0].units, np.vstack([part.values for part in parts]))


def split(label: str) -> tuple[str, str]:
    """Split a label, ``T [degC]``, into name and unit of measure."""
    m = _LABEL.fullmatch(label)
    return (label, "") if m is None else (m[1], (m[2] or "").strip())


def identifier(text: str, otherwise: str) -> str:
    """Return a heading as an identifier; invalid characters become underscores.

    If the heading does not start with a letter, return `otherwise`.
    """
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")
    if not _IDENTIFIER.fullmatch(name):
        return otherwise
    return f"{name}_" if name in TAKEN else name
