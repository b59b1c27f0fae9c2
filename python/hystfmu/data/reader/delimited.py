"""Reader of text files with rows and columns: decompression, encoding, line ends, columns and numbers.

An error message names the line and the column of the first cell that is not a number.
"""

import csv
import io
import re
import zlib
from collections.abc import Iterator, Sequence
from decimal import Decimal, InvalidOperation
from functools import partial
from pathlib import Path

import numpy as np

from hystfmu.base import Array, InputError, read_bytes
from hystfmu.data.columns import line_of
from hystfmu.data.reader.clock import stamps
from hystfmu.data.reader.layout import (
    COMMA,
    POINT,
    Layout,
    column_sign,
    decimal_sign,
    is_comment,
    layout_of,
    plain,
    shown,
    split,
)
from hystfmu.data.reader.table import Column, Stamps, Table, is_unit, spelling, step_in, units_in

_NO_ROW = re.compile(r"^[ \t]*(?:$|#|%|//|!)", re.MULTILINE)
_EDGES = re.compile(r"^[ \t]+|[ \t]+$", re.MULTILINE)
_BLANKS = re.compile(r"[ \t]+")
_CELL = "\x1f"  # separator of cells; `text_of` refuses files with this character


class Rows:
    """The rows of numbers in a text file, as the `Source` of a table; `titles` are column names for messages.

    `decimal` is the decimal sign; with None, the reader finds the sign.

    Raises
    ------
    InputError
        A quoted cell does not end in its line, or a comma may be a decimal sign or a thousands separator.
    """

    def __init__(self, text: str, layout: Layout, titles: list[str], path: str | Path, decimal: str | None) -> None:
        self._layout, self._titles, self._path = layout, titles, path
        self._body = text[layout.first.start :].rstrip("\n")
        first = layout.first.number
        self.lines: Sequence[int] = range(first, first + self._body.count("\n") + 1)
        self.skipped = False
        if _NO_ROW.search(self._body):
            numbered = [
                (n, s)
                for n, s in zip(self.lines, self._body.split("\n"), strict=True)
                if s.strip() and not is_comment(s)
            ]
            self.skipped = any(map(is_comment, self._body.split("\n")))
            self.lines, self._body = [n for n, _ in numbered], "\n".join(s for _, s in numbered)
        self.quoted = '"' in self._body
        self.separator = "\t" if layout.separator is None else layout.separator
        if self.quoted:
            self._body, self.separator = self._without_quotes(), _CELL
        elif layout.separator is None:
            self._body = _BLANKS.sub("\t", _EDGES.sub("", self._body))
        self.decimal = decimal or self._sign()

    def _without_quotes(self) -> str:
        rows = []
        for n, line in zip(self.lines, self._body.split("\n"), strict=True):
            try:
                rows.append(_CELL.join(split(line, self._layout.separator)))
            except csv.Error:
                raise InputError(
                    f"{self._path}: line {n}: A quoted cell must end in its line. Got {line[:60]!r} instead."
                ) from None
        return "\n".join(rows)

    def _sign(self) -> str | None:
        """Return the decimal sign of the whole file; None if the sign must be found for each column."""
        if self.separator == COMMA:
            return POINT
        sign = decimal_sign(self._body)
        if sign is None and POINT not in self._body and (found := re.search(r"\d+,\d+", self._body)):
            raise self._unclear(self.lines[self._body.count("\n", 0, found.start())], found[0])
        return sign

    def _unclear(self, line: int, cell: str) -> InputError:
        return InputError(
            f"{self._path}: line {line}: The decimal sign must be clear. Got {cell[:40]!r}, in which the sign may "
            "be decimal or separate thousands: state the decimal sign with --decimal , or --decimal ."
        )

    def words(self, k: int) -> list[str]:
        """Return the cells of column `k` as text."""
        return [line.split(self.separator)[k].strip() for line in self._body.split("\n")]

    def digits(self, k: int) -> Array:
        """Return, for each number in column `k`, the value of one unit of its last printed digit.

        Some programs drop zeros at the end of a number. Therefore a number has at least the digits of any other number
        of the same order of magnitude or of a larger one.
        """
        sign = self.decimal or POINT
        cells = [plain(c, sign).lower() for c in self.words(k)]
        mantissas = (c.partition("e")[::2] for c in cells)
        units = np.array([10.0 ** (int(e or 0) - len(m.partition(".")[2])) for m, e in mantissas])
        with np.errstate(divide="ignore"):
            magnitude = np.floor(np.log10(np.abs(np.array(cells, dtype=np.float64))))
        finest = np.inf
        for m in np.unique(magnitude)[::-1]:
            finest = min(finest, float(units[magnitude == m].min()))
            units[magnitude == m] = finest
        return units

    def since(self, k: int) -> Array:
        """Return column `k` minus its first value, computed from the printed digits."""
        cells = self.words(k)
        sign = self.decimal or column_sign("\n".join(cells)) or POINT
        try:
            exact = [Decimal(plain(c, sign)) for c in cells]
        except InvalidOperation:
            self._raise_first_bad([k])
            raise
        return np.array([float(v - exact[0]) for v in exact])

    def stamps(self, k: int) -> Stamps:
        """Return the times of column `k`, which contains times of day."""
        return stamps(self.words(k), partial(line_of, str(self._path), self.lines))

    def numbers(self, order: Sequence[int]) -> Array:
        """Return the numbers of the columns with the indices `order`, shape (n, len(order)).

        Raises
        ------
        InputError
            A cell is not a number. The message names the file, the line, the column and the cell.
        """
        self._check_widths()
        body = self._body
        if COMMA in body and self.separator != COMMA:
            if self.decimal != COMMA or POINT in body:
                return np.column_stack([self._converted(k) for k in order])
            body = body.replace(COMMA, POINT)
        try:
            return np.loadtxt(io.StringIO(body), delimiter=self.separator, usecols=order, ndmin=2, comments=None)
        except ValueError:
            pass
        self._raise_first_bad(order)
        raise InputError(f"{self._path}: The rows must hold numbers. Got text that cannot be read.")

    def _check_widths(self) -> None:
        width, n = self._layout.width, len(self.lines)
        if self._body.count(self.separator) == n * (width - 1) and self._body.count("\n") == n - 1:
            counts: Iterator[int] = (line.count(self.separator) for line in self._body.split("\n"))
            if all(c == width - 1 for c in counts):
                return
        head = self._layout.named
        for n, line in zip(self.lines, self._body.split("\n"), strict=True):
            cells = line.split(self.separator)
            if len(cells) == width:
                continue
            hint, shown_line = "", line.replace(_CELL, " ")[:60]
            if cells[-1].strip() == "" and len(cells) == width + 1:
                hint = f" It ends with {shown(self._layout.separator)}, other lines do not."
            elif self.separator == COMMA and len(cells) > width:
                hint = " Numbers need a decimal point: is this a decimal comma?"
            where = f", as line {head}" if head else ""
            raise InputError(
                f"{self._path}: line {n}: The line must have {width} cells{where}. "
                f"Got {len(cells)} cells in {shown_line!r}.{hint}"
            )

    def _converted(self, k: int) -> Array:
        """Return the numbers of a column that contains commas and points."""
        cells = self.words(k)
        sign = self.decimal or column_sign("\n".join(cells))
        if sign is None:
            unclear = ((n, c) for n, c in zip(self.lines, cells, strict=True) if COMMA in c or POINT in c)
            raise self._unclear(*next(unclear))
        values = [_number(plain(c, sign)) for c in cells]
        for n, cell, value in zip(self.lines, cells, values, strict=True):
            if value is None:
                raise InputError(self._bad(n, k, cell))
        return np.array(values, dtype=np.float64)

    def _raise_first_bad(self, order: Sequence[int]) -> None:
        for n, line in zip(self.lines, self._body.split("\n"), strict=True):
            cells = line.split(self.separator)
            for k in order:
                cell = cells[k].strip()
                if _number(plain(cell, self.decimal or POINT)) is None:
                    raise InputError(self._bad(n, k, cell))

    def _bad(self, line: int, k: int, cell: str) -> str:
        hint = ""
        if re.match(r"\d{1,4}[-./:]\d{1,2}", cell):
            hint = " A date needs a clock, 10:15:00.125: give the sample rate in Hz (--rate)."
        where = f"{self._path}: line {line}"
        return f"{where}: The {self._titles[k]} column must hold numbers. Got {cell[:40]!r} instead.{hint}"


