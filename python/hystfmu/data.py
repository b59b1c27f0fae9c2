"""Measured data: time, input and output of one run, read from CSV and refused with one clear line when a row is bad."""

from __future__ import annotations

import csv
import hashlib
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from hystfmu.core import Array
from hystfmu.errors import InputError
from hystfmu.files import read_bytes, write_text

LEAST_ROWS = 4
STEP_TOLERANCE = 1e-6  # relative to the step
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+\s*\Z")
_RANGE = re.compile(r"\s*(\d*)\s*:\s*(\d*)\s*\Z")


@dataclass(frozen=True, eq=False)
class Dataset:
    """One run of an experiment, evenly sampled.

    Parameters
    ----------
    t : array, shape (n,)
        Time in s, increasing in equal steps.
    u, y : array, shape (n,)
        Input and output of the actuator or sensor.  A y that is NaN in every row means "no output was measured": a
        model can still predict it.
    name : str
        A short name for tables.
    path : str
        Where it was read from; empty for generated data.
    train : slice, tuple (first, end) or str "first:end", optional
        Rows whose residuals count in an identification, counted from 0, the end excluded; default all.  A model
        always runs from row 0, because its memory needs the whole history.
    unit_u, unit_y : str
        Units of input and output.

    Raises
    ------
    InputError
        Lengths that differ, fewer than 4 rows, a value that is not finite, time that does not increase in equal
        steps, a train range outside the data.
    """

    t: Array
    u: Array
    y: Array
    name: str = "data"
    path: str = ""
    train: slice = field(default_factory=lambda: slice(None))
    unit_u: str = ""
    unit_y: str = ""

    def __post_init__(self) -> None:
        where = self.path or self.name
        for key in ("t", "u", "y"):
            column = np.array(getattr(self, key), dtype=np.float64)  # a copy: the dataset must not change under a model
            if column.ndim != 1:
                raise InputError(f"{where}: {key} must be one-dimensional; got shape {column.shape}")
            column.flags.writeable = False
            object.__setattr__(self, key, column)
        lengths = {len(self.t), len(self.u), len(self.y)}
        if len(lengths) > 1:
            raise InputError(
                f"{where}: t, u, y must have equal lengths; got {len(self.t)}, {len(self.u)}, {len(self.y)}"
            )
        if len(self.t) < LEAST_ROWS:
            raise InputError(f"{where}: at least {LEAST_ROWS} rows are needed; got {len(self.t)}")
        for key in ("t", "u", "y") if self.has_output else ("t", "u"):
            _check_finite(getattr(self, key), key, where)
        _check_time(self.t, where, None)
        object.__setattr__(self, "train", train_rows(self.train, len(self.t), where))

    @property
    def has_output(self) -> bool:
        """Was an output measured?"""
        return not bool(np.isnan(self.y).all())

    @property
    def h(self) -> float:
        """Sample step in s."""
        h = float(self.t[-1] - self.t[0]) / (len(self.t) - 1)
        short = float(f"{h:.12g}")  # 0.005, not 0.0050000000000000001 from the rounding of the last time
        return short if abs(short - h) <= 1e-13 * h else h

    @property
    def sha256(self) -> str:
        """Hash over the values of t, u, y: which data a model came from."""
        return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in (self.t, self.u, self.y))).hexdigest()

    @property
    def span(self) -> float:
        """Range of the output over the training rows: 100 % of full scale (%FS)."""
        return float(np.ptp(self.y[self.train]))

    @classmethod
    def from_csv(
        cls,
        path: str | Path,
        time: str = "t",
        input: str = "u",
        output: str | None = "y",
        rate: float | None = None,
        train: slice | tuple[int, int] | str | None = None,
        resample: float | Literal["median"] | None = None,
        most: int = 256 * 2**20,
    ) -> Dataset:
        """Read a CSV file whose first line names the columns.

        Columns are separated by commas, semicolons or tabs; numbers have a decimal point.  A name may carry its unit
        in brackets, ``u [V]``.  In messages, data rows are counted from 0: row 0 is the line after the names.

        Parameters
        ----------
        path : path
            The file.
        time, input, output : str
            Names of the columns; output None: the file has no measured output.
        rate : float, optional
            Sample rate in Hz, instead of a time column.
        train : slice, (first, end) or "first:end", optional
            Rows of the file whose residuals count.
        resample : float or "median", optional
            Rate in Hz, or one over the median step, to bring uneven steps to (`hystfmu.resampling`); without it they
            are refused.
        most : int
            Largest size of the file in bytes.

        Raises
        ------
        InputError
            One line with file, row or column, rule and value.
        """
        if rate is not None and not (np.isfinite(rate) and rate > 0):
            raise InputError(f"{path}: the rate must be a finite number of Hz greater than 0; got {rate}")
        wanted = [None if rate is not None else time, input, output]
        names = [name for name in wanted if name is not None]
        columns, units, cells = _read_columns(path, names, most, "" if rate is not None else time)
        for name in names:
            _check_finite(columns[name], name, str(path))
        n = len(columns[input])
        y: Array = np.full(n, np.nan) if output is None else columns[output]
        t: Array = columns[time] if rate is None else np.arange(n) / rate
        u, rows = columns[input], slice(None)
        if n >= LEAST_ROWS:
            rows = train_rows(train, n, str(path))
            if resample is not None:
                t, u, y, rows = _resampled(t, u, y, rows, None if resample == "median" else resample, str(path))
            elif rate is None:
                t = _check_time(t, str(path), cells)
        return cls(t, u, y, Path(path).stem, str(path), rows, units[input], "" if output is None else units[output])

    @classmethod
    def from_signal(cls, u: Array, y: Array, h: float = 1.0, name: str = "data", train: slice | None = None) -> Dataset:
        """A dataset from input and output rows that are `h` seconds apart, the first at t = 0."""
        t = np.arange(len(u), dtype=np.float64) * np.float64(h)
        return cls(t, u, y, name, train=slice(None) if train is None else train)

    def with_train(self, train: slice | tuple[int, int] | str | None) -> Dataset:
        """The same data with other rows counted in an identification."""
        return replace(self, train=train_rows(train, len(self.t), self.path or self.name))

    def resampled(self, rate: float) -> Dataset:
        """The same run at another rate in Hz; the train rows cover the same time.

        Raises
        ------
        InputError
            A rate that the rows cannot give; fewer than 4 rows left.
        """
        t, u, y, rows = _resampled(self.t, self.u, self.y, self.train, rate, self.path or self.name)
        return replace(self, t=t, u=u, y=y, train=rows)

    def with_output(self, y: Array) -> Dataset:
        """The same time and input with another output, e.g. a prediction."""
        return replace(self, y=y)

    def to_csv(self, path: str | Path) -> None:
        """Write columns t, u, y with all their digits."""
        write_csv(path, {"t": self.t, "u": self.u, "y": self.y})


