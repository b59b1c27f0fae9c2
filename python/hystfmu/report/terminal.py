"""Terminal output of commands: texts, tables, hysteresis loops drawn as text, and progress bars.

The output level belongs to the running command. With the option -q, a command prints only problems; with -v, it also
prints details and actions. Outside of a command, the level is `NORMAL`. A progress bar shows the completed fraction and
the remaining time. There is no bar with -q or if the output goes to a pipe.
"""

import json
import os
import re
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NoReturn

import click

from hystfmu.base.printable import printable

if TYPE_CHECKING:
    from hystfmu.base import Array


QUIET, NORMAL, VERBOSE = -1, 0, 1
FAILED = 1  # exit status of a command whose result does not meet the requirements
_KEY, _JSON = "hystfmu.verbosity", "hystfmu.json"
_COLOURS = {"green": "ok|stable|met", "red": "FAILED|BROKEN|unstable|missed|stopped"}  # verdicts in tables
_VERDICT = re.compile("|".join(rf"(?:^|(?<=  ))(?P<{c}>{words})(?=  |$)" for c, words in _COLOURS.items()), re.M)


def level() -> int:
    """Return the output level of the running command."""
    context = click.get_current_context(silent=True)
    return NORMAL if context is None else int(context.meta.get(_KEY, NORMAL))


def set_level(context: click.Context, to: int) -> None:
    """Set the output level of a command."""
    context.meta[_KEY] = to


def answers_json() -> bool:
    """Return whether the running command prints JSON instead of text on stdout."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(_JSON, False))


def set_json(context: click.Context, to: bool) -> None:
    """Set whether a command prints JSON instead of text on stdout."""
    context.meta[_JSON] = to


def answer(facts: Any, passed: bool = True) -> NoReturn:
    """End the running command with status 0, or with `FAILED` if `passed` is False.

    If the command answers in JSON, print `facts` as JSON; a text is JSON already.
    """
    if answers_json():
        click.echo(facts if isinstance(facts, str) else json.dumps(facts))
    sys.exit(0 if passed else FAILED)


def echo(text: str, err: bool = False, nl: bool = True) -> None:
    """Print a text on stdout or stderr. All output of a command uses this function, except JSON, which is ASCII.

    A command that answers in JSON prints no text on stdout.

    In a terminal, verdicts in tables have a colour, unless the environment variable NO_COLOR is set.
    """
    if not err and answers_json():
        return
    text = printable(text, lines=True)
    if not err and not os.environ.get("NO_COLOR"):  # click removes the colours if the output goes to a file or a pipe
        text = _VERDICT.sub(lambda m: click.style(m[0], fg=m.lastgroup), text)
    click.echo(text, err=err, nl=nl)


def tell(text: str) -> None:
    """Print tables and sentences. In a terminal, sentences are wrapped between words."""
    echo(paragraphs(text))


def say(text: str) -> None:
    """Print a result or a remark on a result; with the option -q, print nothing."""
    if level() > QUIET:
        tell(text)


def detail(text: str) -> None:
    """Print details of a result if the option -v is given."""
    if level() >= VERBOSE:
        tell(text)


def wrong(lines: Sequence[str]) -> None:
    """Print failures if the option -q is given. Without -q, the printed results already contain the failures."""
    if level() <= QUIET:
        for line in lines:
            echo(line)


def verdict(text: str, good: bool) -> None:
    """Print a verdict, in green on stdout if it is good, otherwise in red on stderr.

    There is no colour in a file or a pipe.
    """
    text = printable(text, lines=True)
    click.echo(text if os.environ.get("NO_COLOR") else click.style(text, fg="green" if good else "red"), err=not good)


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Measure the duration of the `with` block, and print it after the text `what` on stderr if -v is given."""
    begin = time.monotonic()
    yield
    if level() >= VERBOSE:
        echo(f"{what}: {time.monotonic() - begin:.2f} s", err=True)


_GAP = 2  # number of spaces between columns
_LEAST = 20  # minimum number of characters to which the width of tables is reduced


def width() -> int | None:
    """Return the number of characters in a line of the terminal; None if stdout is not a terminal."""
    if not sys.stdout.isatty():
        return None
    return max(shutil.get_terminal_size().columns, _LEAST)


