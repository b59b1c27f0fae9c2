"""First-order hold: inputs during a step on the line through the last two values of their sources.

The line interpolates where the source precedes the reader in the order, and extrapolates where it follows.
"""

from __future__ import annotations

import ctypes as C
from collections.abc import Sequence

from hystfmu.scenario.system.system import Link, System


def weights(system: System, links: Sequence[Link]) -> list[float]:
    """Return the position of the newest value of each source within the reader's step: 1 at its end, 0 at its
    beginning.

    If a source steps more often and follows in the order, its value is one of its own steps old.
    """
    late = [system.maker(link).period / system.parts[link.to].period for link in links]
    return [1.0 if system.fresh(link) else 1.0 - part for link, part in zip(links, late, strict=True)]


class Lines:
    """The first-order hold of one unit.

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
        """Begin with constant lines at the first outputs."""
        self._now = self._before = [self._values[j] for j in self._sources]
        self._anew = False

    def cut(self) -> None:
        """Start the next line as a constant, because the length of the step changes."""
        self._anew = True

    def save(self) -> None:
        """Save the present lines."""
        self._saved = self._now, self._before, self._anew

    def restore(self) -> None:
        """Restore the lines that were saved last."""
        self._now, self._before, self._anew = self._saved

    def take(self) -> None:
        """Read the newest values of the sources."""
        now = [self._values[j] for j in self._sources]
        self._before, self._now = now if self._anew else self._now, now
        self._anew = False

    def at(self, i: int) -> list[float]:
        """Return the inputs of substep i, at its end."""
        end = (i + 1) / self._substeps
        both = zip(self._now, self._before, self._ahead, strict=True)
        return [now + (now - before) * (end - ahead) for now, before, ahead in both]
