"""Layout of a text file: decimal sign, separator, headings, units of measure, and first row of numbers.

The layout is found from the first lines. A row of numbers contains at least one number. The headings are the line of
text above the first row of numbers. Lines above the headings are the preamble. No other line is ignored: if another
line is not a row of numbers, an error states its line number.
"""

import csv
import re
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from hystfmu.base import InputError
from hystfmu.data.reader.clock import is_stamp
from hystfmu.data.reader.table import Kind, is_unit

SEPARATORS: tuple[str | None, ...] = ("\t", ";", ",", None)  # None means one or more blanks
COMMENTS = ("#", "%", "//", "!")
_DIGITS = r"\d+(?:[.,]\d*)?|[.,]\d+"
_THOUSANDS = r"\d{1,3}(?:\.\d{3})+,\d*|\d{1,3}(?:,\d{3})+(?:\.\d*)?|\d{1,3}(?:\.\d{3}){2,}"
_NUMBER = re.compile(rf"[+-]?(?:(?:{_THOUSANDS}|{_DIGITS})(?:[eE][+-]?\d+)?|nan|inf(?:inity)?)", re.IGNORECASE)
_BLANKS = re.compile(r'"[^"]*"|\S+')


def split(line: str, separator: str | None) -> list[str]:
    """Return the cells of a line, without quotes and without blanks at their ends.

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
    """Return whether a cell contains a number, with a decimal point or a decimal comma."""
    return _NUMBER.fullmatch(cell) is not None


def is_comment(line: str) -> bool:
    """Return whether a line is a comment."""
    return line.lstrip().startswith(COMMENTS)


def shown(separator: str | None) -> str:
    """Return the name of a separator for a message."""
    return {"\t": "tabs", None: "blanks"}.get(separator, f"{separator!r}")


POINT, COMMA = ".", ","


def _evidence(sign: str) -> re.Pattern[str]:
    """Return a pattern for numbers in which `sign` must be the decimal sign, not a thousands separator.

    Such a number has at least one of three properties: the number of digits after the sign is not three; an exponent
    follows these digits; or the sign follows no digit, a zero, or at least four digits.
    """
    s = re.escape(sign)
    before = rf"(?<![\d.,'])(?:0\d*|\d{{4,}}|(?<![\w]))?{s}\d"
    behind = rf"(?<![\d.,'])\d+{s}(?:\d{{1,2}}|\d{{4,}})(?![\d.,'])"
    power = rf"(?<![\d.,'])\d+{s}\d+[eE][+-]?\d"
    return re.compile(f"{before}|{behind}|{power}")


_DECIMAL = {sign: _evidence(sign) for sign in (POINT, COMMA)}
_PARTED = {  # patterns of numbers with thousands separators: the separator occurs twice, or before the other sign
    sign: re.compile(
        rf"(?<![\d.,])\d{{1,3}}{re.escape(sign)}\d{{3}}(?:{re.escape(sign)}\d{{3}}(?!\d)|{re.escape(other)}\d)"
    )
    for sign, other in ((POINT, COMMA), (COMMA, POINT))
}
_SIGNED = {sign: re.compile(rf"\d{re.escape(sign)}\d") for sign in (POINT, COMMA)}


def decimal_sign(text: str) -> str | None:
    """Return the decimal sign of the numbers in a text.

    The result is None if a comma may be a decimal sign or a thousands separator, or if both comma and point are decimal
    signs.
    """
    if COMMA not in text or not (_SIGNED[COMMA].search(text) or _DECIMAL[COMMA].search(text)):
        return POINT
    if POINT not in text and _DECIMAL[COMMA].search(text):
        return COMMA  # then a cell such as 1,234,567 is not a number
    comma = bool(_DECIMAL[COMMA].search(text)) or bool(_PARTED[POINT].search(text))
    point = bool(_DECIMAL[POINT].search(text)) or bool(_PARTED[COMMA].search(text))
    return None if comma == point else COMMA if comma else POINT


def column_sign(text: str) -> str | None:
    """Return the decimal sign of one column in a file with points and commas; None if the sign is ambiguous."""
    sign = decimal_sign(text)
    if sign == POINT and POINT in text and not (_DECIMAL[POINT].search(text) or _PARTED[COMMA].search(text)):
        return None
    return sign


def plain(cell: str, sign: str) -> str:
    """Return the text of a number with a decimal point and without thousands separators."""
    other = COMMA if sign == POINT else POINT
    whole, mark, rest = cell.partition(sign)
    if other in whole and re.fullmatch(rf"[+-]?\d{{1,3}}(?:{re.escape(other)}\d{{3}})+", whole):
        whole = whole.replace(other, "")
    return f"{whole}.{rest}" if mark else whole


LOOK = 400  # number of first lines that are examined, without comments and empty lines
LAST = 7  # number of last rows among these lines from which separator, width and kinds of columns are found
LEAST_SHARE = 0.3  # minimum fraction of cells of a row with numbers; other cells contain text, e.g. a date


@dataclass(frozen=True)
class Line:
    """A line of the file with its number, counted from 1, and the position of its first character in the text."""

    number: int
    start: int
    text: str


@dataclass(frozen=True)
class Layout:
    """Layout of a file.

    A row has `width` cells, including an empty cell after a trailing separator. If `separator` is None, blanks separate
    the cells. `labels` and `units` are headings and units of measure, or empty lists. `named` is the line number of the
    headings, or 0 if there are no headings. `preamble` is the number of lines above the headings that are neither empty
    nor comments. `kinds` contains the kind of content of each column. `header` contains texts that may state a time
    step or units of measure, with their cells: the lines above the headings, the comments, and the cells to the left of
    the numbers in the first rows.
    """

    separator: str | None
    width: int
    first: Line
    labels: list[str]
    units: list[str]
    named: int
    preamble: int
    trailing: bool
    kinds: tuple[Kind, ...]
    header: list[tuple[str, list[str]]]


def layout_of(text: str, path: str | Path) -> Layout:
    """Return the layout of a text file.

    Raises
    ------
    InputError
        The file has no rows of numbers, the first row may be a row of headings, or the headings do not fit the rows.
    """
    lines, comments = _first_lines(text)
    if not lines:
        raise InputError(f"{path}: The file must have data rows. Got none.")
    separator, width = _separator(lines)
    rows = [_cells(line.text, separator) for line in lines]
    kinds = _kinds([r for r in rows if len(r) == width and any(map(is_number, r))][-LAST:], width)
    lead = next((k for k, kind in enumerate(kinds) if kind != "empty"), 0)
    k = _first_row(rows, width, lead)
    if k == len(rows):
        if open_quote := next((line for line in lines if line.text.count('"') % 2), None):
            raise InputError(
                f"{path}: line {open_quote.number}: A quoted cell must end in its line. "
                f"Got {open_quote.text[:60]!r} instead."
            )
        raise InputError(f"{path}: The file must have data rows. Got none in {len(rows)} lines that are no comments.")
    for line, cells in zip(lines[:k], rows[:k], strict=True):
        if len(cells) == width and _is_row(cells):
            below = zip(lines[:k], rows[:k], strict=True)
            wrong = (n for n, r in below if n.number > line.number and not any(map(is_number, r)))
            bad = next(wrong, lines[k - 1])
            raise InputError(f"{path}: line {bad.number}: The line must hold numbers. Got {bad.text[:60]!r} instead.")
    trailing = width > 1 and kinds[-1] == "empty"
    before = [c for c in comments if c.number < lines[k].number]
    labels, units, named = _headings(lines[:k], before, separator, width, trailing)
    if not labels and k and separator is not None and len(rows[k - 1]) > 1:
        _refuse_width(path, lines[k - 1], lines[k], len(rows[k - 1]), width, separator)
    preamble = sum(line.number < named or not named for line in lines[:k])
    header = [(n.text, r) for n, r in zip(lines[:k], rows[:k], strict=True) if n.number < named or not named]
    header += [(c.text, re.split(r"\s*[:=;,\t]\s*", c.text.lstrip("#%/! "))) for c in before]
    header += [(" ".join(r[:lead]), r[:lead]) for r in rows[k:] if lead and r[0]]
    return Layout(separator, width, lines[k], labels, units, named, preamble, trailing, kinds, header)


def _kinds(rows: list[list[str]], width: int) -> tuple[Kind, ...]:
    """Return the kind of content of each column, found from the last rows."""

    def kind(cells: list[str]) -> Kind:
        if not any(cells):
            return "empty"
        return "number" if any(map(is_number, cells)) else "clock" if any(map(is_stamp, cells)) else "text"

    return tuple(kind([r[k] for r in rows]) for k in range(width))


def _refuse_width(path: str | Path, head: Line, row: Line, names: int, width: int, separator: str) -> None:
    hint = ""
    if separator == "," and width > names:
        hint = " Numbers need a decimal point: is this a decimal comma?"
    raise InputError(
        f"{path}: line {row.number}: The line must have {names} cells, as line {head.number}. "
        f"Got {width} cells in {row.text[:60]!r}.{hint}"
    )


def _first_lines(text: str) -> tuple[list[Line], list[Line]]:
    """Return the first lines that are neither empty nor comments, and the comments between them."""
    lines: list[Line] = []
    comments: list[Line] = []
    at, number = 0, 0
    while at < len(text) and len(lines) < LOOK:
        end = text.find("\n", at)
        end = len(text) if end < 0 else end
        number += 1
        line = Line(number, at, text[at:end])
        if line.text.strip():
            (comments if is_comment(line.text) else lines).append(line)
        at = end + 1
    return lines, comments[-LOOK:]


def _cells(line: str, separator: str | None) -> list[str]:
    with suppress(csv.Error):
        return split(line, separator)
    return [line]


def _is_row(cells: list[str]) -> bool:
    """Return whether cells may be a row of data.

    The first cell of such a row is a number, and more than half of its nonempty cells are numbers.
    """
    filled = [c for c in cells if c]
    return is_number(cells[0]) and 2 * sum(map(is_number, filled)) > len(filled)


def _separator(lines: list[Line]) -> tuple[str | None, int]:
    """Return the separator that gives the largest fraction of numbers in the last rows, and the cells per row."""
    best: tuple[bool, float] = (False, -1.0)
    found: tuple[str | None, int] = (",", 1)
    for separator in SEPARATORS:
        rows = [_cells(line.text, separator) for line in lines]
        numeric = [r for r in rows if any(map(is_number, r))][-LAST:]
        if not numeric:
            continue
        counts = Counter(map(len, numeric))
        width = max(counts, key=lambda n: (counts[n], n))
        cells = [c for r in numeric if len(r) == width for c in r if c]
        share = sum(map(is_number, cells)) / len(cells) * counts[width] / len(numeric)
        rating = (width > 1 and share >= LEAST_SHARE, round(share, 6))
        if rating > best:
            best, found = rating, (separator, width)
    return found


def _first_row(rows: list[list[str]], width: int, lead: int) -> int:
    """Return the index of the first row of numbers, or the number of rows if there is no such row.

    The search goes backwards from the last row with numbers. The first `lead` cells of a row contain no numbers.
    """
    k = max((i + 1 for i, r in enumerate(rows) if any(map(is_number, r))), default=0)
    if not k:
        return len(rows)
    while k and any(map(is_number, rows[k - 1])):
        if len(rows[k - 1]) != width and not is_number(rows[k - 1][0]):  # "Samples, 1000": preamble
            break
        k -= 1
    if k == len(rows):
        return k
    top, below = rows[k][lead:], (rows[k + 1] if k + 1 < len(rows) else [])[lead:]
    mixed = len(top) == len(below) and any(
        a and not is_number(a) and is_number(b) for a, b in zip(top, below, strict=True)
    )
    if mixed and not is_number(top[0]) and not (k and len(rows[k - 1]) == width):
        k += 1  # this row contains headings, some of which are numbers: Time, 1, 2
    return k


def _headings(
    lines: list[Line], comments: list[Line], separator: str | None, width: int, trailing: bool
) -> tuple[list[str], list[str], int]:
    """Return the headings, the units of measure, and the line number of the headings.

    They are found in the lines above the rows or in the comments.
    """

    def fitted(line: Line) -> list[str] | None:
        text = line.text.lstrip().lstrip("#%/!").strip() if line in comments else line.text
        return _fitted(text, separator, width, trailing)

    heads = [line for line in lines[-2:] if fitted(line) is not None]
    if not heads or heads[-1] is not lines[-1]:
        heads = [line for line in comments if fitted(line) is not None][-2:]
    if not heads:
        return [], [], 0
    *above, last = heads
    cells = fitted(last) or []
    if above and all(not c or c == "-" or is_unit(c) for c in cells):
        return fitted(above[-1]) or [], [c.strip("[]() -") for c in cells], above[-1].number
    return cells, [], last.number


def _fitted(text: str, separator: str | None, width: int, trailing: bool) -> list[str] | None:
    """Return the cells of a line of headings if their number fits the rows, otherwise None."""
    cells = _cells(text, separator)
    if separator is None and len(cells) != width:  # headings with blanks: split them at two blanks or after brackets
        for pattern in (r"\s{2,}|\t", r"\s+(?![\[(])", r"\s*[,;]\s*"):
            cells = [c for c in re.split(pattern, text.strip()) if c]
            if len(cells) == width:
                break
    cells = [c.strip() for c in cells]
    if len(cells) == width + 1 and (not cells[-1] or cells[-1].lower() == "comment"):
        cells.pop()  # LabVIEW adds a heading for comments, for which the rows have no cell
    if len(cells) == width - 1 and trailing:
        cells.append("")
    return cells if len(cells) == width and any(c and not is_number(c) for c in cells) else None
