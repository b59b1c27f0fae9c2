"""The function `read`, which converts a file of measured data to a `Dataset`."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hystfmu.base import Array, InputError, checked
from hystfmu.data.columns import (
    LEAST_ROWS,
    Covariates,
    check_finite,
    check_time,
    identifier,
    line_of,
    row_of,
    train_rows,
)
from hystfmu.data.dataset import Dataset
from hystfmu.data.reader.arrays import NAME, Frame, confined, format_of, frame, is_frame
from hystfmu.data.reader.clock import Clock, clock_of
from hystfmu.data.reader.delimited import content_of, delimited
from hystfmu.data.reader.roles import Roles, chosen
from hystfmu.data.reader.table import Table, split_name
from hystfmu.data.reversals import resample as resampled
from hystfmu.data.reversals import unevenness

MOST_BYTES = 256 * 2**20
MOST_TITLE = 80  # maximum number of characters of a heading that a model stores


@checked
def read(
    path: str | Path | Frame | Sequence[str | Path | Frame],
    time: str | int = "",
    input: str | int = "",
    output: str | int | None = "",
    *,
    rate: float | None = None,
    train: slice | tuple[int, int] | str | None = None,
    resample: float | Literal["median"] | None = None,
    lag: int = 0,
    record: str | int | None = None,
    covariates: Sequence[str | int] = (),
    decimal: Literal[".", ","] | None = None,
    most: int = MOST_BYTES,
) -> Dataset:
    """Read measured data from files or from data frames.

    A text file is encoded in UTF-8, UTF-16, cp1252 or cp932 (Shift-JIS). Its columns are separated by commas,
    semicolons, tabs or blanks, and its numbers have a decimal point or a decimal comma. It may contain quotes,
    comments, a line of units of measure, and lines above the headings, such as headers of LabVIEW and of oscilloscopes.
    It may be compressed with gzip. Further formats are npy, npz, and MAT files with arrays and structs of dSPACE and
    Simulink. The extra ``files`` adds HDF5, MAT of version 7.3, xlsx, parquet, feather and TDMS.

    A time may be a number, a date with a time of day, or a count since 1970. The size of such a count determines its
    unit of measure. A file without a time column may state its sampling rate. `Dataset.read_as` states all assumptions
    in one line. Ambiguous data are refused.

    Parameters
    ----------
    path : str, Path, data frame, dict or array, or sequence of them
        A file, or data in columns: a data frame of pandas, polars or pyarrow, a dict of arrays, or an array (n, 3) of
        time, input and output. If several files are given, each file is a record, and a model starts each record from
        rest.
    time : str or int
        Heading of the time column, such as ``"Zeit [ms]"``, or its number, counted from 1. The heading may omit the
        unit of measure (``"Zeit"``). By default, the reader recognises the columns of t, u and y by their names or
        units of measure.
    input : str or int
        Input column, specified like `time`.
    output : str or int, optional
        Output column, specified like `time`.

        If it is None, no output is read.
    rate : float, optional
        Sample rate (Hz) of a file without a time column.
    train : slice, (first, end) or "first:end", optional
        Training rows, as ``first:end``. The fit minimises the error on these rows only, but the simulation of the model
        always starts at row 0.

        Rows are counted from 0, and the end is excluded. The rows of several
        records are numbered consecutively.
    resample : float or "median", optional
        New sampling rate (Hz) for a record with unequal time steps, or "median" for the median step.

        Without this option, such a
        record is resampled, with a remark, only if at most 2 % of the samples were lost and time stamps deviate by at
        most 0.3 steps. Other records with unequal steps are refused.
    lag : int in [0, inf)
        Delay of the output sensor in rows. The reader assigns y of row k + lag to u of row k.
    record : str or int, optional
        Column with the number of the record. A new record starts at each row where this number changes.
    covariates : sequence of str or int
        Columns of measured inputs beside u, such as load or temperature, specified like `input`. The reader never
        recognises these columns by name.
    decimal : {".", ","}, optional
        Decimal sign of the numbers. It must be given if the numbers are ambiguous, such as 1,234.
    most : int
        Maximum size of the file in bytes, before and after decompression.

    Returns
    -------
    Dataset
        Data with the time in s, and with input and output in the units of measure of the file.

    Raises
    ------
    InputError
        The data cannot be read. The message is one line with the file, the line, the column, the rule and the value.

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
    paths = _several(path)
    where = paths[0] if isinstance(paths[0], (str, os.PathLike)) else NAME
    if rate is not None and not (isinstance(rate, (int, float, np.number)) and np.isfinite(rate) and rate > 0):
        raise InputError(f"{where}: The rate must be a finite number of Hz greater than 0. Got {rate!r} instead.")
    if decimal not in (None, ".", ","):
        raise InputError(f"{where}: The decimal sign must be '.' or ','. Got {decimal!r} instead.")
    pieces: list[_Piece] = []
    for each in paths:
        table = table_in(each, decimal, most)
        roles = chosen(table, time, input, output, record, rate, covariates)
        table = table.stepped(roles.order, roles.time is not None or rate is not None)
        timed = [roles.time] if roles.time is not None and table.columns[roles.time].kind != "clock" else []
        numbers = table.source.numbers([*roles.order, *timed])
        records = _records(table, roles, len(numbers))
        clock = clock_of(table, roles.time, rate, numbers[:, -1], records[0])
        pieces += [_Piece(table, roles, rows, numbers[rows], clock) for rows in records]
    if len(pieces) == 1:
        return _dataset(pieces[0], train, resample, lag)
    return Dataset.joined([_dataset(piece, None, resample, lag) for piece in pieces], train)


