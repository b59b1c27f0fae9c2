"""Columns of a record: checks of their values and time steps, covariates, and conversion to CSV text.

Covariates are measured inputs in addition to the input u, such as load or temperature.
"""

import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from hystfmu.base import Array, InputError, read_bytes, write_text
from hystfmu.base.printable import printable


def read_header(path: str | Path, most: int) -> tuple[list[str], str, str]:
    """Return the column names of a CSV file, its separator, and the text of its rows.

    Raises
    ------
    InputError
        The file cannot be read, has more than `most` bytes, is not UTF-8 text, or has no column names in line 1.
    """
    try:
        text = read_bytes(path, most).decode("utf-8-sig")
    except UnicodeDecodeError as e:
        raise InputError(f"{path}: The file must be UTF-8 text. Got an invalid byte at offset {e.start}.") from None
    if "\0" in text:
        raise InputError(f"{path}: The file must be UTF-8 text. Got a zero byte at offset {text.index(chr(0))}.")
    head, _, body = text.partition("\n")
    if not head.strip():
        raise InputError(f"{path}: line 1: The first line must name the columns. Got an empty line instead.")
    separator = next((s for s in ("\t", ";", ",") if s in head), ",")
    try:
        return [c.strip() for c in next(csv.reader([head.rstrip("\r")], delimiter=separator))], separator, body
    except csv.Error:  # a carriage return inside the line, or a name of more than 128 kB
        raise InputError(
            f"{path}: line 1: The first line must name the columns. Got {head.strip()[:60]!r} instead."
        ) from None


def csv_rows(columns: Iterable[Array]) -> str:
    """Return columns of equal length as CSV lines. Reading the lines gives bit-identical numbers."""
    text = io.StringIO()
    for row in zip(*(np.asarray(c, dtype=np.float64).tolist() for c in columns), strict=True):
        text.write(",".join(map(repr, row)) + "\n")
    return text.getvalue()


