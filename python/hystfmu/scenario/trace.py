"""What a run leaves: all values on the fine grid, or the reason why it ended early."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from hystfmu.core import Array


class Stopped(Exception):
    """A unit refused to go on (a diverged loop ends with values that are not finite): a failure, not bad input."""


@dataclass(frozen=True)
class Trace:
    """All outputs of all units of one run.

    Parameters
    ----------
    t : array, shape (n + 1,)
        Times of the fine grid (s).
    values : array, shape (n + 1, n_values)
    columns : dict of str to int
        Place of every output `unit.output` among the values.
    ripple : int
        Fine steps in a step.
    memory : dict of str to str
        Fingerprint of the final states of every unit, where the case asks for it.
    """

    t: Array
    values: Array
    columns: dict[str, int]
    ripple: int
    memory: dict[str, str] = field(default_factory=dict)

    def __getitem__(self, end: str) -> Array:
        return self.values[:, self.columns[end]]

    def only(self, ends: Iterable[str]) -> Trace:
        """A copy that holds the outputs `ends` (`unit.output`) alone: many cases are kept for a report."""
        kept = list(dict.fromkeys(ends))
        values = self.values[:, [self.columns[e] for e in kept]]
        return Trace(self.t, values, {e: k for k, e in enumerate(kept)}, self.ripple, self.memory)
