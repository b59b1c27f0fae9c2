"""Text files of rows and columns as a `Table`: limited decompression, encodings, line ends, columns."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.base.files import read_bytes
from hystfmu.data.reader.cells import COMMA, POINT, shown
from hystfmu.data.reader.headings import is_unit, spelling, step_in, units_in
from hystfmu.data.reader.layout import layout_of
from hystfmu.data.reader.rows import Rows
from hystfmu.data.reader.table import Column, Table

GZIP = b"\x1f\x8b"
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")
_MARKS = ((b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"))
_LOOK = 1000  # bytes that tell UTF-16 without a mark


def content_of(path: str | Path, most: int) -> tuple[bytes, list[str]]:
    """Read a file, unpack gzip, and return the bytes and a remark.

    Raises
    ------
    InputError
        The file cannot be read, is damaged, or has more than `most` bytes, also after unpacking.
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
    """Decode a text file; in the result, lines end with a line feed.

    Text is UTF-8 or UTF-16, with or without a byte order mark. Other text is assumed to be cp1252, the encoding of
    Windows.

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
        try:
            text, name = content.decode("cp1252"), "cp1252"
        except UnicodeDecodeError:
            line = content.count(b"\n", 0, e.start) + 1
            raise InputError(
                f"{path}: line {line}: The file must be text. Got the byte 0x{content[e.start]:02x}."
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
    """Read a text file.

    Parameters
    ----------
    content : bytes
        The file, unpacked.
    path : path
        For messages.
    decimal : str, optional
        Decimal sign; with None the reader finds the sign.
    packed : list of str
        Compression of the file, for the line with the assumptions.

    Raises
    ------
    InputError
        One line with file, line, rule and value.
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
