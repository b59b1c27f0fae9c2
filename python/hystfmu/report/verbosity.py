"""Amount of output of a command: -q prints only problems, -v also prints details and actions.

The level belongs to the running command. Outside of a command it is `NORMAL`.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import click

from hystfmu.base.printable import printable

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
    from hystfmu.report.terminal import paragraphs

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
