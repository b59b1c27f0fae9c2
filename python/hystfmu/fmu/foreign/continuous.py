"""An instance in Continuous-Time Mode (FMI 1.0 to 3.0): states, derivatives, indicators and events."""

from __future__ import annotations

import ctypes as C
import math
from collections.abc import Callable

from hystfmu.fmu.foreign.finding import Finding
from hystfmu.fmu.foreign.instance import Instance

_MOST_EVENTS = 100  # iterations of an event
_NAMES = {
    1: ("getDerivatives", "eventUpdate", "getNominalContinuousStates"),
    2: ("getDerivatives", "newDiscreteStates", "getNominalsOfContinuousStates"),
    3: ("getContinuousStateDerivatives", "updateDiscreteStates", "getNominalsOfContinuousStates"),
}


class Continuous:
    """An instance that leaves Initialization Mode and enters Continuous-Time Mode.

    Parameters
    ----------
    made : Instance
        In Initialization Mode.
    n, signs : int
        Numbers of continuous states and of event indicators in the model description.  FMI 3.0 asks the binary, because
        structural parameters change them.

    Attributes
    ----------
    next : float
        Time of the next time event (s); infinite if none is announced.
    ended : bool
        Whether the FMU has ended the simulation.
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
        """Update the discrete states until the event iteration ends, and enter Continuous-Time Mode."""
        first = self.made.version == 1
        for _ in range(_MOST_EVENTS):
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
            raise Finding(f"the event iteration does not end: {_MOST_EVENTS} updates each ask for another one")
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
        """Accept the step that ends at the present time; return whether the FMU asks for Event Mode."""
        if self.made.version == 1:
            return bool(self.made.call("accepting a step", "completedIntegratorStep"))
        asked, ended = self.made.call("accepting a step", "completedIntegratorStep")
        self.ended = self.ended or ended
        return bool(asked)

    def event(self, put: Callable[[], None] | None = None) -> None:
        """Handle an event at the present time; `put` sets discrete inputs in Event Mode."""
        if self.made.version > 1:
            self.made.call("entering Event Mode", "enterEventMode")
        if put is not None:
            put()
        self._update()
