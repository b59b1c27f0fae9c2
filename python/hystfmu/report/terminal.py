"""Terminal output: tables, paragraphs, a hysteresis loop as text."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from hystfmu.base.printable import printable

if TYPE_CHECKING:
    from hystfmu.base.arrays import Array

_GAP = 2  # spaces between columns
_LEAST = 20  # characters of a terminal that tables are fitted to


def width() -> int | None:
    """Return the number of characters in a line of the terminal; None if stdout is a file or a pipe."""
    if not sys.stdout.isatty():
        return None
    return max(shutil.get_terminal_size().columns, _LEAST)


def table(head: Sequence[str], rows: Sequence[Sequence[Any]], keys: int = 1) -> str:
    """Return a text table with numbers aligned to the right.

    In a terminal, the cells of a table that is too wide are wrapped between words. If this is not sufficient, the table
    is split into several tables with the same first columns.

    Parameters
    ----------
    head : sequence of str
    rows : sequence of sequence
        Cells; shape (rows, columns).
    keys : int
        Number of the first columns, which name a row.
    """
    columns = [_Column([printable(str(row[k])) for row in (head, *rows)]) for k in range(len(head))]
    most = width()
    if most is None or _total(c.width for c in columns) <= most:
        return _lines(columns)
    return "\n\n".join(_lines(_fitted(part, most)) for part in _parts(columns, keys, most))


class _Column:
    """Cells and width of a column. The first cell is the head."""

    def __init__(self, cells: list[str]) -> None:
        self.cells = cells
        self.width = max(map(len, cells))
        self.least = max((len(word) for cell in cells for word in cell.split()), default=0)
        self.right = all(_is_number(cell) for cell in cells[1:])

    def wrapped(self, k: int) -> list[str]:
        """Return the lines of a cell."""
        cell = self.cells[k]
        lines = [cell] if len(cell) <= self.width else textwrap.wrap(cell, self.width, break_on_hyphens=False)
        return [line.rjust(self.width) if self.right else line.ljust(self.width) for line in lines]


def _total(widths: Iterable[int]) -> int:
    found = list(widths)
    return sum(found) + _GAP * (len(found) - 1)


def _parts(columns: list[_Column], keys: int, most: int) -> list[list[_Column]]:
    """Split columns into groups that fit the width. Each group starts with the columns that name a row."""
    first = columns[:keys]
    for c in columns:  # a word longer than the terminal, such as a path, breaks
        c.least = min(c.least, (most - _GAP * keys) // (keys + 1))
    parts: list[list[_Column]] = []
    for c in columns[keys:]:
        if parts and _total(x.least for x in [*parts[-1], c]) <= most:
            parts[-1].append(c)
        else:
            parts.append([*first, c])
    return parts or [first]


def _fitted(columns: list[_Column], most: int) -> list[_Column]:
    """Narrow the widest columns until all columns fit."""
    fitted = [_Column(c.cells) for c in columns]
    for new, old in zip(fitted, columns, strict=True):
        new.least, new.right = old.least, old.right
    while _total(c.width for c in fitted) > most and (able := [c for c in fitted if c.width > c.least]):
        max(able, key=lambda c: c.width).width -= 1
    return fitted


def _lines(columns: list[_Column]) -> str:
    gap = " " * _GAP
    lines = []
    for k in range(len(columns[0].cells)):
        cells = [c.wrapped(k) for c in columns]
        for j in range(max(map(len, cells))):
            lines.append(
                gap.join(x[j] if j < len(x) else " " * c.width for c, x in zip(columns, cells, strict=True)).rstrip()
            )
        if k == 0:
            lines.append(gap.join("-" * c.width for c in columns))
    return "\n".join(lines)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def paragraphs(text: str) -> str:
    """Wrap sentences between words to the width of the terminal.

    Lines with aligned columns, and lines with a command that may be copied, are not changed.
    """
    most = width()
    if most is None:
        return text
    return "\n".join(_sentence(line, most) for line in text.split("\n"))


def _sentence(line: str, most: int) -> str:
    if len(line) <= most or "  " in line.strip() or "hystfmu " in line:
        return line
    indent = line[: len(line) - len(line.lstrip())]
    return textwrap.fill(line, most, subsequent_indent=indent + "  ", break_long_words=False, break_on_hyphens=False)


def loop(u: Array, y: Array, title: str, width: int = 72, height: int = 20) -> str:
    """Draw y over u, each of shape (n,), as text of `width` by `height` characters."""
    import plotext as plt

    plt.clear_figure()
    plt.theme("clear")
    plt.plot(u.tolist(), y.tolist(), marker="braille")
    plt.title(title)
    plt.plotsize(width, height)
    return str(plt.uncolorize(plt.build()))