def dataset_of(given: object, output: bool = True) -> Dataset:
    """Return a data set unchanged, or convert a data frame or a dict of columns; with `output`, an output must exist.

    Raises
    ------
    InputError
        `read` refuses the data.
    """
    if isinstance(given, Dataset):
        return given
    if isinstance(given, (str, os.PathLike, np.ndarray)) or not is_frame(given):
        raise InputError(
            f"The data must be a Dataset or a data frame. Got {type(given).__name__} instead. hy.read(path) and "
            "hy.Dataset(t, u, y) make a Dataset."
        )
    columns: Any = given
    try:
        return read(columns)
    except InputError:
        if output:
            raise
        return read(columns, output=None)


def _several(path: object) -> list[Any]:
    """Return one or several files or data frames as a list."""
    paths = list(path) if isinstance(path, (list, tuple)) else [path]
    if not paths:
        raise InputError("The files to read must be at least one. Got none.")
    for each in paths:
        if not isinstance(each, (str, os.PathLike)) and not is_frame(each):
            raise InputError(
                "The data to read must be a path, a data frame, a dict of columns or an array. "
                f"Got {type(each).__name__} instead."
            )
    return paths


@dataclass(frozen=True)
class _Piece:
    """One record of a file: its rows, its columns in the order of `Roles.order`, and the times of its rows."""

    table: Table
    roles: Roles
    rows: slice
    numbers: Array
    clock: Clock


def _records(table: Table, roles: Roles, n: int) -> list[slice]:
    """Return the rows of each record. A record consists of consecutive rows with the same text in the record column."""
    if roles.record is None:
        return [slice(0, n)]
    words = table.source.words(roles.record)
    starts = [0, *(k for k in range(1, n) if words[k] != words[k - 1])]
    for k, (a, b) in enumerate(zip(starts, [*starts[1:], n], strict=True), 1):
        if b - a < LEAST_ROWS:
            raise InputError(
                f"{_place(table)(a)}: A record must have at least {LEAST_ROWS} rows. Got {b - a} in record {k}, "
                f"{words[a][:40]!r}."
            )
    return [slice(a, b) for a, b in zip(starts, [*starts[1:], n], strict=True)]


def _place(table: Table, rows: slice = slice(0, None)) -> Callable[[int], str]:
    """Return a function that returns, for a row of a record, a text that identifies this row in messages."""
    if table.lines is None:
        return lambda k: row_of(table.path, rows.start + k)
    lines = table.lines[rows]
    return partial(line_of, table.path, lines)