def write_csv(path: str | Path, columns: dict[str, Array]) -> None:
    """Write columns of equal length under their names; every number reads back to the same bits."""
    text = io.StringIO()
    text.write(",".join(columns) + "\n")
    for row in zip(*(np.asarray(c, dtype=np.float64).tolist() for c in columns.values()), strict=True):
        text.write(",".join(map(repr, row)) + "\n")
    write_text(path, text.getvalue())


def train_rows(train: slice | Sequence[int] | str | None, n: int, where: str = "data") -> slice:
    """Rows "first:end" as a slice with both ends set and inside 0..n.

    Raises
    ------
    InputError
        If it is not of that form, empty, or outside the data.
    """
    if train is None:
        return slice(0, n)
    shown: object = train
    if isinstance(train, str):
        m = _RANGE.match(train)
        if not m:
            raise InputError(f"{where}: the train rows must read first:end, e.g. 2000:4200; got {train!r}")
        first, end = (int(m[1]) if m[1] else 0), (int(m[2]) if m[2] else n)
    elif isinstance(train, slice):
        shown = f"{train.start}:{train.stop}"
        if any(k is not None and not isinstance(k, (int, np.integer)) for k in (train.start, train.stop)):
            raise InputError(f"{where}: the train rows must be integers; got {shown}")
        if train.step not in (None, 1):
            raise InputError(f"{where}: the train rows must be consecutive; got step {train.step}")
        first = 0 if train.start is None else int(train.start)
        end = n if train.stop is None else int(train.stop)
    else:
        first, end = (int(k) for k in train)
    if not 0 <= first < end <= n or end - first < LEAST_ROWS:
        raise InputError(f"{where}: the train rows must be at least {LEAST_ROWS} rows inside 0:{n}; got {shown}")
    return slice(first, end)


