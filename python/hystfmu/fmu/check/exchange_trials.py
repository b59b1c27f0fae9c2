"""Trials of a foreign FMU in Model Exchange and in Scheduled Execution.

The trials check the properties that solvers need. They integrate with the forward Euler method, which is sufficient
because no result is compared with an exact solution. The method may be unstable, so a run ends if a state grows without
bound. A simple scheduler activates the model partitions of input clocks.
"""

import ctypes as C
import math
import struct
from collections.abc import Callable, Iterator
from typing import Any

from hystfmu.fmu.check.foreign_library import MADE, ForeignFmu, Trial, making, tangent_differs
from hystfmu.fmu.foreign.instance import Finding, Instance, Values, count
from hystfmu.fmu.foreign.simulated import Continuous

_STEPS, _PARTS = 40, 8  # number of steps; number of substeps of each step if there are continuous states
_TOO_LARGE = 1e12
_MOST_PAIRS = 64
_MOVES = 1e-9  # relative change that counts as a dependency; iterative solvers in the FMU cause smaller changes


class _Unit:
    """An instance in Continuous-Time Mode that is driven by the inputs of the trials."""

    def __init__(self, fmu: ForeignFmu, made: Instance) -> None:
        self.fmu, self.made = fmu, made
        signs = int(fmu.description.numberOfEventIndicators or 0)
        self.time = Continuous(made, int(fmu.description.numberOfContinuousStates or 0), signs)
        self.n = self.time.n
        self.x, self.z = self.time.states(), self.time.indicators()

    def put(self, t: float, k: int, x: list[float]) -> None:
        """Set the time (s) and the continuous states, and set the continuous inputs to row k of their test signals."""
        self.time.put(t, x)
        for v in self.fmu.continuous:
            self.made.set(v, self.fmu.excitation(v, k))

    def event(self, k: int) -> None:
        """Handle an event. In Event Mode, set all inputs that are not continuous to row k of their test signals."""

        def put() -> None:
            for v in self.fmu.discrete:
                self.made.set(v, self.fmu.excitation(v, k))

        self.time.event(put)
        self.x, self.z = self.time.states(), self.time.indicators()

    def accept(self, t: float, k: int, close: float) -> None:
        """Accept the step that ends at t (s), and handle an event at t if there is one.

        A time event counts as an event at t if it is at most `close` (s) later.
        """
        asked = self.time.completed()
        if self.time.ended:
            return
        z = self.time.indicators()
        if asked or t >= self.time.next - close or any((a > 0) != (b > 0) for a, b in zip(self.z, z, strict=True)):
            self.event(k)
            if not self.time.ended and self.time.next < t - close:
                raise Finding(f"the next time event is announced for {self.time.next:g} s, which is before {t:g} s")
        else:
            self.z = z

    def step(self, k: int, rejected: bool) -> bool:
        """Integrate step k; return False if a state grows without bound or the FMU ends the simulation.

        With `rejected`, every substep is first tried with other inputs and rejected.
        """
        t, h = self.fmu.t0 + k * self.fmu.h, self.fmu.h
        parts = _PARTS if self.n else 1
        if self.fmu.discrete:
            self.put(t, k, self.x)
            self.event(k)
            if self.time.ended:
                return False
        close = 1e-9 * h
        now = t
        for part in range(parts):
            end = t + h if part == parts - 1 else t + (part + 1) * h / parts
            while now < end:  # no substep passes over a time event
                stop = self.time.next if now + close < self.time.next < end - close else end
                if not self._substep(now, stop, k, rejected, close):
                    return False
                now = stop
        return True

    def _substep(self, now: float, end: float, k: int, rejected: bool, close: float) -> bool:
        """Integrate from `now` to `end` (s) with the inputs of row k; return the same as `step`."""
        self.put(now, k, self.x)
        rates = self.time.derivatives()
        if rejected:
            self.put(end, k + 5, [x + self.fmu.h * d / 2 for x, d in zip(self.x, rates, strict=True)])
            self.time.derivatives()
            self.fmu.read(self.made)
            self.put(now, k, self.x)
        self.x = [x + (end - now) * d for x, d in zip(self.x, rates, strict=True)]
        if not all(abs(x) < _TOO_LARGE for x in self.x):
            return False
        self.put(end, k, self.x)
        self.accept(end, k, close)
        return not self.time.ended


