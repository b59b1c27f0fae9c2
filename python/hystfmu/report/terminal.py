"""Terminal output: tables, progress bars (none in a pipe), a hysteresis loop as text."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from hystfmu.base.arrays import Array


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return a text table with columns as wide as their content and numbers aligned to the right."""
    cells = [[str(c) for c in row] for row in (head, *rows)]
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


@contextmanager
def progress(label: str) -> Iterator[Callable[[float], None]]:
    """Show a progress bar on a terminal, nothing in a pipe.  Yields a function of the completed fraction, 0 to 1."""
    if not sys.stderr.isatty():
        yield lambda fraction: None
        return
    with click.progressbar(length=1000, label=label, file=sys.stderr) as bar:
        yield lambda fraction: bar.update(max(0, int(1000 * fraction) - bar.pos))


@contextmanager
def counter(label: str) -> Iterator[Callable[[int, int, float], None]]:
    """Show a progress bar with rate and remaining time.  Yields a function of (done, total, rate in 1/s)."""
    if not sys.stderr.isatty():
        yield lambda done, total, rate: None
        return
    with click.progressbar(length=1, label=label, file=sys.stderr, show_pos=True, item_show_func=str) as bar:

        def report(done: int, total: int, rate: float) -> None:
            bar.length = total
            bar.update(max(0, done - bar.pos), f"{rate:.0f} runs/s")

        yield report


def loop(u: Array, y: Array, title: str, width: int = 72, height: int = 20) -> str:
    """Draw a hysteresis loop, y over u, each of shape (n,), as text of `width` by `height` characters."""
    import plotext as plt

    plt.clear_figure()
    plt.theme("clear")
    plt.plot(u.tolist(), y.tolist(), marker="braille")
    plt.title(title)
    plt.plotsize(width, height)
    return str(plt.uncolorize(plt.build()))
