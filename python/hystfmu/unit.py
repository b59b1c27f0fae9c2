"""The Python co-simulation unit: the same ports, calls and bits as an exported FMU, without an archive.

unit = Unit(model.graph)
unit.initialize(t0=0.0, u=1.5)
unit.set("u", 2.0); unit.do_step(0.0, 1e-3); y = unit.get("y")
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Port


class Unit:
    """One instance of a graph, stepped by a master.

    Parameters
    ----------
    graph : Graph
        What runs; e.g. ``Model.load(path).graph``.

    Raises
    ------
    InputError
        Unknown variable, value out of range, step that is not positive and finite.
    """

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self._executor = graph.executor()
        self._names: dict[str, tuple[Port, int]] = {
            name: (p, p.reference + i) for p in graph.ports for i, name in enumerate(p.scalar_names)
        }
        self._initialized = False

    @property
    def variables(self) -> tuple[str, ...]:
        """Scalar variable names, as in an FMI 2.0 description: `u`, `y`, `w_1`, ..."""
        return tuple(self._names)

    def _find(self, name: str) -> tuple[Port, int]:
        if name not in self._names:
            raise InputError(f"no variable {name!r}; there are {', '.join(list(self._names)[:20])}")
        return self._names[name]

    def set(self, name: str, value: float) -> None:
        """Set the variable `name`, an input or a parameter, to `value`; a fixed parameter only before `initialize`.

        Raises
        ------
        InputError
            No such variable, an output, a fixed parameter after `initialize`, a value out of range.
        """
        port, reference = self._find(name)
        if port.kind == "output":
            raise InputError(f"{name!r} is an output and cannot be set")
        if port.kind == "fixed" and self._initialized:
            raise InputError(f"{name!r} is fixed: set it before initialize()")
        self._executor.set(reference, value)

    def get(self, name: str) -> float:
        """The present value of the variable `name`.

        Raises
        ------
        InputError
            No such variable.
        """
        return self._executor.get(self._find(name)[1])

    def initialize(self, t0: float = 0.0, **inputs: float) -> None:
        """Initialise at `t0` (s) with the given inputs; the outputs are then those at `t0`."""
        for name, value in inputs.items():
            self.set(name, value)
        self._executor.start(t0)
        self._initialized = True

    def do_step(self, t: float, h: float) -> None:
        """Advance from `t` by `h` (s) with the present inputs held to the end of the step.

        Raises
        ------
        InputError
            Not initialised; a step that is not finite or not greater than 0; a step that the core refuses.
        """
        if not self._initialized:
            raise InputError("do_step() before initialize()")
        if not (np.isfinite(t) and np.isfinite(h) and h > 0):
            raise InputError(f"the step must be finite and greater than 0; got t = {t}, h = {h}")
        self._executor.step(t + h, h)

    def slopes(self, t: float, du: Array) -> Array:
        """Directional derivative of the outputs at time `t` for the present inputs: exact, one-sided at corners.

        Parameters
        ----------
        t : float
            End of the last step (s).
        du : array, shape (number of inputs,)
            Seeds, in the order of the scalar inputs.

        Returns
        -------
        array, shape (number of outputs,)
        """
        n = sum(p.size for p in self.graph.ports if p.kind == "output")
        return self._executor.slopes(t, du, n)

    def reset(self) -> None:
        """As new: parameters and inputs as in the model, not initialised."""
        self._executor.defaults()
        self._initialized = False

    @property
    def state(self) -> Array:
        """A copy of all memory, flat (n,); assign it to go back to that point."""
        return self._executor.state

    @state.setter
    def state(self, value: Array) -> None:
        self._executor.state = value
