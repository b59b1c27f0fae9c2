"""Model Exchange of somebody's FMU, tried out: a small solver drives it and looks at what a solver relies on.

Forward Euler is enough for that, since nothing is compared with an exact solution; a run that grows without bound is
ended, for that may be the method's fault.
"""

from __future__ import annotations

import ctypes as C
import math
from collections.abc import Callable, Iterator
from typing import Any

from hystfmu.fmu.check.foreign_library import Guest, Instance, Values, slope_differs

_STEPS, _PARTS = 40, 8  # steps of the default experiment; parts of each where there are continuous states
_TOO_LARGE = 1e12
_MOST_EVENTS, _MOST_PAIRS = 100, 64
_MOVES = 1e-9  # of a value: less may come from the iterations of a solver inside


class _Unit:
    """An instance in Continuous-Time Mode."""

    def __init__(self, guest: Guest, made: Instance) -> None:
        self.guest, self.made, self.next = guest, made, math.inf
        self.n = int(guest.description.numberOfContinuousStates or 0)
        self.signs = int(guest.description.numberOfEventIndicators or 0)
        made.call("leaving Initialization Mode", "exitInitializationMode")
        self._update()
        self.x, self.z = self._vector("getContinuousStates", self.n), self.indicators()

    def _vector(self, name: str, n: int) -> list[float]:
        values = (C.c_double * n)()
        if n:
            self.made.call(f"calling {name}", name, values, n)
        return list(values)

    def _update(self) -> None:
        """The event happens, until all is settled."""
        name = "newDiscreteStates" if self.made.fmi2 else "updateDiscreteStates"
        for _ in range(_MOST_EVENTS):
            again, _, _, _, defined, at = self.made.call("updating the discrete states", name)
            if not again:
                break
        self.next = at if defined else math.inf
        self.made.call("entering Continuous-Time Mode", "enterContinuousTimeMode")

    def indicators(self) -> list[float]:
        return self._vector("getEventIndicators", self.signs)

    def derivatives(self) -> list[float]:
        return self._vector("getDerivatives" if self.made.fmi2 else "getContinuousStateDerivatives", self.n)

    def put(self, t: float, k: int, x: list[float]) -> None:
        """Time, row k of the inputs, continuous states."""
        self.made.call(f"setting the time {t:g} s", "setTime", t)
        for v in self.guest.inputs:
            self.made.set(v, self.guest.excitation(v, k))
        if self.n:
            self.made.call("setting the continuous states", "setContinuousStates", (C.c_double * self.n)(*x), self.n)

    def accept(self, t: float, close: float) -> None:
        """The step that ends at t is accepted; then the event, if one is due."""
        asked, _ = self.made.call("accepting a step", "completedIntegratorStep")
        z = self.indicators()
        if asked or t >= self.next - close or any((a > 0) != (b > 0) for a, b in zip(self.z, z, strict=True)):
            self.made.call("entering Event Mode", "enterEventMode")
            self._update()
            self.x = self._vector("getContinuousStates", self.n)
        self.z = self.indicators()

    def step(self, k: int, rejected: bool) -> bool:
        """Step k; with `rejected` every part of it is first tried with other inputs, and not accepted."""
        t, h = self.guest.t0 + k * self.guest.h, self.guest.h
        parts = _PARTS if self.n else 1
        for part in range(parts):
            now, end = t + part * h / parts, t + h if part == parts - 1 else t + (part + 1) * h / parts
            self.put(now, k, self.x)
            slopes = self.derivatives()
            if rejected:
                self.put(end, k + 5, [x + h * d / 2 for x, d in zip(self.x, slopes, strict=True)])
                self.derivatives()
                self.guest.read(self.made)
                self.put(now, k, self.x)
            self.x = [x + (end - now) * d for x, d in zip(self.x, slopes, strict=True)]
            if not all(abs(x) < _TOO_LARGE for x in self.x):
                return False
            self.put(end, k, self.x)
            self.accept(end, 1e-9 * h)
        return True


def _run(guest: Guest, rejected: bool = False, at_end: Callable[[_Unit], None] | None = None) -> list[Values]:
    """Outputs after each step."""
    out: list[Values] = []
    with guest.instance(exchange=True) as made:
        unit = _Unit(guest, made)
        for k in range(_STEPS):
            if not unit.step(k, rejected):
                return out
            out.append(guest.read(made))
        if at_end:
            at_end(unit)
    return out


