"""Cells of a line: separators, quotes, and which cells are numbers, with a decimal point or a decimal comma."""

from __future__ import annotations

import csv
import re

SEPARATORS: tuple[str | None, ...] = ("\t", ";", ",", None)  # None: blanks
COMMENTS = ("#", "%", "//", "!")
_DIGITS = r"\d+(?:[.,]\d*)?|[.,]\d+"
_PARTED = r"\d{1,3}(?:\.\d{3})+,\d*|\d{1,3}(?:,\d{3})+(?:\.\d*)?|\d{1,3}(?:\.\d{3}){2,}"
_NUMBER = re.compile(rf"[+-]?(?:(?:{_PARTED}|{_DIGITS})(?:[eE][+-]?\d+)?|nan|inf(?:inity)?)", re.IGNORECASE)
_BLANKS = re.compile(r'"[^"]*"|\S+')


def split(line: str, separator: str | None) -> list[str]:
    """Return the cells of a line, without quotes and outer blanks.

    Raises
    ------
    csv.Error
        A quoted cell that does not end in its line.
    """
    if separator is None:
        return [c.strip('"').strip() for c in _BLANKS.findall(line)]
    if '"' not in line:
        return [c.strip() for c in line.split(separator)]
    return [c.strip() for c in next(csv.reader([line], delimiter=separator, strict=True, skipinitialspace=True))]


def is_number(cell: str) -> bool:
    """Return whether a cell is written as a number, in whatever notation."""
    return _NUMBER.fullmatch(cell) is not None


def is_comment(line: str) -> bool:
    """Return whether a line is a comment."""
    return line.lstrip().startswith(COMMENTS)


def shown(separator: str | None) -> str:
    """Name a separator for a message."""
    return {"\t": "tabs", None: "blanks"}.get(separator, f"{separator!r}")