def _number(text: str) -> float | None:
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None


GZIP = b"\x1f\x8b"
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")
_MARKS = ((b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"))
# characters of cp932 (Shift-JIS) with two bytes: two in a row, and nothing else beyond ASCII, are hardly cp1252
_PAIR, _HIGH = re.compile(rb"[\x81-\x9f][\x40-\x7e\x80-\xfc]"), re.compile(rb"[\x80-\xff]")
_JAPANESE = re.compile(_PAIR.pattern + _PAIR.pattern)
_LOOK = 1000  # number of first bytes that are examined to recognise UTF-16 without a byte order mark


def content_of(path: str | Path, most: int) -> tuple[bytes, list[str]]:
    """Return the content of a file, decompressed if it is a gzip file, and remarks about the compression.

    Raises
    ------
    InputError
        The file cannot be read, is damaged, or has more than `most` bytes before or after decompression.
    """
    content = read_bytes(path, most)
    if not content.startswith(GZIP):
        return content, []
    parts, size = [], 0
    while content.startswith(GZIP):
        unpacker = zlib.decompressobj(wbits=31)
        try:
            parts.append(unpacker.decompress(content, most - size + 1))
        except zlib.error as e:
            raise InputError(f"{path}: The file must be a whole gzip archive. Got {e} instead.") from None
        size += len(parts[-1])
        if size > most:
            raise InputError(f"{path}: The file must have at most {most} bytes when unpacked. Got more.")
        if not unpacker.eof:
            raise InputError(f"{path}: The file must be a whole gzip archive. Got one that breaks off.")
        content = unpacker.unused_data
    return b"".join(parts), ["gzip"]


def text_of(content: bytes, path: str | Path) -> tuple[str, list[str]]:
    """Return the text of a file, with a line feed at the end of each line, and remarks about the encoding.

    The encoding is UTF-8 or UTF-16, with or without a byte order mark. Other text is assumed to be in cp1252 or, if
    it has the bytes of Japanese text, in cp932, encodings of Windows.

    Raises
    ------
    InputError
        The bytes are not text.
    """
    name, start = next(((n, len(m)) for m, n in _MARKS if content.startswith(m)), ("", 0))
    if not name:
        zeros = [content[k:_LOOK:2].count(0) for k in (0, 1)]
        half = max(1, min(len(content), _LOOK) // 2)
        name = "utf-16-le" if zeros[1] > 0.7 * half else "utf-16-be" if zeros[0] > 0.7 * half else "utf-8"
    try:
        text = content[start:].decode(name)
    except UnicodeDecodeError as e:
        if name != "utf-8" or start:
            raise InputError(f"{path}: The file must be text. Got bytes that are not {_shown(name)}.") from None
        name = "cp1252" if not _JAPANESE.search(content) or _HIGH.search(_PAIR.sub(b"", content)) else "cp932"
        try:
            text = content.decode(name)
        except UnicodeDecodeError:
            line = content.count(b"\n", 0, e.start) + 1
            raise InputError(
                f"{path}: line {line}: The file must be text in UTF-8, UTF-16, cp1252 or cp932. "
                f"Got the byte 0x{content[e.start]:02x}: save the file as UTF-8."
            ) from None
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    if found := _CONTROL.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise InputError(f"{path}: line {line}: The file must be text. Got the character 0x{ord(found[0]):02x}.")
    plain = name == "utf-8"
    return text, [] if plain else [_shown(name)]


def _shown(name: str) -> str:
    return {"utf-8": "UTF-8", "utf-16-le": "UTF-16", "utf-16-be": "UTF-16"}.get(name, name)


def delimited(content: bytes, path: str | Path, decimal: str | None, packed: list[str]) -> Table:
    """Return the table of a text file.

    `content` is the content of the file after decompression, and `path` its name for messages. `packed` contains
    remarks about the compression. `decimal` is the decimal sign; with None, the reader finds the sign.

    Raises
    ------
    InputError
        The file is not a table of numbers. The message names the file, the line, the rule and the value.
    """
    text, encoding = text_of(content, path)
    assumed = [*packed, *encoding]
    layout = layout_of(text, path)
    units = [spelling(u) for u in layout.units] or [""] * layout.width
    if not layout.units and all(not label or is_unit(label) for label in layout.labels):
        units = [spelling(label) for label in layout.labels] or units
    labels = layout.labels or [""] * layout.width
    filled = [k for k, kind in enumerate(layout.kinds) if kind in ("number", "clock")]
    for k, unit in zip(filled, units_in((cells for _, cells in layout.header), len(filled)), strict=True):
        units[k] = units[k] or unit
    columns = tuple(map(Column.of, labels, units, layout.kinds))
    titles = [repr(c.name) if c.name else f"number {k}" for k, c in enumerate(columns, 1)]
    rows = Rows(text, layout, titles, path, decimal)
    if (layout.separator, layout.width > 1) != (",", True):
        assumed.append(f"separator {shown(layout.separator)}")
    if rows.decimal == COMMA:
        assumed.append("decimal comma")
    if rows.decimal == POINT and decimal == POINT:
        assumed.append("decimal point")
    if layout.preamble:
        assumed.append(f"{layout.preamble} line{'s' * (layout.preamble > 1)} of preamble")
    if rows.skipped:
        assumed.append("comments between rows left out")
    if layout.units:
        assumed.append("a line of units of measure")
    if layout.trailing:
        assumed.append("a separator at the end of rows")
    if not layout.named:
        assumed.append("no names")
    named_in = f"line {layout.named or layout.first.number}"
    comma = rows.decimal == COMMA or (rows.decimal is None and layout.separator != COMMA)
    step = step_in((line for line, _ in layout.header), comma)
    return Table(str(path), columns, named_in, tuple(assumed), rows, rows.lines, step)