def csv_head(names: Iterable[str]) -> str:
    """Return the first CSV line with the column names, quoted if needed.

    A variable name of a foreign FMU may contain commas, quotes or line ends.
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(map(printable, names))
    return text.getvalue()


def csv_text(columns: dict[str, Array]) -> str:
    """Return columns of equal length as CSV text. The first line contains the column names."""
    return csv_head(columns) + csv_rows(columns.values())


def write_csv(path: str | Path, columns: dict[str, Array]) -> None:
    """Write columns of equal length atomically to the CSV file `path`."""
    write_text(path, csv_text(columns))


LEAST_ROWS = 4
SAME_STEP = 1e-3  # permitted relative difference between the steps of two records, caused by rounded times
_RANGE = re.compile(r"\s*(\d*)\s*:\s*(\d*)\s*\Z")


def train_rows(train: slice | Sequence[int] | str | None, n: int, where: str = "data") -> slice:
    """Convert training rows, e.g. the text "first:end", to a slice of the `n` rows of the data.

    Raises
    ------
    InputError
        `train` has a wrong form, there are fewer than 4 training rows, or they are outside the data.
    """
    if train is None:
        return slice(0, n)
    shown: object = train
    if isinstance(train, str):
        m = _RANGE.match(train)
        if not m:
            raise InputError(f"{where}: The training rows must read first:end, e.g. 2000:4200. Got {train!r} instead.")
        first, end = (int(m[1]) if m[1] else 0), (int(m[2]) if m[2] else n)
    elif isinstance(train, slice):
        shown = f"{train.start}:{train.stop}"
        if any(k is not None and not isinstance(k, (int, np.integer)) for k in (train.start, train.stop)):
            raise InputError(f"{where}: The training rows must be integers. Got {shown} instead.")
        if train.step not in (None, 1):
            raise InputError(f"{where}: The training rows must be consecutive. Got step {train.step} instead.")
        first = 0 if train.start is None else int(train.start)
        end = n if train.stop is None else int(train.stop)
    else:
        if len(train) != 2:
            raise InputError(f"{where}: The training rows must be two, first and end. Got {len(train)} instead.")
        first, end = (int(k) for k in train)
    if not 0 <= first < end <= n or end - first < LEAST_ROWS:
        raise InputError(
            f"{where}: The training rows must be at least {LEAST_ROWS} rows inside 0:{n}. Got {shown} instead."
        )
    return slice(first, end)


def starts_of(starts: Sequence[int], n: int, where: str) -> tuple[int, ...]:
    """Return the indices of the first rows of the records; the first must be 0, and no record may be too short."""
    found = tuple(int(s) for s in starts)
    if found[:1] != (0,) or any(b - a < LEAST_ROWS for a, b in zip(found, (*found[1:], n), strict=True)):
        raise InputError(
            f"{where}: The starts of records must be rows from 0 on, at least {LEAST_ROWS} apart, before {n}. "
            f"Got {found} instead."
        )
    return found


def check_one_step(t: Array, records: Sequence[slice], where: str) -> None:
    """Refuse times t (n,) in which the records have different time steps."""
    steps = [float(t[r][-1] - t[r][0]) / (r.stop - r.start - 1) for r in records]
    for k, step in enumerate(steps):
        if abs(step - steps[0]) > SAME_STEP * steps[0]:
            raise InputError(
                f"{where}: The records must have one step. Got {step:.6g} s in record {k + 1} after "
                f"{steps[0]:.6g} s in the first: resample them (--resample HZ)."
            )


def row_of(where: str, row: int, first: int = 0) -> str:
    """Return a text that names the data and a row, for a message; `row` is counted from row `first` of the data."""
    return f"{where}: row {first + row}"


def line_of(where: str, lines: Sequence[int], row: int) -> str:
    """Return a text that names the file and the line of a row, for a message; `lines` contains the line numbers."""
    return f"{where}: line {lines[row]}"


SCPI_CODES = (9.8999999e37, 9.9100001e37)  # SCPI 1999, 7.2.1: 9.9e37 is infinity, 9.91e37 not a number; 32 bits


def check_finite(column: Array, name: str, place: Callable[[int], str]) -> None:
    """Refuse a column (n,) with values that are not finite, or that SCPI instruments write for such values."""
    size = np.abs(column)
    coded = (size >= SCPI_CODES[0]) & (size <= SCPI_CODES[1])
    bad = ~np.isfinite(column) | coded
    if bad.any():
        n = int(np.argmax(bad))
        code = ", which instruments write for an overload or a missing value" if coded[n] else ""
        raise InputError(f"{place(n)}: The {name!r} column must hold finite numbers. Got {column[n]} instead{code}.")


STEP_TOLERANCE = 1e-6  # permitted deviation of a step, relative to the step


def check_increasing(t: Array, place: Callable[[int], str]) -> None:
    """Refuse times t (n,) in s that do not increase; `place` returns a text that identifies a row in the message."""
    back = np.diff(t) <= 0
    if back.any():
        n = int(np.argmax(back)) + 1
        hint = " Stamps that are too coarse need the sample rate in Hz (--rate)." if t[n] == t[n - 1] else ""
        raise InputError(f"{place(n)}: The time must increase. Got {t[n]:.12g} after {t[n - 1]:.12g} instead.{hint}")


def check_time(t: Array, place: Callable[[int], str], digits: Callable[[], Array] | None) -> Array:
    """Return times t (n,) in s with equal steps; refuse unequal steps that rounding does not explain.

    The steps may differ by 1e-6 of the step. Printed times may differ from a uniform grid by half a unit of their last
    digit, if this unit is at most a quarter of the step; then the times of the grid are returned. Coarser times could
    hide a missing sample. The function `digits` returns the value (s) of one unit of the last printed digit of each
    time; it is called only if needed. `place` returns a text that identifies a row in the message.

    Raises
    ------
    InputError
        The times do not increase, or the steps are unequal.
    """
    check_increasing(t, place)
    h = float(t[-1] - t[0]) / (len(t) - 1)
    error: Array = np.abs(np.diff(t) - h)
    if (error <= STEP_TOLERANCE * h + 4 * np.spacing(np.abs(t).max())).all():
        return t
    if digits:
        unit = digits()
        grid: Array = t[0] + h * np.arange(len(t))
        slack = STEP_TOLERANCE * h + 0.5 * unit + 0.5 * max(unit[0], unit[-1])
        if unit.max() <= h / 4 and (np.abs(t - grid) <= slack).all():
            return grid
    n = int(np.argmax(error)) + 1
    raise InputError(
        f"{place(n)}: The time must increase in equal steps (to 1e-6 of the step, or to the digits printed). "
        f"Got a step of {t[n] - t[n - 1]:.9g} s, the mean is {h:.9g} s: resample the record (--resample)."
    )


TAKEN = ("t", "u", "y", "time")  # names that a covariate cannot have
_LABEL = re.compile(r"\s*(.*?)\s*(?:\[([^\[\]]*)\]\s*)?")
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True, eq=False)
class Covariates:
    """Measured covariates: values (n, m), names and units of measure.

    The names are identifiers; a model uses the same names for its inputs. A unit of measure that is not stated is an
    empty text.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array

    def __bool__(self) -> bool:
        return bool(self.names)

    def __iter__(self) -> Iterator[tuple[str, str, Array]]:
        """Iterate over the covariates; yield name, unit of measure and values (n,) of each."""
        return iter(zip(self.names, self.units, self.values.T, strict=True))

    @property
    def labels(self) -> tuple[str, ...]:
        """Names with their units of measure, e.g. ``T [degC]``."""
        return tuple(f"{name} [{unit}]" if unit else name for name, unit in zip(self.names, self.units, strict=True))

    @property
    def ranges(self) -> dict[str, list[float]]:
        """Smallest and largest value of each covariate, by name."""
        return {name: [float(v.min()), float(v.max())] for name, _, v in self}

    @classmethod
    def none(cls, n: int) -> "Covariates":
        """Return an empty set of covariates for data of `n` rows."""
        return cls((), (), np.zeros((n, 0)))

    @classmethod
    def of(cls, given: Mapping[str, ArrayLike], n: int, where: str, place: Callable[[int], str]) -> "Covariates":
        """Return covariates from a dict of values (n,). A key is a name, optionally with a unit of measure.

        Examples of keys are ``T`` and ``T [degC]``.

        `where` is the name of the data for messages, and `place` returns a text that identifies a row.

        Raises
        ------
        InputError
            A name is not an identifier, is the name of another signal, or occurs twice. The error is also raised if the
            number of rows is wrong or a value is not finite.
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

    def rows(self, which: slice) -> "Covariates":
        """Return the covariates in the selected rows."""
        return Covariates(self.names, self.units, self.values[which])

    def at(self, new: Array, t: Array) -> "Covariates":
        """Return the covariates at the times `new` (m,), interpolated linearly between the times t (n,)."""
        columns = [np.interp(new, t, v) for _, _, v in self]
        return Covariates(self.names, self.units, np.column_stack([*columns, np.zeros((len(new), 0))]))

    @classmethod
    def joined(cls, parts: "Sequence[Covariates]") -> "Covariates":
        """Return the covariates of several records as one set, with the rows of all records."""
        return cls(parts[0].names, parts[0].units, np.vstack([part.values for part in parts]))


def split(label: str) -> tuple[str, str]:
    """Return name and unit of measure of a label such as ``T [degC]``."""
    m = _LABEL.fullmatch(label)
    return (label, "") if m is None else (m[1], (m[2] or "").strip())


def identifier(text: str, otherwise: str) -> str:
    """Return a column heading as an identifier, with underscores for invalid characters.

    If the heading does not start with a letter, the result is `otherwise`.
    """
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")
    if not _IDENTIFIER.fullmatch(name):
        return otherwise
    return f"{name}_" if name in TAKEN else name
