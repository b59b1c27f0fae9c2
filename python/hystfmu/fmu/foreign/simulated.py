"""Simulation of an FMU of any origin, with the same methods for Co-Simulation and Model Exchange.

Model Exchange uses an adaptive Runge-Kutta 5(4) method (Dormand & Prince 1980, RK45 of scipy). The local error of a
solver step is at most 1e-8 of a state plus 1e-11 of its nominal value. State events are located on the interpolated
solution, to the floating-point precision of the time.
"""

import ctypes as C
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.fmu.foreign.instance import Ended, Finding, Instance, carried

_MOST_UPDATES = 100  # maximum number of iterations of one event
_NAMES = {
    1: ("getDerivatives", "eventUpdate", "getNominalContinuousStates"),
    2: ("getDerivatives", "newDiscreteStates", "getNominalsOfContinuousStates"),
    3: ("getContinuousStateDerivatives", "updateDiscreteStates", "getNominalsOfContinuousStates"),
}


class Continuous:
    """An instance that leaves Initialization Mode and enters Continuous-Time Mode.

    `n` and `signs` are the numbers of continuous states and of event indicators in the model description. In FMI 3.0,
    they are read from the binary, because structural parameters may change them. `next` is the time (s) of the next
    time event; it is infinite if the FMU announces no event. `ended` states whether the FMU has ended the simulation.
    """

    def __init__(self, made: Instance, n: int, signs: int) -> None:
        self.made, self.next, self.ended = made, math.inf, False
        self._rates, self._update_name, self._nominals = _NAMES[made.version]
        told = made.begin()
        self.n, self.signs = n, signs
        if made.version == 3:
            self.n = int(made.call("counting the continuous states", "getNumberOfContinuousStates"))
            self.signs = int(made.call("counting the event indicators", "getNumberOfEventIndicators"))
        self._update(told)

    def _vector(self, name: str, n: int) -> list[float]:
        values = (C.c_double * n)()
        if n:
            self.made.call(f"calling {name}", name, values, n)
        return list(values)

    def _update(self, told: tuple[bool, bool, bool, bool, bool, float] | None = None) -> None:
        """Update the discrete states until the event iteration ends, then enter Continuous-Time Mode."""
        first = self.made.version == 1
        for _ in range(_MOST_UPDATES):
            if told is None:
                told = self.made.call("updating the discrete states", self._update_name)
            if first:
                converged, _, _, self.ended, defined, at = told
                again = not converged
            else:
                again, self.ended, _, _, defined, at = told
            if self.ended or not again:
                break
            told = None
        else:
            raise Finding(f"the event iteration does not end: {_MOST_UPDATES} updates each request another one")
        self.next = at if defined else math.inf
        if not first and not self.ended:
            self.made.call("entering Continuous-Time Mode", "enterContinuousTimeMode")

    def states(self) -> list[float]:
        """Return the continuous states."""
        return self._vector("getContinuousStates", self.n)

    def nominals(self) -> list[float]:
        """Return the nominal values of the continuous states."""
        return self._vector(self._nominals, self.n)

    def indicators(self) -> list[float]:
        """Return the event indicators."""
        return self._vector("getEventIndicators", self.signs)

    def derivatives(self) -> list[float]:
        """Return the derivatives of the continuous states."""
        return self._vector(self._rates, self.n)

    def put(self, t: float, x: list[float]) -> None:
        """Set the time (s) and the continuous states."""
        self.made.call(f"setting the time {t:g} s", "setTime", t)
        if self.n:
            self.made.call("setting the continuous states", "setContinuousStates", (C.c_double * self.n)(*x), self.n)

    def completed(self) -> bool:
        """Accept the solver step that ends at the present time; return whether the FMU requests Event Mode."""
        if self.made.version == 1:
            return bool(self.made.call("accepting a step", "completedIntegratorStep"))
        asked, ended = self.made.call("accepting a step", "completedIntegratorStep")
        self.ended = self.ended or ended
        return bool(asked)

    def event(self, put: Callable[[], None] | None = None) -> None:
        """Handle an event at the present time. In Event Mode, the function `put` sets the discrete inputs."""
        if self.made.version > 1:
            self.made.call("entering Event Mode", "enterEventMode")
        if put is not None:
            put()
        self._update()


