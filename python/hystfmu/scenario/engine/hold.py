"""Inputs during a step on the straight line through the last two values of their sources (`hold = "first"`).

A source that stands before the reader in the order has given its value at the end of the step: the line goes through
the values at both ends.  One that comes later has not: the line is continued.
"""

from __future__ import annotations

import ctypes as C
from collections.abc import Sequence

from hystfmu.scenario.system.system import Link, System


def weights(system: System, links: Sequence[Link]) -> list[float]:
    """How far into the reader's step the newest value of every source lies: 1 at its end, 0 at its beginning.

    A source that steps more often and comes later in the order lies one of its own steps before the end.
    """
    late = [system.maker(link).period / system.parts[link.to].period for link in links]
    return [1.0 if system.fresh(link) else 1.0 - part for link, part in zip(links, late, strict=True)]


class Lines:
    """The lines of one unit.

    Parameters
    ----------
    sources : sequence of int
        Places of the values that it reads.
    ahead : sequence of float
        As `weights` gives them.
    substeps : int
    values : array of c_double
        All values of the system.
    """

    def __init__(
        self, sources: Sequence[int], ahead: Sequence[float], substeps: int, values: C.Array[C.c_double]
    ) -> None:
        self._sources, self._ahead, self._substeps, self._values = sources, ahead, substeps, values

    def begin(self) -> None:
        """All units are initialised: the lines begin flat or at their first outputs."""
        self._now = self._before = [self._values[j] for j in self._sources]
        self._anew = False

    def cut(self) -> None:
        """A step has another length than the one before: the next line begins anew, flat."""
        self._anew = True

    def save(self) -> None:
        """Remember the present lines."""
        self._saved = self._now, self._before, self._anew

    def restore(self) -> None:
        """Go back to those that were saved last."""
        self._now, self._before, self._anew = self._saved

    def take(self) -> None:
        """Read the newest values."""
        now = [self._values[j] for j in self._sources]
        self._before, self._now = now if self._anew else self._now, now
        self._anew = False

    def at(self, i: int) -> list[float]:
        """The inputs of substep i, which are those at its end."""
        end = (i + 1) / self._substeps
        both = zip(self._now, self._before, self._ahead, strict=True)
        return [now + (now - before) * (end - ahead) for now, before, ahead in both]
