"""A master for the interfaces with Event Mode: Model Exchange with simple solvers, Co-Simulation with events."""

import ctypes as C
from collections.abc import Callable
from functools import cached_property

import numpy as np
from fmu_master import OK, Array, Master
from scipy.integrate import solve_ivp

Rate = Callable[[float, Array], Array]
Solver = Callable[[Rate, float, float, Array], Array]


def euler(steps: int) -> Solver:
    """Forward Euler with `steps` steps per interval."""

    def solve(f: Rate, t: float, end: float, x: Array) -> Array:
        h = (end - t) / steps
        for k in range(steps):
            x = x + h * f(t + k * h, x)
        return x

    return solve


def runge_kutta(steps: int) -> Solver:
    """The classical Runge-Kutta method of order 4, `steps` steps per interval."""

    def solve(f: Rate, t: float, end: float, x: Array) -> Array:
        h = (end - t) / steps
        for k in range(steps):
            s = t + k * h
            k1 = f(s, x)
            k2 = f(s + h / 2, x + h / 2 * k1)
            k3 = f(s + h / 2, x + h / 2 * k2)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + f(s + h, x + h * k3))
        return x

    return solve


def adaptive(f: Rate, t: float, end: float, x: Array) -> Array:
    """The Dormand-Prince method of order 8 of scipy; it never evaluates beyond the end of the interval."""
    return np.asarray(solve_ivp(f, (t, end), x, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1])


class EventInfo(C.Structure):
    """fmi2EventInfo."""

    _fields_ = [
        ("new_states_needed", C.c_int), ("terminate", C.c_int), ("nominals_changed", C.c_int),
        ("values_changed", C.c_int), ("next_defined", C.c_int), ("next", C.c_double),
    ]  # fmt: skip


class Events(Master):
    """An instance for Model Exchange, or for Co-Simulation with Event Mode; `next` is its next time event or None."""

    next: float | None = None

    # ---- one call each -----------------------------------------------------------------------------------------------
    def update(self) -> int:
        """Update the discrete states and return the status."""
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
            assert not any(flags), "one update is sufficient, and states are continuous"
            self.next = at if defined else None
        return status

    def vector(self, name: str, n: int | None = None) -> tuple[int, Array]:
        """Call a function that fills an array, by default one number per state; return status and array."""
        values = (C.c_double * (self.n_states if n is None else n))()
        status = self.call(name, values, C.c_size_t(len(values)))
        return status, np.array(values)

    @cached_property
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
        """Set the continuous states and return the status."""
        return self.call("SetContinuousStates", (C.c_double * len(x))(*x), C.c_size_t(len(x)))

    def derivatives(self) -> Array:
        """Read the derivatives at the current time, inputs and states."""
        status, dx = self.vector("GetDerivatives" if self.fmi == 2 else "GetContinuousStateDerivatives")
        assert status == OK, self.messages[-1:]
        return dx

    def set_time(self, t: float) -> int:
        """Set the time and return the status."""
        return self.call("SetTime", C.c_double(t))

    def completed(self, asks: bool = False) -> int:
        """Accept the step and return the status; the unit asks for Event Mode, or does not."""
        flag = C.c_int if self.fmi == 2 else C.c_bool
        event, terminate = flag(1), flag(1)
        status = self.call("CompletedIntegratorStep", flag(1), C.byref(event), C.byref(terminate))
        assert (event.value, terminate.value) == (asks, 0)
        return status

    def leave(self) -> None:
        """Leave Event Mode."""
        name = "EnterContinuousTimeMode" if self.interface == "me" else "EnterStepMode"
        assert self.call(name) == OK

    # ---- runs --------------------------------------------------------------------------------------------------------
    @cached_property
    def inputs(self) -> list[tuple[str, int]]:
        """Names and sizes of the inputs."""
        return [(p.name, p.size) for p in self.graph.ports if p.kind == "input"]

    def put(self, row: Array) -> None:
        """Set all inputs."""
        at = 0
        for name, size in self.inputs:
            assert self.set(name, *map(float, row[at : at + size])) == OK
            at += size

    def outputs(self) -> list[float]:
        """Read all elements of all outputs."""
        return [x for p in self.graph.ports if p.kind == "output" for x in np.atleast_1d(self.get(p.name))]

    def event(self, row: Array) -> list[float]:
        """Handle an event with new inputs and return the outputs."""
        assert self.call("EnterEventMode") == OK
        self.put(row)
        assert self.update() == OK
        y = self.outputs()
        self.leave()
        return y

    def begin(self, row: Array, t: float = 0.0) -> list[float]:
        """Initialise with the given inputs, handle the initial event, and return the outputs."""
        assert self.enter(t) == OK
        self.put(row)
        assert self.call("ExitInitializationMode") == OK
        assert self.update() == OK
        y = self.outputs()
        self.leave()
        return y

    def integrate(self, u: Array, h: float, solver: Solver, hold: str = "end", reject: bool = False) -> Array:
        """Run Model Exchange over the rows of `u` with step `h` and return the outputs, one row each.

        `hold` says how inputs vary between rows: "end" holds the next row, as Co-Simulation does; "ramp" interpolates;
        "events" holds the last row and changes it by an event.  `reject` tries and rejects every step first.
        """
        y, x = [self.begin(u[0])], self.x
        for k in range(1, len(u)):
            t, end = (k - 1) * h, (k - 1) * h + h

            def rate(s: float, x: Array, k: int = k, t: float = t) -> Array:
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
            x = solver(rate, t, end, x) if self.n_states else x
            assert self.set_time(end) == OK
            self.put(u[k - 1] if hold == "events" else u[k])
            assert self.set_x(x) == OK
            assert self.completed() == OK
            due = self.next is not None and end >= self.next - 1e-9 * h
            y.append(self.event(u[k]) if due or hold == "events" else self.outputs())
        return np.array(y)
