"""Progress on a terminal: finished share, rate and remaining time. There is no output in a pipe or with -q."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from hystfmu.base.printable import printable
from hystfmu.report.verbosity import QUIET, level, timed

PAUSE = 0.1  # s between two pictures of the bar
BAR = 20  # characters


class Bar:
    """A progress bar: one line on stderr that is overwritten.

    Parameters
    ----------
    label : str
        Name of the work.
    clock : function
        Returns the time in seconds.
    """

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