def _dataset(
    piece: _Piece,
    train: slice | tuple[int, int] | str | None,
    resample: float | Literal["median"] | None,
    lag: int,
) -> Dataset:
    """Return the data set of one record."""
    table, roles, numbers = piece.table, piece.roles, piece.numbers
    n, place = len(numbers), _place(table, piece.rows)
    for i, k in reversed(list(enumerate(roles.order))):
        check_finite(numbers[:, i], table.columns[k].name or str(k + 1), place)
    u = numbers[:, 0]
    y: Array = np.full(n, np.nan) if roles.output is None else numbers[:, 1]
    beside = _covariates(piece)
    t, digits, said = piece.clock.t[piece.rows], piece.clock.digits, piece.clock.said
    if roles.time is not None:
        check_finite(t, table.columns[roles.time].name or str(roles.time + 1), place)
    rows, mended = slice(None), False
    if n >= LEAST_ROWS:
        rows = train_rows(train, n, table.path)
        to = None if resample == "median" else resample
        if resample is None and digits is not None:
            try:
                t = check_time(t, place, lambda: digits()[piece.rows])
            except InputError:
                if (uneven := unevenness(t)) is None:
                    raise
                to, mended = uneven.rate, True
                said = f"{said}, {uneven}"
        if resample is not None or mended:
            even, u, y, rows = resampled(t, u, y, to, table.path, place, rows)
            t, beside = even, beside.at(even, t)
    unit_u = table.columns[roles.input].unit
    unit_y = "" if roles.output is None else table.columns[roles.output].unit
    name = Path(table.path).name
    stem = Path(name.removesuffix(".gz")).stem or name
    made = Dataset(t, u, y, stem, table.path, rows, unit_u, unit_y, covariates=beside)
    lines = None if table.lines is None or resample is not None or mended else table.lines[piece.rows]
    titles = (_title(table, roles.input), "" if roles.output is None else _title(table, roles.output))
    return made.from_file(_line(table, roles, said, lag), lines, titles).aligned(lag)


def _title(table: Table, k: int) -> str:
    """Return the name of a column as one printable line of limited length."""
    return "".join(c for c in " ".join(table.columns[k].name.split()) if c.isprintable())[:MOST_TITLE]


def _covariates(piece: _Piece) -> Covariates:
    """Return the covariates of a record, each named after the heading of its column."""
    table, roles = piece.table, piece.roles
    columns = [table.columns[k] for k in roles.covariates]
    names = [identifier(c.name, f"column_{k + 1}") for k, c in zip(roles.covariates, columns, strict=True)]
    for k, name in zip(roles.covariates, names, strict=True):
        if names.count(name) > 1:
            raise InputError(
                f"{table.path}: The covariates must have different names. Got {name!r} twice, once of {table.title(k)}."
            )
    first = 1 if roles.output is None else 2
    return Covariates(tuple(names), tuple(c.unit for c in columns), piece.numbers[:, first : first + len(names)].copy())


def table_in(path: str | Path | Frame, decimal: str | None, most: int) -> Table:
    """Return the table of a file in any supported format, or of a data frame.

    Raises
    ------
    InputError
        The data cannot be read. The message is one line with the file, the line, the rule and the value.
    """
    if not isinstance(path, (str, os.PathLike)):
        return frame(path, most)
    content, packed = content_of(path, most)
    if form := format_of(content, path):
        return confined(content, form, path, decimal, most)
    return delimited(content, path, decimal, packed)


def _line(table: Table, roles: Roles, said: str, lag: int) -> str:
    """Return one line with the assumptions of the reader. It begins with the least certain assumptions."""
    parts = [said if roles.time is None else f"time {_label(table, roles.time, False)} {said}"]
    parts.append(f"input {_label(table, roles.input)}")
    parts.append("no output" if roles.output is None else f"output {_label(table, roles.output)}")
    parts[-1] += ", by their order" if roles.by_order else ""
    for k in roles.covariates:
        name = identifier(table.columns[k].name, f"column_{k + 1}")
        parts.append(f"covariate {_label(table, k)}" + (f" as {name}" if name != table.columns[k].name else ""))
    parts += [] if roles.record is None else [f"records by {_label(table, roles.record)}"]
    parts += [f"y {lag} row{'s' * (lag > 1)} late"] if lag else []
    assumed = ", ".join(table.assumed)
    return f"read {Path(table.path).name}: {assumed + '; ' if assumed else ''}{', '.join(parts)}"


def _label(table: Table, k: int, with_unit: bool = True) -> str:
    column = table.columns[k]
    stated = f" in {column.unit}" if with_unit and column.unit and split_name(column.label)[1] != column.unit else ""
    return f"{column.label!r}{stated}" if column.label else f"column {k + 1}"