RELATIVE, ABSOLUTE = 1e-8, 1e-11
_MOST_EVENTS = 10_000  # maximum number of events in one step
_LOOKS = 4  # number of points of a solver step at which the event indicators are evaluated


def _point(dense: Any, solver: Any, t: float) -> list[float]:
    """Return the states at the time t in the last solver step, interpolated except at the end of the step."""
    x: list[float] = (solver.y if t == solver.t else dense(t)).tolist()
    return x


class Integrator:
    """Integrator of an FMU in Model Exchange, from the time `t` (s), in steps of any length with constant inputs."""

    def __init__(self, unit: Continuous, t: float) -> None:
        self._unit, self._t = unit, t
        self._x, self._z = unit.states(), unit.indicators()
        self._limit = [ABSOLUTE * (n if math.isfinite(n) and n > 0 else 1.0) for n in unit.nominals()]
        self._first: float | None = None

    def event(self, put: Callable[[], None] | None = None) -> None:
        """Handle an event. The function `put` sets inputs that change discontinuously, which requires Event Mode."""
        self._unit.event(put)
        self._ended()
        self._x, self._z = self._unit.states(), self._unit.indicators()

    def _ended(self) -> None:
        if self._unit.ended:
            raise Ended(f"the FMU ends the simulation at {self._t:g} s")

    def advance(self, end: float) -> None:
        """Integrate to the time `end` (s), and handle all events, including events at this time."""
        close = 4 * np.spacing(max(abs(self._t), abs(end)))
        for _ in range(_MOST_EVENTS):
            if self._unit.next <= self._t + close:
                self.event()
                if self._unit.next <= self._t:
                    raise Finding(f"the next time event is announced for {self._unit.next:g} s, which has passed")
                continue
            if self._t >= end - close:
                return
            limit = end if self._unit.next >= end - close else self._unit.next
            asked = self._integrate(limit)
            self._ended()
            if asked:
                self.event()
        raise Finding(f"more than {_MOST_EVENTS} events before {end:g} s")

    def _integrate(self, limit: float) -> bool:
        """Integrate to the time `limit` (s), or to the first event; return whether there is an event."""
        if not self._x:
            return self._accept(self._t, limit, lambda t: [])
        from scipy.integrate import RK45

        first = None if self._first is None else min(self._first, limit - self._t)
        atol: Any = np.array(self._limit)
        solver: Any = RK45(self._rates, self._t, np.array(self._x), limit, rtol=RELATIVE, atol=atol, first_step=first)
        while solver.status == "running":
            before = float(solver.t)
            message = solver.step()
            if solver.status == "failed":
                raise Finding(f"the integration fails at {before:g} s: {message}")
            self._first = float(solver.h_abs)
            if self._accept(before, float(solver.t), partial(_point, solver.dense_output(), solver)):
                return True
        return False

    def _rates(self, t: float, x: Any) -> Any:
        self._unit.put(t, x.tolist())
        return np.array(self._unit.derivatives())

    def _accept(self, before: float, now: float, at: Callable[[float], list[float]]) -> bool:
        """Accept a solver step up to the first sign change of an indicator, if any; return whether an event follows."""
        crossed = False
        left, looks = before, _LOOKS if self._z else 1
        for k in range(looks):
            right = now if k == looks - 1 else before + (now - before) * (k + 1) / looks
            if self._changed(right, at):
                now, crossed = self._located(left, right, at), True
                break
            left = right
        self._x, self._t = at(now), now
        self._unit.put(now, self._x)
        asked = self._unit.completed()
        if not (crossed or asked):
            self._z = self._unit.indicators()
        return crossed or asked

    def _changed(self, t: float, at: Callable[[float], list[float]]) -> bool:
        if not self._z:
            return False
        self._unit.put(t, at(t))
        return any((a > 0) != (b > 0) for a, b in zip(self._z, self._unit.indicators(), strict=True))

    def _located(self, left: float, right: float, at: Callable[[float], list[float]]) -> float:
        """Return the time (s) just after the first sign change of an event indicator between `left` and `right`."""
        while right - left > 2 * np.spacing(abs(right)):
            middle = (left + right) / 2
            if self._changed(middle, at):
                right = middle
            else:
                left = middle
        return right

    def save(self) -> tuple[Any, ...]:
        """Return the state of the integrator, without the state of the FMU."""
        return self._t, list(self._x), list(self._z), self._unit.next, self._first

    def restore(self, saved: tuple[Any, ...]) -> None:
        """Restore a saved state of the integrator. The state of the FMU must be restored first."""
        self._t, x, z, self._unit.next, self._first = saved
        self._x, self._z = list(x), list(z)