def model_exchange(guest: Guest) -> Iterator[str]:
    """A run can be repeated, steps that were not accepted leave no trace; ours is that of Co-Simulation."""
    want = _run(guest)
    if where := guest.difference(want, _run(guest)):
        yield f"the same run in a new instance differs in Model Exchange: {where}"
        return
    if where := guest.difference(want, _run(guest, rejected=True)):
        yield f"steps that were tried and not accepted change the run in Model Exchange: {where}"
    ours = str(guest.description.generationTool or "").startswith("HystFMU")
    if ours and not guest.description.numberOfContinuousStates and guest.description.coSimulation:
        with guest.running() as made:
            if where := guest.difference(guest.run(made, range(_STEPS)), want):
                yield f"Model Exchange differs from Co-Simulation: {where}"


class _Point:
    """Outputs and derivatives where a run stands, as functions of one input or continuous state."""

    def __init__(self, unit: _Unit) -> None:
        self.unit, self.guest = unit, unit.guest
        self.t = self.guest.t0 + _STEPS * self.guest.h
        listed = [u.variable for u in self.guest.description.derivatives]
        self.rates = listed if len(listed) == unit.n else []  # states that are arrays: not looked at
        self.states = [v.derivative for v in self.rates]
        self.knowns = [*self.guest.inputs, *self.states]
        self.unknowns = [v for v in self.guest.outputs if v.type in ("Real", "Float64")] + self.rates

    def size(self, known: Any) -> float:
        """Of a known."""
        x = self.unit.x[self.states.index(known)] if known in self.states else self.guest.excitation(known, _STEPS)[0]
        return max(1.0, abs(x))

    def values(self, known: Any, off: float) -> list[Values]:
        """Of all unknowns, with one known moved by `off`."""
        x = list(self.unit.x)
        if known in self.states:
            x[self.states.index(known)] += off
        self.unit.put(self.t, _STEPS, x)
        if known not in self.states:
            self.unit.made.set(known, self.guest.excitation(known, _STEPS, off))
        return [self.unit.made.get(v) for v in self.unknowns]


def exchange_dependencies(guest: Guest) -> Iterator[str]:
    """What moves at once with an input or a continuous state says so in its dependencies; in Event Mode too."""
    structure = [*guest.description.outputs, *guest.description.derivatives]
    declared = {u.variable.name: {v.name for v in u.dependencies} for u in structure if u.dependencies is not None}
    found: list[str] = []

    def compare(point: _Point, known: Any, a: list[Values], b: list[Values]) -> None:
        for unknown, before, after in zip(point.unknowns, a, b, strict=True):
            silent = unknown.name in declared and known.name not in declared[unknown.name]
            if silent and any(abs(y - x) > _MOVES * max(1.0, abs(x)) for x, y in zip(before, after, strict=True)):
                found.append(
                    f"{unknown.name} depends on {known.name} at once, but modelDescription.xml says that it does not"
                )

    def look(unit: _Unit) -> None:
        point = _Point(unit)
        for known in point.knowns[:_MOST_PAIRS]:
            for off in (-0.3, 0.3):
                compare(point, known, point.values(known, 0.0), point.values(known, off * point.size(known)))
        unit.put(unit.next if math.isfinite(unit.next) else point.t, _STEPS, unit.x)
        unit.made.call("entering Event Mode", "enterEventMode")
        for v in guest.inputs[:_MOST_PAIRS]:
            values = []
            for off in (0.3, 0.0):
                unit.made.set(v, guest.excitation(v, _STEPS, off))
                values.append([unit.made.get(y) for y in point.unknowns])
            compare(point, v, *values)

    _run(guest, at_end=look)
    yield from dict.fromkeys(found)


def exchange_derivatives(guest: Guest) -> Iterator[str]:
    """Directional derivatives after the steps agree with differences, where inputs and states act at once."""
    if "ModelExchange" not in guest.with_derivatives:
        return
    found: list[str] = []

    def look(unit: _Unit) -> None:
        point = _Point(unit)
        scalar = [(k, v) for k, v in enumerate(point.unknowns) if not v.shape]
        for known in [v for v in point.knowns if not v.shape][: _MOST_PAIRS // max(1, len(scalar))]:
            for k, unknown in scalar:

                def value(off: float, known: Any = known, k: int = k) -> float:
                    return point.values(known, off)[k][0]

                value(0.0)
                got = unit.made.derivative(unknown, known)
                if slope := slope_differs(got, value, 1e-6 * point.size(known)):
                    pair = f"{unknown.name} with respect to {known.name}"
                    found.append(f"the derivative of {pair} is {got:.6g} after steps, differences give {slope}")

    _run(guest, at_end=look)
    yield from found


EXCHANGE_TRIALS: dict[str, Callable[[Guest], Iterator[str]]] = {
    "running Model Exchange": model_exchange,
    "trying the dependencies in Model Exchange": exchange_dependencies,
    "comparing derivatives with differences in Model Exchange": exchange_derivatives,
}
