"""What the master steps: a unit of a system, whatever executes it."""

from __future__ import annotations

from typing import Protocol


class Member(Protocol):
    """A unit as the master sees it: it reads and writes the values of the system."""

    period: int
    """In fine steps."""
    name: str

    def start(self, t0: float) -> None:
        """Initialise at `t0` with the present values, and write the first outputs."""

    def step(self, t: float) -> None:
        """`copy`, `advance`, `take` at once, from the time `t`."""

    def copy(self) -> None:
        """Take the inputs from the values of the system."""

    def advance(self, t: float) -> None:
        """One step from the time `t`."""

    def take(self) -> None:
        """Write the outputs among the values of the system."""

    def save(self) -> None:
        """Remember the present state."""

    def restore(self) -> None:
        """Go back to the state that was saved last."""

    def close(self) -> None:
        """Free what the unit holds."""
