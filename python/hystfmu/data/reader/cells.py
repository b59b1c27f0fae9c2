"""Cells of a line: separators, quotes, recognition of numbers, and their decimal sign (point, comma or ambiguous)."""

from __future__ import annotations

import csv
import re

SEPARATORS: tuple[str | None, ...] = ("\t", ";", ",", None)  # None: blanks
COMMENTS = ("#", "%", "//", "!")
_DIGITS = r"\d+(?:[.,]\d*)?|[.,]\d+"
_THOUSANDS = r"\d{1,3}(?:\.\d{3})+,\d*|\d{1,3}(?:,\d{3})+(?:\.\d*)?|\d{1,3}(?:\.\d{3}){2,}"
_NUMBER = re.compile(rf"[+-]?(?:(?:{_THOUSANDS}|{_DIGITS})(?:[eE][+-]?\d+)?|nan|inf(?:inity)?)", re.IGNORECASE)
_BLANKS = re.compile(r'"[^"]*"|\S+')


def split(line: str, separator: str | None) -> list[str]:
    """Return the cells of a line, without quotes and outer blanks.

    Raises
    ------
    csv.Error
        A quoted cell does not end in its line.
    """
    if separator is None:
        return [c.strip('"').strip() for c in _BLANKS.findall(line)]
    if '"' not in line:
        return [c.strip() for c in line.split(separator)]
    return [c.strip() for c in next(csv.reader([line], delimiter=separator, strict=True, skipinitialspace=True))]


def is_number(cell: str) -> bool:
    """Return whether a cell is written as a number, in any notation."""
    return _NUMBER.fullmatch(cell) is not None


def is_comment(line: str) -> bool:
    """Return whether a line is a comment."""
    return line.lstrip().startswith(COMMENTS)


def shown(separator: str | None) -> str:
    """Name a separator for a message."""
    return {"\t": "tabs", None: "blanks"}.get(separator, f"{separator!r}")


POINT, COMMA = ".", ","


def _evidence(sign: str) -> re.Pattern[str]:
    """Pattern of a number whose `sign` cannot be a thousands separator.

    The number has not three digits after the sign, or it has no digit, a zero or four digits before the sign.
    """
    s = re.escape(sign)
    before = rf"(?<![\d.,'])(?:0\d*|\d{{4,}}|(?<![\w]))?{s}\d"
    behind = rf"(?<![\d.,'])\d+{s}(?:\d{{1,2}}|\d{{4,}})(?![\d.,'])"
    power = rf"(?<![\d.,'])\d+{s}\d+[eE][+-]?\d"
    return re.compile(f"{before}|{behind}|{power}")


_DECIMAL = {sign: _evidence(sign) for sign in (POINT, COMMA)}
_PARTED = {  # thousands are parted: twice, or before the other sign
    sign: re.compile(
        rf"(?<![\d.,])\d{{1,3}}{re.escape(sign)}\d{{3}}(?:{re.escape(sign)}\d{{3}}(?!\d)|{re.escape(other)}\d)"
    )
    for sign, other in ((POINT, COMMA), (COMMA, POINT))
}
_SIGNED = {sign: re.compile(rf"\d{re.escape(sign)}\d") for sign in (POINT, COMMA)}


def decimal_sign(text: str) -> str | None:
    """Find the decimal sign of the numbers in a text.

    Returns
    -------
    str or None
        The sign. None if a comma may be a thousands separator or the decimal sign, or if point and comma are decimal
        signs.
    """
    if COMMA not in text or not (_SIGNED[COMMA].search(text) or _DECIMAL[COMMA].search(text)):
        return POINT
    if POINT not in text and _DECIMAL[COMMA].search(text):
        return COMMA  # a cell such as 1,234,567 beside it is no number
    comma = bool(_DECIMAL[COMMA].search(text)) or bool(_PARTED[POINT].search(text))
    point = bool(_DECIMAL[POINT].search(text)) or bool(_PARTED[COMMA].search(text))
    return None if comma == point else COMMA if comma else POINT


def column_sign(text: str) -> str | None:
    """Find the decimal sign of a column if other columns use point and comma; None if it is not clear."""
    sign = decimal_sign(text)
    if sign == POINT and POINT in text and not (_DECIMAL[POINT].search(text) or _PARTED[COMMA].search(text)):
        return None
    return sign


def plain(cell: str, sign: str) -> str:
    """Return a number with a decimal point and without thousands separators."""
    other = COMMA if sign == POINT else POINT
    whole, mark, rest = cell.partition(sign)
    if other in whole and re.fullmatch(rf"[+-]?\d{{1,3}}(?:{re.escape(other)}\d{{3}})+", whole):
        whole = whole.replace(other, "")
    return f"{whole}.{rest}" if mark else whole
