"""A master for the interfaces with Event Mode: Model Exchange with solvers of our own, Co-Simulation with events."""

from __future__ import annotations

import ctypes as C
from collections.abc import Callable

import numpy as np
from fmu_master import OK, Array, Master
from scipy.integrate import solve_ivp

Slope = Callable[[float, Array], Array]
Solver = Callable[[Slope, float, float, Array], Array]


def euler(steps: int) -> Solver:
    """Forward Euler, `steps` of them in an interval."""

    def solve(f: Slope, t: float, end: float, x: Array) -> Array:
        h = (end - t) / steps
        for k in range(steps):
            x = x + h * f(t + k * h, x)
        return x

    return solve


def runge_kutta(steps: int) -> Solver:
    """The classical Runge-Kutta method of order 4."""

    def solve(f: Slope, t: float, end: float, x: Array) -> Array:
        h = (end - t) / steps
        for k in range(steps):
            s = t + k * h
            k1 = f(s, x)
            k2 = f(s + h / 2, x + h / 2 * k1)
            k3 = f(s + h / 2, x + h / 2 * k2)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + f(s + h, x + h * k3))
        return x

    return solve


def adaptive(f: Slope, t: float, end: float, x: Array) -> Array:
    """scipy's Dormand-Prince method of order 8; it never looks past the end of the interval."""
    return np.asarray(solve_ivp(f, (t, end), x, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1])


class EventInfo(C.Structure):
    """fmi2EventInfo."""

    _fields_ = [
        ("new_states_needed", C.c_int),
        ("terminate", C.c_int),
        ("nominals_changed", C.c_int),
        ("values_changed", C.c_int),
        ("next_defined", C.c_int),
        ("next", C.c_double),
    ]


class Events(Master):
    """An instance for Model Exchange, or for Co-Simulation with Event Mode; `next` is its next time event or None."""

    next: float | None = None

    # ---- one call each -----------------------------------------------------------------------------------------------
    def update(self) -> int:
        """The event happens; the status."""
        if self.fmi == 2:
            info = EventInfo()
            status = self.call("NewDiscreteStates", C.byref(info))
            flags, defined, at = [info.new_states_needed, info.terminate], info.next_defined, info.next
        else:
            words = [C.c_bool() for _ in range(5)]
            time = C.c_double()
            status = self.call("UpdateDiscreteStates", *map(C.byref, words), C.byref(time))
            flags, defined, at = [w.value for w in words[:4]], words[4].value, time.value
        if status == OK:
            assert not any(flags), "one event is enough, and states never jump"
            self.next = at if defined else None
        return status

    def vector(self, name: str, n: int | None = None) -> tuple[int, Array]:
        """Status and result of a call that fills an array; as long as there are states by default."""
        values = (C.c_double * (self.n_states if n is None else n))()
        status = self.call(name, values, C.c_size_t(len(values)))
        return status, np.array(values)

    @property
    def n_states(self) -> int:
        """Number of continuous states."""
        return len(self.graph.continuous_states)

    @property
    def x(self) -> Array:
        """The continuous states."""
        status, x = self.vector("GetContinuousStates")
        assert status == OK
        return x

    def set_x(self, x: Array) -> int:
        """Status of setting them."""
        return self.call("SetContinuousStates", (C.c_double * len(x))(*x), C.c_size_t(len(x)))

    def derivatives(self) -> Array:
        """What they are at the present time, inputs and states."""
        status, dx = self.vector("GetDerivatives" if self.fmi == 2 else "GetContinuousStateDerivatives")
        assert status == OK, self.messages[-1:]
        return dx

    def set_time(self, t: float) -> int:
        """Status of a new time."""
        return self.call("SetTime", C.c_double(t))

    def completed(self) -> int:
        """The step is accepted; the status."""
        flag = C.c_int if self.fmi == 2 else C.c_bool
        event, terminate = flag(1), flag(1)
        status = self.call("CompletedIntegratorStep", flag(1), C.byref(event), C.byref(terminate))
        assert (event.value, terminate.value) == (0, 0)
        return status

    def leave(self) -> None:
        """Out of Event Mode."""
        name = "EnterContinuousTimeMode" if self.interface == "me" else "EnterStepMode"
        assert self.call(name) == OK

    # ---- runs --------------------------------------------------------------------------------------------------------
    def put(self, row: Array) -> None:
        """All inputs."""
        at = 0
        for p in self.graph.ports:
            if p.kind == "input":
                assert self.set(p.name, *map(float, row[at : at + p.size])) == OK
                at += p.size

    def outputs(self) -> list[float]:
        """All outputs, element by element."""
        return [x for p in self.graph.ports if p.kind == "output" for x in np.atleast_1d(self.get(p.name))]

    def event(self, row: Array) -> list[float]:
        """An event at which the inputs take new values; the outputs."""
        assert self.call("EnterEventMode") == OK
        self.put(row)
        assert self.update() == OK
        y = self.outputs()
        self.leave()
        return y

    def begin(self, row: Array, t: float = 0.0) -> list[float]:
        """Initialisation with these inputs and the event after it; the outputs."""
        assert self.enter(t) == OK
        self.put(row)
        assert self.call("ExitInitializationMode") == OK
        assert self.update() == OK
        y = self.outputs()
        self.leave()
        return y

    def integrate(self, u: Array, h: float, solver: Solver, hold: str = "end", reject: bool = False) -> Array:
        """Model Exchange over the rows of `u`, `h` apart: outputs, a row each.

        `hold`: what the inputs are between two rows.  "end": the next row, as in Co-Simulation; "ramp": a line;
        "events": the last row, changed by an event.  `reject`: every step is tried first with other inputs.
        """
        y, x = [self.begin(u[0])], self.x
        for k in range(1, len(u)):
            t, end = (k - 1) * h, (k - 1) * h + h

            def slope(s: float, x: Array, k: int = k, t: float = t) -> Array:
                share = (s - t) / h
                row = {"end": u[k], "ramp": u[k - 1] + share * (u[k] - u[k - 1]), "events": u[k - 1]}[hold]
                assert self.set_time(s) == OK
                self.put(row)
                assert self.set_x(x) == OK
                return self.derivatives()

            if reject:
                self.put(-3 * u[k])
                self.set_time(end)
                self.outputs()
            x = solver(slope, t, end, x) if self.n_states else x
            assert self.set_time(end) == OK
            self.put(u[k - 1] if hold == "events" else u[k])
            assert self.set_x(x) == OK
            assert self.completed() == OK
            due = self.next is not None and end >= self.next - 1e-9 * h
            y.append(self.event(u[k]) if due or hold == "events" else self.outputs())
        return np.array(y)
