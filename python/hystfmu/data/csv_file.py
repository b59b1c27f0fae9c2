"""CSV files of strangers: named columns of numbers, refused with one clear line when a row is bad; and writing them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes, write_text

_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+\s*\Z")


def read_header(path: str | Path, most: int) -> tuple[list[str], str, str]:
    """The names of the columns, the separator, and the text of the rows.

    Raises
    ------
    InputError
        The file cannot be read, is larger than `most` bytes, no text in UTF-8, or its first line names no columns.
    """
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
    try:
        return [c.strip() for c in next(csv.reader([head.rstrip("\r")], delimiter=separator))], separator, body
    except csv.Error:  # a carriage return inside the line, a name of more than 128 kB
        raise InputError(f"{path}: the first line must name the columns; got {head.strip()[:60]!r}") from None


def read_columns(
    path: str | Path, names: list[str], most: int, time: str
) -> tuple[dict[str, Array], dict[str, str], Callable[[str], list[str]]]:
    """Named columns of a file.

    Parameters
    ----------
    path : path
    names : list of str
        The columns to read.
    most : int
        Largest size of the file in bytes.
    time : str
        Name of the time column, for the hint when there is none.

    Returns
    -------
    columns : dict of str to array, shape (n,)
    units : dict of str to str
        What stands in brackets behind a name, else empty.
    printed : function
        The cells of a column as they are printed.

    Raises
    ------
    InputError
        One line with file, row or column, rule and value.
    """
    header, separator, body = read_header(path, most)
    head = separator.join(header)
    if all(_number(c) is not None for c in header):
        raise InputError(
            f"{path}: the first line must name the columns, e.g. t,u,y; got numbers: {head.strip()[:60]!r}"
        )
    place: dict[str, int] = {}
    units = dict.fromkeys(names, "")
    for k, cell in enumerate(header):
        base, unit = _name_and_unit(cell)
        for name in names:
            if name in (cell, base):
                if name in place:
                    raise InputError(f"{path}: two columns are named {name!r}; columns: {', '.join(header)}")
                place[name] = k
                units[name] = unit if name == base else ""
    for name in names:
        if name not in place:
            hint = "; name yours (on the command line --time, --input, --output)"
            hint += "; give the sample rate in Hz (--rate) if there is no time column" if name == time else ""
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

    def printed(name: str) -> list[str]:
        return [line.split(separator)[place[name]] for line in body.splitlines() if line.strip()]

    return {n: table[:, i] for i, n in enumerate(names)}, units, printed


def _name_and_unit(cell: str) -> tuple[str, str]:
    """A name and what stands behind it in square or round brackets: ``u [V]``, ``u (V)``."""
    m = re.fullmatch(r"(.*?)\s*(?:\[(.*)\]|\((.*)\))", cell)
    return (m[1], (m[2] or m[3] or "").strip()) if m else (cell, "")


def _first_bad(
    path: str | Path, body: str, separator: str, header: list[str], names: list[str], order: list[int]
) -> str:
    """The sentence about the first row that cannot be read."""
    lines = (line for line in body.splitlines() if line.strip())
    for n, line in enumerate(lines):
        cells = line.split(separator)
        if len(cells) != len(header):
            comma = ""
            if cells[-1].strip() == "":
                comma = f"; it ends with {separator!r}, the line of names does not"
            elif separator == "," and len(cells) > len(header):
                comma = "; is it a decimal comma? numbers need a decimal point"
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


def csv_rows(columns: Iterable[Array]) -> str:
    """Lines of columns of equal length; every number reads back to the same bits."""
    text = io.StringIO()
    for row in zip(*(np.asarray(c, dtype=np.float64).tolist() for c in columns), strict=True):
        text.write(",".join(map(repr, row)) + "\n")
    return text.getvalue()


def csv_text(columns: dict[str, Array]) -> str:
    """Columns of equal length under their names."""
    return ",".join(columns) + "\n" + csv_rows(columns.values())


def write_csv(path: str | Path, columns: dict[str, Array]) -> None:
    """Write `csv_text` of the columns to the file `path`."""
    write_text(path, csv_text(columns))