def _run(fmu: ForeignFmu, rejected: bool = False, at_end: Callable[[_Unit], None] | None = None) -> list[Values]:
    """Return the outputs after each step of a run. The function `at_end` is called with the instance after the run."""
    out: list[Values] = []
    with fmu.instance("ModelExchange") as made:
        unit = _Unit(fmu, made)
        for k in range(_STEPS):
            if not unit.step(k, rejected):
                return out
            out.append(fmu.read(made))
        if at_end:
            at_end(unit)
    return out


def model_exchange(fmu: ForeignFmu) -> Iterator[str]:
    """Check that runs are repeatable, and that rejected steps have no effect.

    For an FMU of HystFMU, also check that Model Exchange agrees with Co-Simulation.
    """
    want = _run(fmu)
    if where := fmu.difference(want, _run(fmu)):
        yield f"the same run in a new instance differs in Model Exchange: {where}"
        return
    if where := fmu.difference(want, _run(fmu, rejected=True)):
        yield f"rejected steps change the run in Model Exchange: {where}"
    ours = str(fmu.description.generationTool or "").startswith("HystFMU")
    if ours and not fmu.description.numberOfContinuousStates and fmu.description.coSimulation:
        with fmu.running() as made:
            if where := fmu.difference(fmu.run(made, range(_STEPS)), want):
                yield f"Model Exchange differs from Co-Simulation: {where}"


def state_order(fmu: ForeignFmu) -> Iterator[str]:
    """Check that states and derivatives have the order and the values of their variables in the model structure."""
    listed = [u.variable for u in fmu.description.derivatives]
    if not listed or fmu.version == 1 or not all(v.derivative for v in listed):
        return  # a derivative without a state is a problem of the description
    with fmu.instance("ModelExchange") as made:
        unit = _Unit(fmu, made)
        if sum(count(v) for v in listed) != unit.n:
            yield f"the binary has {unit.n} continuous states, but the model structure {sum(map(count, listed))}"
            return
        unit.put(fmu.t0, 0, [x + 0.125 * (1 + i) for i, x in enumerate(unit.x)])
        for what, whole, variables in (
            ("continuous state", unit.time.states(), [v.derivative for v in listed]),
            ("derivative", unit.time.derivatives(), listed),
        ):
            named = [(v.name, x) for v in variables for x in made.get(v)]
            for i, (x, (name, y)) in enumerate(zip(whole, named, strict=True)):
                if struct.pack("d", x) != struct.pack("d", y):
                    yield f"{what} {i + 1} is {x:g}, but {name}, which the model structure names, is {y:g}"
        for i, x in enumerate(unit.time.nominals()):
            if not (math.isfinite(x) and x > 0):
                yield f"the nominal value of continuous state {i + 1} is {x:g}; it must be positive"


class _Point:
    """Outputs and derivatives of an instance at the end of a run, as functions of one input or continuous state."""

    def __init__(self, unit: _Unit) -> None:
        self.unit, self.fmu = unit, unit.fmu
        self.t = self.fmu.t0 + _STEPS * self.fmu.h
        listed = [u.variable for u in self.fmu.description.derivatives]
        # states that are arrays are not checked; a derivative without a state is a problem of the description
        self.rates = listed if len(listed) == unit.n and all(v.derivative for v in listed) else []
        self.states = [v.derivative for v in self.rates]
        self.knowns = [*self.fmu.continuous, *self.states]
        self.unknowns = [v for v in self.fmu.outputs if v.type in ("Real", "Float64")] + self.rates

    def same(self, unknown: Any, known: Any) -> bool:
        """Return whether an output and a state are the same variable. Such an output depends on this state only."""
        return bool(unknown.valueReference == known.valueReference)

    def size(self, known: Any) -> float:
        """Return the magnitude of an input or a state, at least 1."""
        x = self.unit.x[self.states.index(known)] if known in self.states else self.fmu.excitation(known, _STEPS)[0]
        return max(1.0, abs(x))

    def values(self, known: Any, off: float) -> list[Values]:
        """Return all outputs and derivatives after a shift of one input or state by `off`."""
        x = list(self.unit.x)
        if known in self.states:
            x[self.states.index(known)] += off
        self.unit.put(self.t, _STEPS, x)
        if known not in self.states:
            self.unit.made.set(known, self.fmu.excitation(known, _STEPS, off))
        return [self.unit.made.get(v) for v in self.unknowns]