# ---- reading ---------------------------------------------------------------------------------------------------------
def _read_columns(
    path: str | Path, names: list[str], most: int, time: str
) -> tuple[dict[str, Array], dict[str, str], list[str]]:
    """Columns by name, their units, and the printed times (only where their digits matter, else empty)."""
    try:
        text = read_bytes(path, most).decode("utf-8-sig")
    except UnicodeDecodeError as e:
        raise InputError(f"{path}: not a text file in UTF-8 (byte {e.start})") from None
    if "\0" in text:
        raise InputError(f"{path}: not a text file (it contains a zero byte)")
    head, _, body = text.partition("\n")
    if not head.strip():
        raise InputError(f"{path}: the first line must name the columns; it is empty")
    separator = next((s for s in ("\t", ";", ",") if s in head), ",")
    header = [c.strip() for c in next(csv.reader([head.rstrip("\r")], delimiter=separator))]
    if all(_number(c) is not None for c in header):
        raise InputError(
            f"{path}: the first line must name the columns, e.g. t,u,y; got numbers: {head.strip()[:60]!r}"
        )
    place: dict[str, int] = {}
    units = dict.fromkeys(names, "")
    for k, cell in enumerate(header):
        base = re.sub(r"\s*\[.*\]\s*\Z", "", cell)
        for name in names:
            if name in (cell, base):
                if name in place:
                    raise InputError(f"{path}: two columns are named {name!r}; columns: {', '.join(header)}")
                place[name] = k
                units[name] = cell[len(base) :].strip().strip("[]").strip() if name == base else ""
    for name in names:
        if name not in place:
            hint = "; give the sample rate in Hz if there is no time column" if name == time else ""
            raise InputError(f"{path}: no column {name!r}; columns: {', '.join(header)[:200]}{hint}")
    order = [place[n] for n in names]
    if not body.strip():
        raise InputError(f"{path}: no data rows after the line of column names")
    try:
        table = np.loadtxt(io.StringIO(body), delimiter=separator, usecols=order, ndmin=2, comments=None)
        if body.count(separator) != len(table) * (len(header) - 1):
            raise ValueError("rows and names differ in their number of cells")
    except ValueError:
        raise InputError(_first_bad(path, body, separator, header, names, order)) from None
    cells: list[str] = []
    if _uneven(table, names, time):
        cells = [line.split(separator)[place[time]] for line in body.splitlines() if line.strip()]
    return {n: table[:, i] for i, n in enumerate(names)}, units, cells