class Simulated:
    """One instance in Co-Simulation, or in Model Exchange with an integrator if the FMU has no Co-Simulation.

    `inputs` and `outputs` are the variables to set and to read, with the number of elements of each. All methods raise
    `Finding` if a call of the FMU fails.
    """

    def __init__(
        self,
        folder: Path,
        description: Any,
        inputs: Sequence[tuple[Any, int]],
        outputs: Sequence[tuple[Any, int]],
        name: str,
        log: Callable[[str], None] | None = None,
    ) -> None:
        self._description, self._inputs, self._outputs = description, inputs, outputs
        self._exchange = description.coSimulation is None
        self.made = Instance(folder, description, "ModelExchange" if self._exchange else "CoSimulation", name, log)
        self._integrator: Integrator | None = None
        self._held: list[float] | None = None

    def set_parameters(self, settings: Mapping[str, Any]) -> None:
        """Set parameters by name before the initialisation. Structural parameters are set in Configuration Mode."""
        variables = {v.name: v for v in self._description.modelVariables}
        structural = {k: x for k, x in settings.items() if variables[k].causality == "structuralParameter"}
        if structural:
            self.made.call("entering Configuration Mode", "enterConfigurationMode")
            for name, value in structural.items():
                self.made.set(variables[name], [value])
            self.made.call("leaving Configuration Mode", "exitConfigurationMode")
        for name, value in settings.items():
            if name in structural:
                continue
            v = variables[name]
            if v.type == "String":
                self.made.call(f"setting {name}", "setString", [v.valueReference], [value])
            else:
                values = value if isinstance(value, list) else [value]
                self.made.set(v, [carried(v, x) for x in values])

    def start(self, t: float, u: Sequence[float], constants: Sequence[tuple[Any, Sequence[float]]] = ()) -> None:
        """Initialise the instance at the time t (s) with the inputs u and the given constant inputs."""
        self.made.initialize(t)
        for v, values in constants:
            self.made.set(v, [carried(v, x) for x in values])
        self._put(u)
        if self._exchange:
            n = int(self._description.numberOfContinuousStates or 0)
            signs = int(self._description.numberOfEventIndicators or 0)
            unit = Continuous(self.made, n, signs)
            if unit.ended:
                raise Ended(f"the FMU ends the simulation at {t:g} s")
            self._integrator = Integrator(unit, t)
        else:
            self.made.begin()
        self._held = list(u)

    def _put(self, u: Sequence[float]) -> None:
        at = 0
        for v, n in self._inputs:
            self.made.set(v, [carried(v, x) for x in u[at : at + n]])
            at += n

    def put(self, u: Sequence[float]) -> None:
        """Set all inputs. They stay constant until the next call."""
        if self._integrator is None:
            self._put(u)
        elif self._held is None or list(u) != self._held:
            self._integrator.event(lambda: self._put(u))
            self._held = list(u)

    def step(self, t: float, h: float) -> None:
        """Simulate the FMU from the time t to t + h (s)."""
        if self._integrator is not None:
            self._integrator.advance(t + h)
        elif not self.made.step(f"the step from {t:g} s", t, h):
            raise Ended(f"the FMU ends the simulation in the step from {t:g} s")

    def get(self) -> list[float]:
        """Return the values of all outputs."""
        return [x for v, n in self._outputs for x in self.made.get(v, n)]

    def save(self) -> tuple[Any, Any, Any]:
        """Return a saved copy of the present state."""
        state = self.made.call("saving the state", "getFMUState")
        return state, self._integrator and self._integrator.save(), self._held

    def restore(self, saved: tuple[Any, Any, Any]) -> None:
        """Restore a saved state."""
        state, integrator, self._held = saved
        self.made.call("restoring the state", "setFMUState", state)
        if self._integrator is not None:
            self._integrator.restore(integrator)

    def forget(self, saved: tuple[Any, Any, Any]) -> None:
        """Free a saved state."""
        self.made.call("freeing a state", "freeFMUState", saved[0])

    def close(self) -> None:
        """Free the instance."""
        self.made.free()
