"""Model Exchange of somebody's FMU, tried out: a small solver drives it and looks at what a solver relies on.

Forward Euler is enough for that, since nothing is compared with an exact solution; a run that grows without bound is
ended, for that may be the method's fault.
"""

from __future__ import annotations

import ctypes as C
import math
from collections.abc import Callable, Iterator
from typing import Any

from hystfmu.fmu.guest import Guest, Instance, Values, slope_differs

_STEPS, _PARTS = 40, 8  # steps of the default experiment; parts of each where there are continuous states
_TOO_LARGE = 1e12
_MOST_EVENTS, _MOST_PAIRS = 100, 64
_NEAR = 1e-2  # a unit that integrates along its input gives the slope of the curve, not that of its own long step


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


def exchange_derivatives(guest: Guest) -> Iterator[str]:
    """Directional derivatives after the steps agree with differences, where inputs and states act at once."""
    if not guest.description.modelExchange.providesDirectionalDerivative:
        return
    found: list[str] = []

    def compare(unit: _Unit) -> None:
        listed = guest.description.derivatives
        rates = [u.variable for u in listed if not u.variable.shape]
        states = [v.derivative for v in rates] if len(rates) == unit.n else []
        unknowns = [v for v in guest.outputs if v.type in ("Real", "Float64") and not v.shape] + rates
        knowns = [v for v in guest.inputs if not v.shape] + states
        end = guest.t0 + _STEPS * guest.h

        def values(known: Any, off: float) -> list[float]:
            x = list(unit.x)
            if known in states:
                x[states.index(known)] += off
            unit.put(end, _STEPS, x)
            if known not in states:
                unit.made.set(known, [guest.excitation(known, _STEPS)[0] + off])
            return [unit.made.get(v)[0] for v in unknowns]

        for known in knowns[: _MOST_PAIRS // max(1, len(unknowns))]:
            e = 1e-6 * max(1.0, abs(values(known, 0.0)[0]) if known in states else abs(guest.excitation(known, 0)[0]))
            low, high, here = values(known, -e), values(known, e), values(known, 0.0)
            for k, unknown in enumerate(unknowns):
                got = unit.made.derivative(unknown, known)
                if slope := slope_differs(got, (low[k], here[k], high[k]), e, _NEAR):
                    pair = f"{unknown.name} with respect to {known.name}"
                    found.append(f"the derivative of {pair} is {got:.6g} after steps, differences give {slope}")

    _run(guest, at_end=compare)
    yield from found


EXCHANGE_TRIALS: dict[str, Callable[[Guest], Iterator[str]]] = {
    "running Model Exchange": model_exchange,
    "comparing derivatives with differences in Model Exchange": exchange_derivatives,
}
