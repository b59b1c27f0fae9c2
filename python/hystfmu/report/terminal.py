"""Terminal output: level of a command, tables, paragraphs, a hysteresis loop as text, progress.

The level belongs to the running command: -q prints only problems, -v also prints details and actions. Outside of a
command it is `NORMAL`. A progress bar shows finished share, rate and remaining time, not in a pipe or with -q.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from hystfmu.base.printable import printable

if TYPE_CHECKING:
    from hystfmu.base.arrays import Array


QUIET, NORMAL, VERBOSE = -1, 0, 1
_KEY = "hystfmu.verbosity"
_COLOURS = {"green": "ok|stable|met", "red": "FAILED|BROKEN|unstable|missed|stopped"}  # verdicts in cells of a table
_VERDICT = re.compile("|".join(rf"(?:^|(?<=  ))(?P<{c}>{words})(?=  |$)" for c, words in _COLOURS.items()), re.M)


def level() -> int:
    """Return the level of the running command."""
    context = click.get_current_context(silent=True)
    return NORMAL if context is None else int(context.meta.get(_KEY, NORMAL))


def set_level(context: click.Context, to: int) -> None:
    """Set the level of a command."""
    context.meta[_KEY] = to


def echo(text: str, err: bool = False, nl: bool = True) -> None:
    """Print text on stdout or stderr. All output of a command uses this function, except JSON, which is ASCII.

    In a terminal, verdicts in tables are coloured unless the environment variable NO_COLOR is set.
    """
    text = printable(text, lines=True)
    if not err and not os.environ.get("NO_COLOR"):  # click removes colours from what goes to a file or a pipe
        text = _VERDICT.sub(lambda m: click.style(m[0], fg=m.lastgroup), text)
    click.echo(text, err=err, nl=nl)


def tell(text: str) -> None:
    """Print tables and sentences. In a terminal, sentences are wrapped between words."""
    echo(paragraphs(text))


def say(text: str) -> None:
    """Print a result, or a remark on a result. With -q, print nothing."""
    if level() > QUIET:
        tell(text)


def detail(text: str) -> None:
    """Print the details behind a result, with -v only."""
    if level() >= VERBOSE:
        tell(text)


def wrong(lines: Sequence[str]) -> None:
    """Print failures, with -q only. On other levels, the printed results already contain the failures."""
    if level() <= QUIET:
        for line in lines:
            echo(line)


def verdict(text: str, good: bool) -> None:
    """Print a verdict: in green on stdout, or in red on stderr. In a file or a pipe there is no colour."""
    text = printable(text, lines=True)
    click.echo(text if os.environ.get("NO_COLOR") else click.style(text, fg="green" if good else "red"), err=not good)


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Print the duration of a step on stderr, with -v only."""
    begin = time.monotonic()
    yield
    if level() >= VERBOSE:
        echo(f"{what}: {time.monotonic() - begin:.2f} s", err=True)


_GAP = 2  # spaces between columns
_LEAST = 20  # characters of a terminal that tables are fitted to


def width() -> int | None:
    """Return the number of characters in a line of the terminal; None if stdout is a file or a pipe."""
    if not sys.stdout.isatty():
        return None
    return max(shutil.get_terminal_size().columns, _LEAST)


def table(head: Sequence[str], rows: Sequence[Sequence[Any]], keys: int = 1) -> str:
    """Return a text table with numbers aligned to the right; the first `keys` columns name a row.

    In a terminal, the cells of a table that is too wide are wrapped between words. If this is not sufficient, the table
    is split into several tables with the same first columns.
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


PAUSE = 0.1  # s between two pictures of the bar
BAR = 20  # characters


class Bar:
    """A progress bar: one line on stderr that is overwritten; the clock returns seconds."""

    def __init__(self, label: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._label, self._clock = label, clock
        self._begin, self._drawn = clock(), float("-inf")

    def line(self, fraction: float, rate: str = "") -> str:
        """Return the line for a fraction done. If `rate` is empty, the rate is in percent per second."""
        seconds = self._clock() - self._begin
        done = min(max(fraction, 0.0), 1.0)
        parts = [f"{seconds:.0f} s"]
        if done > 0 and seconds > 0:
            parts += [rate or f"{100 * done / seconds:.2g} %/s", f"{span(seconds * (1 - done) / done)} left"]
        full = int(BAR * done)
        return f"{self._label}  [{'#' * full}{'-' * (BAR - full)}] {100 * done:3.0f} %  {', '.join(parts)}"

    def draw(self, fraction: float, rate: str = "") -> None:
        """Draw the line, at most once per `PAUSE` (s)."""
        if self._clock() - self._drawn < PAUSE:
            return
        self._drawn = self._clock()
        self._write(self.line(fraction, rate))

    def clear(self) -> None:
        """Remove the line."""
        self._write("")
        sys.stderr.write("\r")
        sys.stderr.flush()

    def _write(self, text: str) -> None:
        width = shutil.get_terminal_size().columns - 1
        sys.stderr.write("\r" + printable(text)[:width].ljust(width))
        sys.stderr.flush()


def span(seconds: float) -> str:
    """Return a remaining time as text: seconds, or minutes and seconds, or hours and minutes."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


@contextmanager
def _shown(label: str) -> Iterator[Callable[[float, str], None]]:
    with timed(label):
        if level() <= QUIET or not sys.stderr.isatty():
            yield lambda fraction, rate: None
            return
        bar = Bar(label)
        bar.draw(0.0)
        try:
            yield bar.draw
        finally:
            bar.clear()


@contextmanager
def progress(label: str) -> Iterator[Callable[[float], None]]:
    """Show a bar.  Yields a function of the fraction done, 0 to 1."""
    with _shown(label) as draw:
        yield lambda fraction: draw(fraction, "")


@contextmanager
def counter(label: str, what: str = "runs") -> Iterator[Callable[[int, int, float], None]]:
    """Show a bar with numbers.  Yields a function of (done, total, rate in 1/s)."""
    with _shown(label) as draw:
        yield lambda done, total, rate: draw(done / max(total, 1), f"{done}/{total} {what}, {rate:.3g} {what}/s")
