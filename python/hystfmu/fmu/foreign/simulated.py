"""A common numeric interface (set, step, get) to FMUs of any version, interface and variable types."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hystfmu.fmu.foreign.exchange import Continuous, Integrator
from hystfmu.fmu.foreign.instance import Ended, Instance, carried


class Simulated:
    """One instance in Co-Simulation, or in Model Exchange with an integrator if the FMU has no Co-Simulation.

    Parameters
    ----------
    folder : Path
        Folder of the unpacked FMU.
    description : ModelDescription
        Read by fmpy.
    inputs, outputs : sequence of (variable, int)
        Variables to set and read, with the number of elements of each.
    name : str
    log : callable, optional
        Function that takes each log message.

    Raises
    ------
    Finding
        As in `Instance`; all methods raise it, too.
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
        """Set parameters by name before initialization; structural parameters are set in Configuration Mode."""
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
        """Initialize at t (s) with the inputs u and the given constant inputs."""
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
        """Set all inputs; the instance holds them until the next call."""
        if self._integrator is None:
            self._put(u)
        elif self._held is None or list(u) != self._held:
            self._integrator.inputs(lambda: self._put(u))
            self._held = list(u)

    def step(self, t: float, h: float) -> None:
        """Advance from t to t + h (s)."""
        if self._integrator is not None:
            self._integrator.advance(t + h)
        elif not self.made.step(f"the step from {t:g} s", t, h):
            raise Ended(f"the FMU ends the simulation in the step from {t:g} s")

    def get(self) -> list[float]:
        """Return all outputs."""
        return [x for v, n in self._outputs for x in self.made.get(v, n)]

    def save(self) -> tuple[Any, Any, Any]:
        """Save the present state."""
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
