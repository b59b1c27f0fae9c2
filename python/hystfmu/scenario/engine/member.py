"""What the master steps: a unit of a system, whatever executes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from hystfmu.scenario.outcome.trace import Stopped


class Member(Protocol):
    """A unit as the master sees it: it reads and writes the values of the system."""

    period: int
    """In fine steps."""
    name: str
    sources: list[int]
    """Per element of its inputs the place of the value that it reads; -1: none, a constant."""
    any_step: bool
    """Whether `stretch` may be called."""
    turn: Sequence[Callable[[], int]]
    """`copy`, `advance`, `take`, one after the other, for a master that calls nothing else: above 1 is a failure."""

    def start(self, t0: float) -> None:
        """Initialise at `t0` with the present values, and write the first outputs."""

    def stopped(self) -> Stopped:
        """Why the last call failed."""

    def begin(self) -> None:
        """All units are initialised."""

    def stretch(self, h: float | None) -> None:
        """The next step takes `h` seconds, the others as well until the next call; None restores the nominal step."""

    def copy(self) -> None:
        """Take the inputs from the values of the system."""

    def advance(self) -> None:
        """One step from the time on the clock that the unit was made with."""

    def take(self) -> None:
        """Write the outputs among the values of the system."""

    def save(self) -> None:
        """Remember the present state."""

    def restore(self) -> None:
        """Go back to the state that was saved last."""

    def slope(self, du: list[float]) -> list[float] | None:
        """Change of its outputs for a change of its inputs (those of `sources`), after a step; None: not finite."""

    def state_hash(self) -> str:
        """Return the hash of the present states; not of a foreign FMU."""

    def close(self) -> None:
        """Free what the unit holds."""


def whole_turn(member: Member) -> int:
    """A turn in one call, for members whose steps need more than a list of calls of a binary; a failure is raised."""
    member.copy()
    member.advance()
    member.take()
    return 0
