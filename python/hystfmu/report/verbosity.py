"""Amount of output of a command: only problems with -q, also details and actions with -v.

The level belongs to the command that runs.  Outside of one it is `NORMAL`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import click

from hystfmu.base.printable import printable

QUIET, NORMAL, VERBOSE = -1, 0, 1
_KEY = "hystfmu.verbosity"


def level() -> int:
    """Return the level of the command that runs."""
    context = click.get_current_context(silent=True)
    return NORMAL if context is None else int(context.meta.get(_KEY, NORMAL))


def set_level(context: click.Context, to: int) -> None:
    """Set the level of a command."""
    context.meta[_KEY] = to


def echo(text: str, err: bool = False, nl: bool = True) -> None:
    """Print on stdout or stderr: everything that a command says, but JSON, which is ASCII, goes through here."""
    click.echo(printable(text, lines=True), err=err, nl=nl)


def say(text: str) -> None:
    """Print a result, or a remark on it; nothing with -q."""
    if level() > QUIET:
        echo(text)


def detail(text: str) -> None:
    """Print what is behind a result, with -v only."""
    if level() >= VERBOSE:
        echo(text)


def wrong(lines: Sequence[str]) -> None:
    """Print what failed, with -q only: other levels have it among the results."""
    if level() <= QUIET:
        for line in lines:
            echo(line)


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Print on stderr how long a step took, with -v only."""
    begin = time.monotonic()
    yield
    if level() >= VERBOSE:
        echo(f"{what}: {time.monotonic() - begin:.2f} s", err=True)
