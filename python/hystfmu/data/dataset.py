"""Data sets: time, input and output of one or several records of a device."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hystfmu.base import Array, Indices, InputError, Mask, checked
from hystfmu.base.printable import printable
from hystfmu.data.columns import (
    LEAST_ROWS,
    Covariates,
    check_finite,
    check_one_step,
    check_time,
    line_of,
    row_of,
    starts_of,
    train_rows,
    write_csv,
)
from hystfmu.data.reversals import resample

if TYPE_CHECKING:
    import pandas

    from hystfmu.report.plot import Plot

MOST_STEM = 120  # maximum number of bytes of a name in a file name
Rows = slice | Indices
"""Index of rows."""


@checked
@dataclass(frozen=True, eq=False, init=False)
class Dataset:
    """One or several records of a device, sampled with equal time steps.

    Parameters
    ----------
    t : array, list or column of a data frame, shape (n,)
        Time (s), increasing in equal steps.
    u, y : array, list or column of a data frame, shape (n,)
        Input and output of the actuator or sensor. If no output was measured, y is NaN in every row. A model can still
        predict the output of such data.
    name : str
        Short name for tables.
    path : str
        File that contains the data; empty for generated data.
    train : slice, tuple (first, end) or str "first:end", optional
        Training rows, whose errors a fit minimises. Rows are counted from 0, and the end is excluded. By default, all
        rows are training rows. A model always runs from row 0, because its memory depends on the whole history.
    unit_u, unit_y : str
        Units of measure of input and output.
    starts : sequence of int
        Index of the first row of each record; the first index is 0. All records have the same step. Each record has its
        own times, and a model starts each record from rest.
    covariates : dict of str to array, shape (n,), optional
        Further measured inputs by name, such as load or temperature. The name may contain a unit of measure in square
        brackets, as in ``{"T [degC]": values}``.

    Attributes
    ----------
    read_as : str
        One line with the assumptions of the reader about the file; empty for generated data.
    titles : tuple of str
        Names of input and output in the file, without units of measure; empty for generated data.
    held : array of bool, shape (n,), or None
        True in held-out rows: a fit does not use their errors (see `with_held`). None means that there are none.

    Raises
    ------
    InputError
        The lengths differ, there are fewer than 4 rows, a value is not finite, the time does not increase in equal
        steps, or the training rows are outside the data.

    Examples
    --------
    >>> import hystfmu as hy
    >>> hy.Dataset(t=[0.0, 0.1, 0.2, 0.3], u=[0.0, 1.0, 2.0, 1.0], y=[0.0, 0.5, 1.5, 1.2], unit_u="V", unit_y="um")
    Dataset('data', 4 rows, step 0.1 s, u in V, y in um)
    >>> hy.Dataset([0, 1, 2, 3], [0, 1, 2, 1], [0.0, 0.5, 1.5, 1.2], covariates={"T [degC]": [20, 21, 22, 23]})
    Dataset('data', 4 rows, step 1 s, covariates T [degC])
    """

    t: Array
    u: Array
    y: Array
    name: str
    path: str
    train: slice
    unit_u: str
    unit_y: str
    starts: tuple[int, ...]
    covariates: Covariates
    read_as: str = field(init=False, repr=False)
    titles: tuple[str, str] = field(init=False, repr=False)
    held: Mask | None = field(init=False, repr=False)
    _lines: Sequence[int] | None = field(init=False, repr=False)

    def __init__(
        self,
        t: ArrayLike,
        u: ArrayLike,
        y: ArrayLike,
        name: str = "data",
        path: str = "",
        train: slice | Sequence[int] | str | None = None,
        unit_u: str = "",
        unit_y: str = "",
        starts: Sequence[int] = (0,),
        covariates: Mapping[str, ArrayLike] | Covariates | None = None,
    ) -> None:
        texts = {"name": name, "unit_u": unit_u, "unit_y": unit_y}
        vars(self).update(path=path, **{key: printable(value) for key, value in texts.items()})
        where = self.path or self.name
        for key, given in (("t", t), ("u", u), ("y", y)):
            try:
                column = np.array(given, dtype=np.float64)  # copied: the given array may change
            except (TypeError, ValueError) as e:
                text = " ".join(str(e).split()).rstrip(".")
                raise InputError(
                    f"{where}: The '{key}' array must hold numbers. {text[:1].upper()}{text[1:]}."
                ) from None
            if column.ndim != 1:
                raise InputError(
                    f"{where}: The '{key}' array must be one-dimensional. Got shape {column.shape} instead."
                )
            column.flags.writeable = False
            vars(self)[key] = column
        lengths = {len(self.t), len(self.u), len(self.y)}
        if len(lengths) > 1:
            raise InputError(
                f"{where}: The arrays t, u, y must have equal lengths. "
                f"Got {len(self.t)}, {len(self.u)}, {len(self.y)} instead."
            )
        if len(self.t) < LEAST_ROWS:
            raise InputError(f"{where}: The data must have at least {LEAST_ROWS} rows. Got {len(self.t)} instead.")
        place = partial(row_of, where)
        for key in ("t", "u", "y") if self.has_output else ("t", "u"):
            check_finite(getattr(self, key), key, place)
        if not isinstance(covariates, Covariates):
            covariates = Covariates.of(covariates or {}, len(self.t), where, place)
        if len(covariates.values) != len(self.t):
            raise InputError(
                f"{where}: The covariates must have {len(self.t)} rows. Got {len(covariates.values)} instead."
            )
        vars(self).update(covariates=covariates, starts=starts_of(starts, len(self.t), where))
        for rows in self.records:
            check_time(self.t[rows], partial(row_of, where, first=rows.start), None)
        check_one_step(self.t, self.records, where)
        train = train_rows(train, len(self.t), where)
        vars(self).update(train=train, read_as="", titles=("", ""), held=None, _lines=None)

    def __repr__(self) -> str:
        n, rows = len(self.t), self.train
        parts = [repr(self.name), f"{n} rows", f"step {self.h:g} s"]
        parts += [f"{len(self.starts)} records"] if len(self.starts) > 1 else []
        parts += [f"{k} in {unit}" for k, unit in (("u", self.unit_u), ("y", self.unit_y)) if unit]
        parts += [f"covariates {', '.join(self.covariates.labels)}"] if self.covariates else []
        parts += [] if self.has_output else ["no output"]
        parts += [] if (rows.start, rows.stop) == (0, n) else [f"train {rows.start}:{rows.stop}"]
        return f"Dataset({', '.join(parts)})"

    def _repr_html_(self) -> str:
        """Return a plot of the data as HTML, which a notebook displays."""
        return self.plot()._repr_html_()

    def plot(self) -> Plot:
        """Return a plot of the output over the input. Without a measured output, plot the input over time.

        Returns
        -------
        Plot
            Plot that a notebook displays. `Plot.save` writes it to a file.

        Examples
        --------
        >>> import hystfmu as hy
        >>> hy.Dataset([0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 2, 5], name="mine").plot()
        Plot("Dataset('mine', 4 rows, step 1 s)", measured)
        """
        from hystfmu.report.plot import LOOP_POINTS, Line, Plot

        u, y = (f"{k} ({unit})" if unit else k for k, unit in (("u", self.unit_u), ("y", self.unit_y)))
        if not self.has_output:
            return Plot(repr(self), "t (s)", u, [Line("input", self.t, self.u)])
        return Plot(repr(self), u, y, [Line("measured", self.u, self.y)], points=LOOP_POINTS)

    @property
    def has_output(self) -> bool:
        """True if an output was measured."""
        return not bool(np.isnan(self.y).all())

    @property
    def h(self) -> float:
        """Time step (s) between two rows."""
        first = self.t[self.records[0]]
        h = float(first[-1] - first[0]) / (len(first) - 1)
        short = float(f"{h:.12g}")  # without the rounding error of the last time: 0.005, not 0.0050000000000000001
        return short if abs(short - h) <= 1e-13 * h else h

    @property
    def records(self) -> tuple[slice, ...]:
        """Rows of each record, as slices."""
        return tuple(slice(a, b) for a, b in zip(self.starts, (*self.starts[1:], len(self.t)), strict=True))

    def along(self, run: Callable[[Array], Array], end: int | None = None, inputs: Array | None = None) -> Array:
        """Apply a function to the input of each record, and return the results of all records in one array.

        Parameters
        ----------
        run : function
            Function that computes an array of m rows from the input (m,) of one record.
        end : int, optional
            Number of rows of the data to which the function is applied; by default, all rows.
        inputs : array, shape (n, ...), optional
            Input rows that replace u.

        Returns
        -------
        array, shape (n, ...)
            Results of all rows.
        """
        last = len(self.t) if end is None else end
        v = self.u if inputs is None else inputs
        parts = [run(v[rows.start : min(rows.stop, last)]) for rows in self.records if rows.start < last]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def longest(self) -> Dataset:
        """Return the record that contains the most training rows, as a data set of one record."""
        if len(self.starts) == 1:
            return self
        count = [min(r.stop, self.train.stop) - max(r.start, self.train.start) for r in self.records]
        r = self.records[int(np.argmax(count))]
        rows = (max(r.start, self.train.start) - r.start, min(r.stop, self.train.stop) - r.start)
        t, u, y, beside = self.t[r], self.u[r], self.y[r], self.covariates.rows(r)
        return replace(self, t=t, u=u, y=y, covariates=beside, train=train_rows(rows, len(t)), starts=(0,))

    @property
    def counted(self) -> Rows:
        """Index of the training rows without the held-out rows. A fit minimises the errors in these rows."""
        if self.held is None:
            return self.train
        found: Indices = np.flatnonzero(~self.held[self.train]) + self.train.start
        return found

    def with_held(self, held: Mask) -> Dataset:
        """Return the same data with held-out rows. A fit uses the input of these rows, but not their output.

        Parameters
        ----------
        held : array of bool, shape (n,)
            True in held-out rows, e.g. in validation blocks.
        """
        made = self._of_same_rows(replace(self))
        vars(made)["held"] = held
        return made

    @property
    def sha256(self) -> str:
        """Hash of the values of t, u, y and the covariates. A model file stores it as evidence of its training data."""
        content = [np.ascontiguousarray(a).tobytes() for a in (self.t, self.u, self.y)]
        content += [repr(self.starts).encode()] if len(self.starts) > 1 else []
        for label, values in zip(self.covariates.labels, self.covariates.values.T, strict=True):
            content += [label.encode(), np.ascontiguousarray(values).tobytes()]
        return hashlib.sha256(b"".join(content)).hexdigest()

    @property
    def stem(self) -> str:
        """Name of the data, shortened for use in a file name."""
        return self.name.encode()[:MOST_STEM].decode(errors="ignore")

    @property
    def identity(self) -> list[str | int]:
        """Values that identify the data of a fit: hash, names, units of measure and training rows."""
        texts = [self.name, self.path, *self.titles, self.unit_u, self.unit_y]
        return [self.sha256, *texts, self.train.start, self.train.stop]

    @property
    def span(self) -> float:
        """Largest minus smallest output in the training rows. It is 100 % of full scale (%FS)."""
        return float(np.ptp(self.y[self.train]))

    @classmethod
    def joined(cls, records: Sequence[Dataset], train: slice | Sequence[int] | str | None = None) -> Dataset:
        """Return one data set with all given records, e.g. for a fit to several records.

        Parameters
        ----------
        records : sequence of Dataset
            Records with the same step, the same units of measure and the same covariates.
        train : slice, (first, end) or "first:end", optional
            Training rows of the joined data; by default, all rows.

        Raises
        ------
        InputError
            There is no record, the units of measure, covariates or steps differ, or only some records have an output.

        Examples
        --------
        >>> import hystfmu as hy
        >>> parts = [hy.synthetic.piezo(60, 1000.0, seed=k) for k in (1, 2)]
        >>> hy.Dataset.joined(parts).starts == (0, len(parts[0].t))
        True
        """
        if not records:
            raise InputError("The records to join must be at least one. Got none.")
        first = records[0]
        for other in records[1:]:
            for key in ("unit_u", "unit_y", "has_output"):
                mine, theirs = getattr(first, key), getattr(other, key)
                if mine != theirs:
                    raise InputError(
                        f"{other.path or other.name}: The records must agree in {key}. "
                        f"Got {theirs!r} after {mine!r} of {first.path or first.name}."
                    )
            if other.covariates.labels != first.covariates.labels:
                mine, theirs = (", ".join(part.covariates.labels) or "none" for part in (first, other))
                raise InputError(
                    f"{other.path or other.name}: The records must agree in covariates. "
                    f"Got {theirs} after {mine} of {first.path or first.name}."
                )
        starts, at = [], 0
        for part in records:
            starts += [at + s for s in part.starts]
            at += len(part.t)
        t, u, y = (np.concatenate([getattr(part, key) for part in records]) for key in "tuy")
        name = " ".join(dict.fromkeys(part.name for part in records))
        if len(records) == 1:
            return first if train is None else first.with_train(train)
        covariates = Covariates.joined([part.covariates for part in records])
        made = cls(t, u, y, name, "", train, first.unit_u, first.unit_y, starts, covariates)
        return made.from_file("; ".join(dict.fromkeys(p.read_as for p in records if p.read_as)), None, first.titles)

    @classmethod
    def from_signal(cls, u: Array, y: Array, h: float = 1.0, name: str = "data", train: slice | None = None) -> Dataset:
        """Return a data set of an input and an output with equal time steps, which start at t = 0.

        Parameters
        ----------
        u, y : array, shape (n,)
            Input and output.
        h : float
            Time step (s).
        name : str
            Short name for tables.
        train : slice, optional
            Training rows, whose errors a fit minimises; by default, all rows.
        """
        t = np.arange(len(u), dtype=np.float64) * np.float64(h)
        return cls(t, u, y, name, train=slice(None) if train is None else train)

    def with_train(self, train: slice | Sequence[int] | str | None) -> Dataset:
        """Return the same data with other training rows. `train` has one of the forms that `Dataset` accepts."""
        return self._of_same_rows(replace(self, train=train_rows(train, len(self.t), self.path or self.name)))

    def resampled(self, rate: float) -> Dataset:
        """Return the record resampled to another sampling rate (Hz). The training rows cover the same time span.

        Raises
        ------
        InputError
            There are several records, the rate is out of range, or fewer than 4 training rows remain.
        """
        where = self.path or self.name
        if len(self.starts) > 1:
            raise InputError(
                f"{where}: The data to resample must be one record. Got {len(self.starts)} records instead."
            )
        t, u, y, rows = resample(self.t, self.u, self.y, rate, where, rows=self.train)
        made = replace(self, t=t, u=u, y=y, train=rows, covariates=self.covariates.at(t, self.t))
        vars(made)["titles"] = self.titles
        return made

    def aligned(self, lag: int) -> Dataset:
        """Return the record with the output shifted in time to compensate for a delay of the sensor.

        Parameters
        ----------
        lag : int
            Delay of the output in rows. The result is shorter than the record by this number of rows.

        Raises
        ------
        InputError
            There are several records, the lag is negative, or fewer than 4 rows remain.
        """
        where, n = self.path or self.name, len(self.t) - lag
        if lag and len(self.starts) > 1:
            raise InputError(f"{where}: The data to align must be one record. Got {len(self.starts)} records.")
        if not 0 <= lag <= len(self.t) - LEAST_ROWS:
            raise InputError(f"{where}: The lag must be from 0 to {len(self.t) - LEAST_ROWS} rows. Got {lag} instead.")
        if lag == 0:
            return self
        rows = train_rows((self.train.start, min(self.train.stop, n)), n, where)
        t, u, y, beside = self.t[:n], self.u[:n], self.y[lag:], self.covariates.rows(slice(n))
        return self._of_same_rows(replace(self, t=t, u=u, y=y, covariates=beside, train=rows))

    def with_input(self, u: Array) -> Dataset:
        """Return the same data with another input u (n,), e.g. after a dead band."""
        return self._of_same_rows(replace(self, u=u))

    def with_output(self, y: Array) -> Dataset:
        """Return the same data with another output y (n,), e.g. a prediction."""
        return self._of_same_rows(replace(self, y=y))

    def with_names(self, names: Sequence[str]) -> Dataset:
        """Return the same data with new names for the covariates, in the order of the covariates.

        If `names` contains the present names in another order, the data stay unchanged.
        """
        if set(names) == set(self.covariates.names):
            return self
        return self._of_same_rows(replace(self, covariates=replace(self.covariates, names=tuple(names))))

    def place(self, row: int) -> str:
        """Return a text that identifies a row, counted from 0, in a message: its line in the file, or its number."""
        where = self.path or self.name
        return row_of(where, row) if self._lines is None else line_of(where, self._lines, row)

    def _of_same_rows(self, other: Dataset) -> Dataset:
        vars(other).update(_lines=self._lines, read_as=self.read_as, titles=self.titles, held=self.held)
        return other

    def from_file(self, read_as: str, lines: Sequence[int] | None, titles: tuple[str, str]) -> Dataset:
        """Store a description of the file that contains the data, and return this data set.

        `read_as` is one line with the assumptions of the reader, and `titles` contains the names of input and output in
        the file. `lines` contains the line number of each row, or is None if the file does not consist of lines.
        """
        vars(self).update(titles=titles, _lines=lines, read_as=read_as)
        return self

    def to_csv(self, path: str | Path) -> None:
        """Write t, u, y and the covariates to the CSV file `path`. Reading the file gives bit-identical values.

        If there are several records, the column "record number" contains their numbers.
        """
        write_csv(path, {"t": self.t, "u": self.u, "y": self.y, **self._beside()})

    def _beside(self) -> dict[str, Array]:
        """Return the covariates by label and, of several records, their numbers."""
        columns = dict(zip(self.covariates.labels, self.covariates.values.T, strict=True))
        if len(self.starts) > 1:
            columns["record number"] = np.searchsorted(self.starts, np.arange(len(self.t)), side="right").astype(float)
        return columns

    def to_pandas(self) -> pandas.DataFrame:
        """Return the data as a data frame with the index ``t [s]`` and the columns u, y and covariates.

        The column names contain the units of measure in brackets. `hystfmu.read` converts the data frame back to a data
        set with the same values. If there are several records, the column "record number" contains their numbers.

        Raises
        ------
        MissingExtra
            pandas is not installed.
        """
        from hystfmu.base import extras

        with extras("to_pandas()"):
            import pandas
        labels = [f"{k} [{unit}]" if unit else k for k, unit in (("u", self.unit_u), ("y", self.unit_y))]
        columns = dict(zip(labels, (self.u, self.y), strict=True)) | self._beside()
        return pandas.DataFrame(columns, index=pandas.Index(self.t, name="t [s]"))
