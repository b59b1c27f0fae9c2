"""`read`: a file of measured data as a `Dataset`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data.dataset import LEAST_ROWS, Dataset, check_finite, line_of, resample_rows, row_of, train_rows
from hystfmu.data.reader.delimited import delimited
from hystfmu.data.reader.hdf5 import hdf5, is_hdf5
from hystfmu.data.reader.matlab import is_matlab, matlab
from hystfmu.data.reader.measures import TIME, split_name
from hystfmu.data.reader.roles import Roles, chosen
from hystfmu.data.reader.table import Table
from hystfmu.data.reader.text import content_of
from hystfmu.data.time_grid import check_time

MOST_BYTES = 256 * 2**20
ZIP = b"PK\x03\x04"


def read(
    path: str | Path,
    time: str | int = "",
    input: str | int = "",
    output: str | int | None = "",
    *,
    rate: float | None = None,
    train: slice | tuple[int, int] | str | None = None,
    resample: float | Literal["median"] | None = None,
    lag: int = 0,
    decimal: Literal[".", ","] | None = None,
    most: int = MOST_BYTES,
) -> Dataset:
    """Read a measurement from a file, as labs write them.

    Text in UTF-8, UTF-16 or cp1252, with commas, semicolons, tabs or blanks between the columns, a decimal point or a
    decimal comma, quotes, lines above the names, comments and a line of units of measure; the same packed by gzip; MAT
    files of version 5; HDF5 files (needs h5py).  `Dataset.read_as` says in one line what was assumed.  What could be
    read in two ways is refused.

    Parameters
    ----------
    path : str or Path
        The file.
    time, input, output : str or int
        Heading of a column with or without its unit of measure, ``"Zeit [ms]"`` or ``"Zeit"``, or its number from 1.
        Empty: recognised by its name, such as t, u, y, or by its unit of measure.  Output None: none is read.
    rate : float, optional
        Sample rate (Hz), instead of a time column.
    train : slice, (first, end) or "first:end", optional
        Data rows that a fit counts, from 0 on, the end excluded.
    resample : float or "median", optional
        Rate (Hz), or one over the median step, to bring uneven steps to; without it they are refused.
    lag : int
        Rows by which the sensor of the output is late: y of row k + lag belongs to u of row k.
    decimal : {".", ","}, optional
        Decimal sign, for numbers such as 1,234 that could be read in two ways.
    most : int
        Largest size of the file, and of what it unpacks to, in bytes.

    Returns
    -------
    Dataset
        Time in s, whatever the unit of measure in the file; input and output in those of the file.

    Raises
    ------
    InputError
        One line with file, line, column, rule and value.

    Examples
    --------
    >>> import hystfmu as hy
    >>> from pathlib import Path
    >>> rows = [f"{k * 0.5:.1f};{k};{k / 8}".replace(".", ",") for k in range(100)]
    >>> Path("piezo.csv").write_text("\\n".join(["Zeit [ms];Spannung [V];Weg [um]", *rows])) > 0
    True
    >>> data = hy.read("piezo.csv")
    >>> data
    Dataset('piezo', 100 rows, step 0.0005 s, u in V, y in um)
    >>> print(data.read_as)
    read piezo.csv: separator ';', decimal comma; time 'Zeit [ms]' in ms, input 'Spannung [V]', output 'Weg [um]'
    """
    if rate is not None and not (np.isfinite(rate) and rate > 0):
        raise InputError(f"{path}: The rate must be a finite number of Hz greater than 0. Got {rate} instead.")
    if decimal not in (None, ".", ","):
        raise InputError(f"{path}: The decimal sign must be '.' or ','. Got {decimal!r} instead.")
    table = table_in(path, decimal, most)
    roles = chosen(table, time, input, output, None, rate)
    order = [k for k in (roles.input, roles.output, roles.time) if k is not None]
    numbers = table.numbers(order)
    n = len(numbers)
    where = str(path)
    place = partial(row_of, where) if table.lines is None else partial(line_of, where, table.lines)
    for i, k in reversed(list(enumerate(order))):
        check_finite(numbers[:, i], table.columns[k].name or str(k + 1), place)
    u = numbers[:, 0]
    y: Array = np.full(n, np.nan) if roles.output is None else numbers[:, 1]
    t, unit = (np.arange(n) / rate, "") if rate is not None else _seconds(table, roles, numbers[:, -1])
    rows = slice(None)
    if n >= LEAST_ROWS:
        rows = train_rows(train, n, where)
        if resample is not None:
            t, u, y, rows = resample_rows(t, u, y, rows, None if resample == "median" else resample, where, place)
        elif rate is None:
            t = check_time(t, place, partial(_digits, table, roles))
    units = [table.columns[k].unit if k is not None else "" for k in (roles.input, roles.output)]
    made = Dataset(t, u, y, _stem(path), where, rows, *units)
    late = f", y {lag} row{'s' * (lag > 1)} late" if lag else ""
    assumed = _line(table, roles, unit, rate) + late
    return made.from_file(assumed, table.lines if resample is None else None).aligned(lag)


def table_in(path: str | Path, decimal: str | None, most: int) -> Table:
    """Read a file as a table, whatever its format.

    Raises
    ------
    InputError
        One line with file, line, rule and value.
    """
    content, packed = content_of(path, most)
    if is_matlab(content):
        return matlab(content, path, most)
    if is_hdf5(content):
        return hdf5(content, path, most)
    if content.startswith(ZIP):
        raise InputError(f"{path}: The file must be text, MAT or HDF5. Got a zip archive: save a workbook as CSV.")
    return delimited(content, path, decimal, packed)


def _seconds(table: Table, roles: Roles, t: Array) -> tuple[Array, str]:
    """Convert the time to s; return it with the unit of measure of the file."""
    assert roles.time is not None
    column = table.columns[roles.time]
    if column.unit and column.unit not in TIME:
        where = f"{table.path}: {table.named_in}: " if table.named_in else f"{table.path}: "
        raise InputError(
            f"{where}The {column.name!r} column must be a time in {', '.join(TIME)}. Got [{column.unit}] instead: give "
            "the sample rate in Hz (--rate)."
        )
    per_second, seconds = TIME[column.unit or "s"]
    return t / per_second * seconds, column.unit


def _digits(table: Table, roles: Roles) -> Array:
    assert roles.time is not None
    per_second, seconds = TIME[table.columns[roles.time].unit or "s"]
    return table.digits(roles.time) / per_second * seconds


def _line(table: Table, roles: Roles, unit: str, rate: float | None) -> str:
    """Say in one line what was assumed."""
    parts = []
    if rate is not None:
        parts.append(f"{rate:g} Hz")
    else:
        parts.append(f"time {_label(table, roles.time, False)} in {unit or 's (no unit of measure is stated)'}")
    parts.append(f"input {_label(table, roles.input)}")
    parts.append("no output" if roles.output is None else f"output {_label(table, roles.output)}")
    assumed = ", ".join(table.assumed)
    return f"read {Path(table.path).name}: {assumed + '; ' if assumed else ''}{', '.join(parts)}"


def _label(table: Table, k: int | None, with_unit: bool = True) -> str:
    assert k is not None
    column = table.columns[k]
    stated = f" in {column.unit}" if with_unit and column.unit and split_name(column.label)[1] != column.unit else ""
    return f"{column.label!r}{stated}" if column.label else f"column {k + 1}"


def _stem(path: str | Path) -> str:
    name = Path(path).name
    return Path(name.removesuffix(".gz")).stem or name