def _first_bad(
    path: str | Path, body: str, separator: str, header: list[str], names: list[str], order: list[int]
) -> str:
    """The sentence about the first row that cannot be read."""
    lines = (line for line in body.splitlines() if line.strip())
    for n, line in enumerate(lines):
        cells = line.split(separator)
        if len(cells) != len(header):
            many = separator == "," and len(cells) > len(header)
            comma = "; is it a decimal comma? numbers need a decimal point" if many else ""
            return f"{path}: row {n} has {len(cells)} cells, the line of names has {len(header)}{comma}: {line[:60]!r}"
        for name, k in zip(names, order, strict=True):
            if _number(cells[k]) is None:
                if _DECIMAL_COMMA.match(cells[k].strip().strip('"')):
                    return f"{path}: row {n}, column {name!r}: decimal comma; use a decimal point: {cells[k].strip()!r}"
                return f"{path}: row {n}, column {name!r}: not a number: {cells[k].strip()[:40]!r}"
    return f"{path}: the rows cannot be read as numbers"


def _number(text: str) -> float | None:
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None


# ---- checks ----------------------------------------------------------------------------------------------------------
def _check_finite(column: Array, name: str, where: str) -> None:
    bad = ~np.isfinite(column)
    if bad.any():
        n = int(np.argmax(bad))
        raise InputError(f"{where}: row {n}, column {name!r}: must be finite; got {column[n]}")


def _step_error(t: Array) -> tuple[float, Array]:
    h = float(t[-1] - t[0]) / (len(t) - 1)
    error: Array = np.abs(np.diff(t) - h)
    return h, error


def _uneven(table: Array, names: list[str], time: str) -> bool:
    """Does the time column need a look at its printed digits?"""
    if time not in names or len(table) < LEAST_ROWS:
        return False
    t = table[:, names.index(time)]
    if not np.isfinite(t).all():
        return False
    h, error = _step_error(t)
    return bool(h > 0 and (error > STEP_TOLERANCE * h).any())


def _resampled(
    t: Array, u: Array, y: Array, rows: slice, rate: float | None, where: str
) -> tuple[Array, Array, Array, slice]:
    """New t, u, y, and the new rows within the time of the old ones."""
    from hystfmu.resampling import resample

    _check_increasing(t, where)
    new, u, y = resample(t, u, y, rate, where)
    first, end = np.searchsorted(new, t[rows][[0, -1]] + [-1e-9, 1e-9] * np.diff(new[:2]))
    return new, u, y, train_rows((int(first), int(end)), len(new), f"{where}, resampled")


def _check_increasing(t: Array, where: str) -> None:
    back = np.diff(t) <= 0
    if back.any():
        n = int(np.argmax(back)) + 1
        raise InputError(f"{where}: row {n}: time must increase; got {t[n]:.12g} after {t[n - 1]:.12g}")


def _check_time(t: Array, where: str, cells: list[str] | None) -> Array:
    """Time in equal steps; with the printed cells, times rounded to their digits are put back on the grid.

    Steps may differ by 1e-6 of the step.  Printed times may instead lie off the even grid by half a unit of their last
    digit, as long as that unit is at most a quarter of the step: coarser digits could hide a missing sample.
    """
    _check_increasing(t, where)
    h, error = _step_error(t)
    if (error <= STEP_TOLERANCE * h + 4 * np.spacing(np.abs(t).max())).all():
        return t
    if cells:
        unit = np.array([_last_digit(c) for c in cells])
        grid: Array = t[0] + h * np.arange(len(t))
        slack = STEP_TOLERANCE * h + 0.5 * unit + 0.5 * max(unit[0], unit[-1])
        if unit.max() <= h / 4 and (np.abs(t - grid) <= slack).all():
            return grid
    n = int(np.argmax(error)) + 1
    raise InputError(
        f"{where}: row {n}: time must increase in equal steps (to 1e-6 of the step, or to the digits printed); "
        f"got a step of {t[n] - t[n - 1]:.9g} s, the mean is {h:.9g} s; resample on request (--resample)"
    )


def _last_digit(text: str) -> float:
    """The value of one unit in the last printed digit."""
    mantissa, _, exponent = text.strip().lower().partition("e")
    return 10.0 ** ((int(exponent) if exponent else 0) - len(mantissa.partition(".")[2]))
