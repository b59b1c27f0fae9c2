"""CSV files that HystFMU writes: numbers without rounding, names of columns in the first line."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes, write_text
from hystfmu.base.printable import printable


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


def csv_rows(columns: Iterable[Array]) -> str:
    """Format columns of equal length as lines; every number reads back to the same bits."""
    text = io.StringIO()
    for row in zip(*(np.asarray(c, dtype=np.float64).tolist() for c in columns), strict=True):
        text.write(",".join(map(repr, row)) + "\n")
    return text.getvalue()


def csv_head(names: Iterable[str]) -> str:
    """Format the first line; a name of a foreign FMU may contain commas, quotes or line ends."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(map(printable, names))
    return text.getvalue()


def csv_text(columns: dict[str, Array]) -> str:
    """Format columns of equal length as CSV text with a first line of names."""
    return csv_head(columns) + csv_rows(columns.values())


def write_csv(path: str | Path, columns: dict[str, Array]) -> None:
    """Write columns to the CSV file `path`, atomically."""
    write_text(path, csv_text(columns))
