"""Report of progress: a function that is called with the fraction done, 0..1."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float], None]


def silent(fraction: float) -> None:
    """Report nothing."""


def part(progress: Progress, first: float, last: float) -> Progress:
    """Return the report of a part of the work, from the fraction `first` to `last` of the whole."""
    return lambda fraction: progress(first + (last - first) * fraction)
