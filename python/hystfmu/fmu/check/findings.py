"""Findings of the check of an FMU, and the list of its checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hystfmu.base.printable import printable

MOST_CHECKS, MOST_WORDS = 40, 200


@dataclass(frozen=True)
class Check:
    """One property that was checked.

    Attributes
    ----------
    name : str
        The property.
    tried : str
        Extent of the check, such as ``3 instances, 250 steps``; empty if the check does not apply to the FMU.
    problems : int
        Number of problems.
    seconds : float
        Duration (s).
    """

    name: str
    tried: str
    problems: int
    seconds: float


@dataclass(frozen=True)
class Place:
    """Start point of a child process after a check has ended another child process.

    Attributes
    ----------
    first : int
        Number of the check.
    steps : int
        Number of steps that the FMU makes.
    failed : sequence of str
        Names of the checks that could not be completed; other checks may need their success.
    """

    first: int
    steps: int
    failed: Sequence[str]

    @classmethod
    def of(cls, notes: Any) -> Place:
        """Return the start point in the notes of a child process; the FMU may have changed the notes.

        Raises
        ------
        TypeError, ValueError, KeyError
            Something else is written there.
        """
        failed = [str(name)[:MOST_WORDS] for name in notes["failed"][:MOST_CHECKS]]
        return cls(int(notes["first"]), int(notes["steps"]), failed)


class Findings(list[str]):
    """Problems, one line each, with the `checks` that were made.

    Parameters
    ----------
    problems : sequence of str
    checks : sequence of Check
        Checks in their order; the last check may have ended the process.
    """

    def __init__(self, problems: Sequence[str] = (), checks: Sequence[Check] = ()) -> None:
        super().__init__(map(printable, problems))  # they name what an FMU calls its variables
        self.checks = tuple(checks)


def checks_of(notes: Any) -> list[Check]:
    """Return the checks in the notes of a child process; the FMU may have changed the notes.

    Raises
    ------
    TypeError, ValueError, KeyError
        Something else is written there.
    """
    return [
        Check(
            printable(str(c["name"])[:MOST_WORDS]),
            printable(str(c["tried"])[:MOST_WORDS]),
            int(c["problems"]),
            float(c["seconds"]),
        )
        for c in notes[:MOST_CHECKS]
    ]
