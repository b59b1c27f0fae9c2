"""Terminal output: tables, a hysteresis loop as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hystfmu.base.printable import printable

if TYPE_CHECKING:
    from hystfmu.base.arrays import Array


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return a text table with columns as wide as their content and numbers aligned to the right."""
    cells = [[printable(str(c)) for c in row] for row in (head, *rows)]
    widths = [max(len(row[k]) for row in cells) for k in range(len(head))]
    right = [all(_is_number(row[k]) for row in cells[1:]) for k in range(len(head))]
    lines = [
        "  ".join(c.rjust(w) if r else c.ljust(w) for c, w, r in zip(row, widths, right, strict=True)) for row in cells
    ]
    lines.insert(1, "  ".join("-" * w for w in widths))
    return "\n".join(line.rstrip() for line in lines)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def loop(u: Array, y: Array, title: str, width: int = 72, height: int = 20) -> str:
    """Draw a hysteresis loop, y over u, each of shape (n,), as text of `width` by `height` characters."""
    import plotext as plt

    plt.clear_figure()
    plt.theme("clear")
    plt.plot(u.tolist(), y.tolist(), marker="braille")
    plt.title(title)
    plt.plotsize(width, height)
    return str(plt.uncolorize(plt.build()))
