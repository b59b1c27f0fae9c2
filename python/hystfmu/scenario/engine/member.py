"""The interface between the master and a unit that it steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from hystfmu.scenario.outcome.trace import Stopped


class Member(Protocol):
    """A unit as the master sees it.  It reads and writes the values of the system."""

    period: int
    """Number of fine steps between two calls."""
    name: str
    sources: list[int]
    """Index of the value that each input reads; -1 for a constant."""
    any_step: bool
    """True if `stretch` may be called."""
    turn: Sequence[Callable[[], int]]
    """`copy`, `advance`, `take` as a list of calls; a status above 1 is a failure."""

    def start(self, t0: float) -> None:
        """Initialise at `t0` with the present values and write the first outputs."""

    def stopped(self) -> Stopped:
        """Return the reason why the last call failed."""

    def begin(self) -> None:
        """Begin the run, after all units are initialised."""

    def stretch(self, h: float | None) -> None:
        """Set the length of the following steps (s); None restores the nominal step."""

    def copy(self) -> None:
        """Copy the inputs from the values of the system."""

    def advance(self) -> None:
        """Make one step from the time of its clock."""

    def take(self) -> None:
        """Copy the outputs to the values of the system."""

    def save(self) -> None:
        """Save the present state."""

    def restore(self) -> None:
        """Restore the state that was saved last."""

    def close(self) -> None:
        """Free what the unit holds."""


def whole_turn(member: Member) -> int:
    """Set inputs, step and get outputs in one call, for units that are more than calls of a binary.

    A failure is raised.
    """
    member.copy()
    member.advance()
    member.take()
    return 0
