"""Workbooks read by openpyxl: the first sheet with rows of numbers, as text lines with tabs."""

from __future__ import annotations

import datetime
import io
from functools import partial
from typing import Any

import numpy as np

from hystfmu.base.told_arrays import Found, serve

LEAST_ROWS = 4  # with two numbers or times


def arrays(source: str) -> tuple[list[Found], list[str]]:
    """Return the text as an array of bytes, and the name of the sheet.

    Raises
    ------
    ValueError
        No sheet has rows of numbers.
    """
    from openpyxl import load_workbook

    with open(source, "rb") as file:  # the name tells no format
        book = load_workbook(io.BytesIO(file.read()), read_only=True, data_only=True)
    sheets = book.worksheets
    for sheet in sheets:
        rows, numeric = [], 0
        for row in sheet.iter_rows(values_only=True):
            rows.append("\t".join(map(_text, row)))
            numeric += sum(isinstance(v, (int, float, datetime.datetime, datetime.time)) for v in row) > 1
        if numeric >= LEAST_ROWS:
            content = np.frombuffer("\n".join(rows).encode(), dtype=np.uint8)
            of = f" of {len(sheets)}" if len(sheets) > 1 else ""
            text = Found("", content.shape, content.nbytes, partial(np.array, content))
            return [text], [f"sheet {sheet.title!r}{of}"]
    raise ValueError("no sheet with rows of numbers")


def _text(value: Any) -> str:
    """Write a cell; openpyxl rounds clocks to milliseconds."""
    if value is None:
        return ""
    if isinstance(value, datetime.datetime):
        return value.isoformat(" ", "milliseconds")
    if isinstance(value, datetime.time):
        return value.isoformat("milliseconds")
    if isinstance(value, datetime.timedelta):
        return repr(value.total_seconds())
    if isinstance(value, float):
        return repr(value)
    return " ".join(str(value).split())


if __name__ == "__main__":
    serve(arrays)
