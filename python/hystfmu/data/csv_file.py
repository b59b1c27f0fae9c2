"""CSV files: reads named columns of untrusted files with one-line errors, writes columns without loss of a bit."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes, write_text

_SPACES = re.compile(r"^[ \t]+\r?$", re.MULTILINE)
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+\s*\Z")


@dataclass(frozen=True)
class Columns:
    """Named columns of a CSV file.

    Attributes
    ----------
    values : dict of str to array, shape (n,)
        Numbers by column name.
    units : dict of str to str
        Units of measure by column name: the text in brackets behind the name, or empty.
    printed : function
        Returns the cells of a column as the file prints them.
    lines : sequence of int, length n
        The line of each data row, counted from 1 as an editor does.
    """

    values: dict[str, Array]
    units: dict[str, str]
    printed: Callable[[str], list[str]]
    lines: Sequence[int]


def read_header(path: str | Path, most: int) -> tuple[list[str], str, str]:
    """Read the column names, the separator, and the text of the rows.

    Raises
    ------
    InputError
        The file cannot be read, has more than `most` bytes, is not UTF-8 text, or its first line names no columns.
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
    except csv.Error:  # a carriage return inside the line, a name of more than 128 kB
        raise InputError(
            f"{path}: line 1: The first line must name the columns. Got {head.strip()[:60]!r} instead."
        ) from None


def read_columns(path: str | Path, names: list[str], most: int, time: str) -> Columns:
    """Read named columns of a file.

    Parameters
    ----------
    path : path
        File to read.
    names : list of str
        Columns to read.
    most : int
        Largest size of the file in bytes.
    time : str
        Name of the time column, for the hint when it is missing.

    Returns
    -------
    Columns

    Raises
    ------
    InputError
        One line with file, line, column, rule and value.
    """
    header, separator, body = read_header(path, most)
    head = separator.join(header)
    if all(_number(c) is not None for c in header):
        raise InputError(
            f"{path}: line 1: The first line must name the columns, e.g. t,u,y. Got the numbers "
            f"{head.strip()[:60]!r} instead."
        )
    place: dict[str, int] = {}
    units = dict.fromkeys(names, "")
    for k, cell in enumerate(header):
        base, unit = _name_and_unit(cell)
        for name in names:
            if name in (cell, base):
                if name in place:
                    raise InputError(
                        f"{path}: line 1: The column {name!r} must occur once. Got two in {', '.join(header)[:200]}."
                    )
                place[name] = k
                units[name] = unit if name == base else ""
    for name in names:
        if name not in place:
            hint = " Name the columns with --time, --input, --output."
            hint += " Without a time column give the sample rate in Hz (--rate)." if name == time else ""
            have = ", ".join(header)[:200]
            raise InputError(f"{path}: line 1: The columns must include {name!r}. Got {have} instead.{hint}")
    order = [place[n] for n in names]
    if not body.strip():
        raise InputError(f"{path}: The file must have data rows after its first line. Got none.")
    whole = not _SPACES.search(body)  # numpy skips empty lines, but not those of spaces
    rows = body if whole else "\n".join(line for _, line in _numbered(body))
    try:
        table = np.loadtxt(io.StringIO(rows), delimiter=separator, usecols=order, ndmin=2, comments=None)
        if body.count(separator) != len(table) * (len(header) - 1):
            raise ValueError("rows and first line differ in their number of cells")
    except ValueError:
        raise InputError(_first_bad(path, body, separator, header, names, order)) from None

    def printed(name: str) -> list[str]:
        return [line.split(separator)[place[name]] for _, line in _numbered(body)]

    n = len(table)
    dense = body.rstrip().count("\n") == n - 1  # no empty lines between the rows
    lines = range(2, n + 2) if dense else tuple(k for k, _ in _numbered(body))
    return Columns({name: table[:, i] for i, name in enumerate(names)}, units, printed, lines)


def _numbered(body: str) -> list[tuple[int, str]]:
    """Number the lines that hold data as an editor does; the column names are line 1."""
    return [(k, line) for k, line in enumerate(body.splitlines(), 2) if line.strip()]


def _name_and_unit(cell: str) -> tuple[str, str]:
    """Split a name from the unit of measure behind it in square or round brackets: ``u [V]``, ``u (V)``."""
    m = re.fullmatch(r"(.*?)\s*(?:\[(.*)\]|\((.*)\))", cell)
    return (m[1], (m[2] or m[3] or "").strip()) if m else (cell, "")


def _first_bad(
    path: str | Path, body: str, separator: str, header: list[str], names: list[str], order: list[int]
) -> str:
    """Return the message about the first line that cannot be read."""
    for n, line in _numbered(body):
        cells = line.split(separator)
        if len(cells) != len(header):
            hint = ""
            if cells[-1].strip() == "":
                hint = f" It ends with {separator!r}, line 1 does not."
            elif separator == "," and len(cells) > len(header):
                hint = " Numbers need a decimal point: is this a decimal comma?"
            return (
                f"{path}: line {n}: The line must have {len(header)} cells, as line 1. "
                f"Got {len(cells)} cells in {line[:60]!r}.{hint}"
            )
        for name, k in zip(names, order, strict=True):
            if _number(cells[k]) is None:
                got = f"{cells[k].strip()[:40]!r}"
                if _DECIMAL_COMMA.match(cells[k].strip().strip('"')):
                    got = f"the decimal comma {got}"
                return f"{path}: line {n}: The {name!r} column must hold numbers, with a point. Got {got} instead."
    return f"{path}: The rows must hold numbers. Got text that cannot be read."


def _number(text: str) -> float | None:
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None


def csv_rows(columns: Iterable[Array]) -> str:
    """Format columns of equal length as lines; every number reads back to the same bits."""
    text = io.StringIO()
    for row in zip(*(np.asarray(c, dtype=np.float64).tolist() for c in columns), strict=True):
        text.write(",".join(map(repr, row)) + "\n")
    return text.getvalue()


def csv_text(columns: dict[str, Array]) -> str:
    """Format columns of equal length as CSV text with a first line of names."""
    return ",".join(columns) + "\n" + csv_rows(columns.values())


def write_csv(path: str | Path, columns: dict[str, Array]) -> None:
    """Write columns to the CSV file `path`, atomically."""
    write_text(path, csv_text(columns))
