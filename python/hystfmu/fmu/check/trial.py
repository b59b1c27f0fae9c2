"""A trial: one checked property of a running FMU, and the trial that has to pass first."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from hystfmu.fmu.check.foreign_library import ForeignFmu
from hystfmu.fmu.foreign.instance import Interface

MADE: dict[Interface, str] = {
    "CoSimulation": "making an instance",
    "ModelExchange": "making an instance for Model Exchange",
    "ScheduledExecution": "making an instance for Scheduled Execution",
}
"""Names of the trials that all others of an interface need."""


@dataclass(frozen=True)
class Trial:
    """One property.

    Attributes
    ----------
    name : str
        What is done.
    find : callable
        Yields the problems of an FMU as sentences. A `Finding` that it raises means that the trial cannot be made.
    needs : str
        Name of the trial that must pass first; otherwise this one would repeat its problem.
    """

    name: str
    find: Callable[[ForeignFmu], Iterator[str]]
    needs: str


def making(interface: Interface) -> Trial:
    """Return the trial that makes an instance, enters Initialization Mode and frees it."""

    def find(fmu: ForeignFmu) -> Iterator[str]:
        with fmu.instance(interface):
            yield from ()

    return Trial(MADE[interface], find, "")
