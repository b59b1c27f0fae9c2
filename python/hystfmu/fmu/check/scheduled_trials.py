"""Trials of a foreign FMU in Scheduled Execution: a simple scheduler activates the model partitions of input clocks."""

from __future__ import annotations

import ctypes as C
from collections.abc import Iterator
from typing import Any

from hystfmu.fmu.check.foreign_library import MADE, ForeignFmu, Trial, making
from hystfmu.fmu.foreign.instance import Instance, Values

_TICKS = 20
_CHANGED = 2  # fmi3IntervalChanged
_PERIODIC = {"constant", "fixed", "calculated", "tunable", "changing"}


class _Scheduler:
    """Scheduler that activates partitions by time and priority; triggered clocks tick in the first ticks only."""

    def __init__(self, fmu: ForeignFmu, made: Instance) -> None:
        self.fmu, self.made = fmu, made
        clocks = [v for v in fmu.description.modelVariables if v.type == "Clock" and v.causality == "input"]
        self.clocks = sorted(clocks, key=lambda v: int(v.priority or 0))
        self.countdown = [v for v in self.clocks if v.intervalVariability == "countdown"]
        self.ticking = [v for v in self.clocks if v.intervalVariability in _PERIODIC]

    def _activate(self, clock: Any, t: float) -> None:
        what = f"activating the partition of {clock.name} at {t:g} s"
        self.made.call(what, "activateModelPartition", clock.valueReference, t)
        for v in self.countdown:
            interval, qualifier = (C.c_double * 1)(), (C.c_int * 1)()
            references = (C.c_uint32 * 1)(v.valueReference)
            name = f"reading the interval of {v.name}"
            self.made.call(name, "fmi3GetIntervalDecimal", self.made.unit.component, references, 1, interval, qualifier)
            if qualifier[0] == _CHANGED:
                self._activate(v, t + interval[0])

    def run(self) -> list[Values]:
        """Return the outputs after each tick."""
        rows = []
        for k in range(_TICKS):
            for clock in self.clocks:
                period = float(clock.intervalDecimal or 1.0)
                if clock in self.ticking or (clock not in self.countdown and k < 2):
                    self._activate(clock, self.fmu.t0 + k * period)
            rows.append(tuple([x for v in self._outputs() for x in self.made.get(v)]))
        return rows

    def _outputs(self) -> list[Any]:
        return [v for v in self.fmu.variables if v.causality == "output"]


def scheduled_execution(fmu: ForeignFmu) -> Iterator[str]:
    """Partitions of all input clocks run; a second instance and a reset instance give the same outputs."""
    with fmu.instance("ScheduledExecution") as made:
        made.begin()
        want = _Scheduler(fmu, made).run()
        made.call("reset", "reset")
        made.initialize(fmu.t0)
        made.begin()
        if want != _Scheduler(fmu, made).run():
            yield "after reset the activations of the partitions give other outputs"
    with fmu.instance("ScheduledExecution") as made:
        made.begin()
        if want != _Scheduler(fmu, made).run():
            yield "the same activations in a new instance give other outputs"
        made.call("terminating", "terminate")


SCHEDULED_TRIALS = (
    making("ScheduledExecution"),
    Trial("activating the model partitions", scheduled_execution, MADE["ScheduledExecution"]),
)
