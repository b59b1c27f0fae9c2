"""Text files of rows and columns as a `Table`."""

from __future__ import annotations

from pathlib import Path

from hystfmu.data.reader.cells import shown
from hystfmu.data.reader.decimals import COMMA, POINT
from hystfmu.data.reader.header import step_in, units_in
from hystfmu.data.reader.layout import layout_of
from hystfmu.data.reader.measures import is_unit, spelling
from hystfmu.data.reader.rows import Rows
from hystfmu.data.reader.table import Column, Table
from hystfmu.data.reader.text import text_of


def delimited(content: bytes, path: str | Path, decimal: str | None, packed: list[str]) -> Table:
    """Read a text file.

    Parameters
    ----------
    content : bytes
        The file, unpacked.
    path : path
        For messages.
    decimal : str, optional
        Decimal sign; None finds it.
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