def exchange_dependencies(fmu: ForeignFmu) -> Iterator[str]:
    """Check that the model structure declares all direct dependencies on inputs and continuous states.

    The dependencies in Event Mode are also checked.
    """
    if fmu.version == 1:
        return
    structure = [*fmu.description.outputs, *fmu.description.derivatives]
    declared = {u.variable.name: {v.name for v in u.dependencies} for u in structure if u.dependencies is not None}
    found: list[str] = []

    def compare(point: _Point, known: Any, a: list[Values], b: list[Values]) -> None:
        for unknown, before, after in zip(point.unknowns, a, b, strict=True):
            silent = unknown.name in declared and known.name not in declared[unknown.name]
            silent = silent and not point.same(unknown, known)
            if silent and any(abs(y - x) > _MOVES * max(1.0, abs(x)) for x, y in zip(before, after, strict=True)):
                found.append(
                    f"{unknown.name} depends on {known.name} at once, but modelDescription.xml says that it does not"
                )

    def look(unit: _Unit) -> None:
        point = _Point(unit)
        for known in point.knowns[:_MOST_PAIRS]:
            for off in (-0.3, 0.3):
                compare(point, known, point.values(known, 0.0), point.values(known, off * point.size(known)))
        unit.put(unit.time.next if math.isfinite(unit.time.next) else point.t, _STEPS, unit.x)
        unit.made.call("entering Event Mode", "enterEventMode")
        for v in fmu.inputs[:_MOST_PAIRS]:
            values = []
            for off in (0.3, 0.0):
                unit.made.set(v, fmu.excitation(v, _STEPS, off))
                values.append([unit.made.get(y) for y in point.unknowns])
            compare(point, v, *values)

    _run(fmu, at_end=look)
    yield from dict.fromkeys(found)


def exchange_derivatives(fmu: ForeignFmu) -> Iterator[str]:
    """Check that directional derivatives at the end of a run agree with finite differences."""
    if "ModelExchange" not in fmu.with_derivatives:
        return
    found: list[str] = []

    def look(unit: _Unit) -> None:
        point = _Point(unit)
        scalar = [(k, v) for k, v in enumerate(point.unknowns) if not v.shape]
        for known in [v for v in point.knowns if not v.shape][: _MOST_PAIRS // max(1, len(scalar))]:
            for k, unknown in scalar:
                if point.same(unknown, known):
                    continue

                def value(off: float, known: Any = known, k: int = k) -> float:
                    return point.values(known, off)[k][0]

                value(0.0)
                got = unit.made.derivative(unknown, known)
                if other := tangent_differs(got, value, 1e-6 * point.size(known)):
                    pair = f"{unknown.name} with respect to {known.name}"
                    found.append(
                        f"the directional derivative of {pair} is {got:.6g} after steps, but differences give {other}"
                    )

    _run(fmu, at_end=look)
    yield from found


_MADE = MADE["ModelExchange"]
_RUN = "running Model Exchange"
EXCHANGE_TRIALS = (
    making("ModelExchange"),
    Trial(_RUN, model_exchange, _MADE),
    Trial("comparing states with their variables", state_order, _MADE),
    Trial("checking the dependencies in Model Exchange", exchange_dependencies, _RUN),
    Trial("comparing directional derivatives with differences in Model Exchange", exchange_derivatives, _RUN),
)


_TICKS = 20
_CHANGED = 2  # fmi3IntervalChanged
_PERIODIC = {"constant", "fixed", "calculated", "tunable", "changing"}


class _Scheduler:
    """Scheduler that activates model partitions by time and priority. Triggered clocks tick only in its first ticks."""

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
        """Return the outputs after each tick of the scheduler."""
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
    """Check that the partitions of all input clocks run, and that the outputs are repeatable.

    A second instance and a reset instance must give the same outputs.
    """
    with fmu.instance("ScheduledExecution") as made:
        made.begin()
        want = _Scheduler(fmu, made).run()
        made.restart(fmu.t0)
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