def table(head: Sequence[str], rows: Sequence[Sequence[Any]], keys: int = 1) -> str:
    """Return a table as text, with numbers aligned to the right. The first `keys` columns contain the row names.

    If the table is too wide for the terminal, the text in its cells is wrapped between words. If this is not
    sufficient, the table is divided into several tables with the same first columns.
    """
    columns = [_Column([printable(str(row[k])) for row in (head, *rows)]) for k in range(len(head))]
    most = width()
    if most is None or _total(c.width for c in columns) <= most:
        return _lines(columns)
    return "\n\n".join(_lines(_fitted(part, most)) for part in _parts(columns, keys, most))


class _Column:
    """A column of a table, with its cells and its width. The first cell is the heading."""

    def __init__(self, cells: list[str]) -> None:
        self.cells = cells
        self.width = max(map(len, cells))
        self.least = max((len(word) for cell in cells for word in cell.split()), default=0)
        self.right = all(_is_number(cell) for cell in cells[1:])

    def wrapped(self, k: int) -> list[str]:
        """Return the lines of cell `k`, wrapped to the width of the column."""
        cell = self.cells[k]
        lines = [cell] if len(cell) <= self.width else textwrap.wrap(cell, self.width, break_on_hyphens=False)
        return [line.rjust(self.width) if self.right else line.ljust(self.width) for line in lines]


def _total(widths: Iterable[int]) -> int:
    found = list(widths)
    return sum(found) + _GAP * (len(found) - 1)


def _parts(columns: list[_Column], keys: int, most: int) -> list[list[_Column]]:
    """Return groups of columns that fit into `most` characters. Each group begins with the first `keys` columns."""
    first = columns[:keys]
    for c in columns:  # a word longer than the terminal, such as a path, is divided
        c.least = min(c.least, (most - _GAP * keys) // (keys + 1))
    parts: list[list[_Column]] = []
    for c in columns[keys:]:
        if parts and _total(x.least for x in [*parts[-1], c]) <= most:
            parts[-1].append(c)
        else:
            parts.append([*first, c])
    return parts or [first]


def _fitted(columns: list[_Column], most: int) -> list[_Column]:
    """Reduce the width of the widest columns until all columns fit into `most` characters; return the columns."""
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
    """Return a text in which sentences are wrapped between words to the width of the terminal.

    Lines with aligned columns, and lines with a command that the user may copy, stay unchanged.
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


def loop(u: "Array", y: "Array", title: str, width: int = 72, height: int = 20) -> str:
    """Return a plot of y over u, each of shape (n,), as text with `height` lines of `width` characters."""
    import plotext as plt

    plt.clear_figure()
    plt.theme("clear")
    plt.plot(u.tolist(), y.tolist(), marker="braille")
    plt.title(title)
    plt.plotsize(width, height)
    return str(plt.uncolorize(plt.build()))


_STEPS = 1000  # number of steps of a progress bar


@contextmanager
def _shown(label: str) -> Iterator[Callable[[float, str], None]]:
    hidden = level() <= QUIET or not sys.stderr.isatty()
    with (
        timed(label),
        click.progressbar(
            length=_STEPS, label=label, file=sys.stderr, width=20, hidden=hidden, item_show_func=lambda said: said
        ) as bar,
    ):
        yield lambda fraction, said: bar.update(round(_STEPS * min(max(fraction, 0.0), 1.0)) - bar.pos, said)


@contextmanager
def progress(label: str) -> Iterator[Callable[[float], None]]:
    """Show a progress bar with a label during the `with` block.

    The context manager yields a function that updates the bar for a completed fraction, 0 to 1.
    """
    with _shown(label) as draw:
        yield lambda fraction: draw(fraction, "")


@contextmanager
def counter(label: str) -> Iterator[Callable[[int, int, float], None]]:
    """Show a progress bar with numbers of completed runs during the `with` block.

    The context manager yields a function that updates the bar. The function is called with the number of completed
    runs, the number of all runs, and the rate (1/s).
    """
    with _shown(label) as draw:
        yield lambda done, total, rate: draw(done / max(total, 1), f"{done}/{total} runs, {rate:.3g} runs/s")
