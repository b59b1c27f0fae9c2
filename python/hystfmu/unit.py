"""Co-simulation unit in Python, with the variables and functions of an exported FMU and bit-identical results."""

from __future__ import annotations

import math

import numpy as np

from hystfmu.base import Array, InputError, checked
from hystfmu.graph import Graph, Port
from hystfmu.graph.graph import sample_time, samples_in


@checked
class Unit:
    """One instance of a graph, which a master simulates step by step.

    Parameters
    ----------
    graph : Graph
        Graph of the unit, e.g. ``Model.load(path).graph``.

    Raises
    ------
    InputError
        The C core refuses the graph.

    Examples
    --------
    >>> import hystfmu as hy
    >>> unit = hy.Unit(hy.blocks.Creep(w=[1.0], T=[0.5]).graph)
    >>> unit
    Unit(u -> y, not initialized)
    >>> unit.initialize(t0=0.0, u=1.5)
    >>> unit.set("u", 2.0)
    >>> unit.do_step(0.0, 1e-3)
    >>> 0.0 < unit.get("y") < 2.0
    True
    """

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self._executor = graph.executor()
        self._names: dict[str, tuple[Port, int]] = {
            name: (p, p.reference + i) for p in graph.ports for i, name in enumerate(p.scalar_names)
        }
        self._outputs = {name: k for name, (p, k) in self._names.items() if p.kind == "output"}
        self._parameters = [
            (p.reference, self._executor.view(p.reference, p.size)) for p in graph.ports if p.is_parameter
        ]
        self._period = sample_time(graph)
        self._initialized = False
        self._start = 0.0

    def __repr__(self) -> str:
        sides = (", ".join(p.name for p in self.graph.ports if p.kind == kind) for kind in ("input", "output"))
        return f"Unit({' -> '.join(sides)}, {'' if self._initialized else 'not '}initialized)"

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the scalar variables, as in the FMI 2.0 model description: `u`, `y`, `w_1`, ..."""
        return tuple(self._names)

    def _find(self, name: str) -> tuple[Port, int]:
        if name not in self._names:
            raise InputError(f"The variable must be one of {list(self._names)[:20]}. Got {name!r} instead.")
        return self._names[name]

    def set(self, name: str, value: float) -> None:
        """Set an input or a parameter. A fixed parameter can be set only before `initialize`.

        Parameters
        ----------
        name : str
            Name of the scalar variable, one of `variables`.
        value : float
            Value in the unit of measure of the variable.

        Raises
        ------
        InputError
            The variable is unknown or an output, the value is out of range, or a fixed parameter is set after
            `initialize`.
        """
        port, reference = self._find(name)
        if port.kind == "output":
            raise InputError(f"The variable to set must be an input or a parameter. Got {name!r}, which is an output.")
        if port.kind == "fixed" and self._initialized:
            raise InputError(f"The fixed parameter {name!r} must be set before initialize(). Got it afterwards.")
        self._executor.set(reference, value)

    def get(self, name: str) -> float:
        """Return the present value of the scalar variable `name`, in its unit of measure.

        Raises
        ------
        InputError
            The variable is unknown.
        """
        return self._executor.get(self._find(name)[1])

    def initialize(self, t0: float = 0.0, **inputs: float) -> None:
        """Initialise the unit at the time `t0` (s) with the given inputs, and compute the outputs at this time.

        Raises
        ------
        InputError
            The time is not finite, or `set` refuses an input.
        """
        if not math.isfinite(t0):
            raise InputError(f"The start time must be finite. Got {t0} instead.")
        for name, value in inputs.items():
            self.set(name, value)
        self._executor.start(t0)
        self._start = t0
        self._initialized = True

    def do_step(self, t: float, h: float) -> None:
        """Simulate one step of the length `h` (s) from the time `t` (s). The present inputs are constant in the step.

        If the model has a sample time, all samples within the step are computed, like in the FMU of the model.

        Raises
        ------
        InputError
            The unit is not initialised, the step is not finite and positive, the step is not a multiple of the sample
            time, the C core refuses the step, or an output is not finite after the step.
        """
        if not self._initialized:
            raise InputError("The unit must be initialized before a step. Got do_step() before initialize().")
        if not (np.isfinite(t) and np.isfinite(h) and h > 0):
            raise InputError(f"The step must be finite and greater than 0. Got t = {t}, h = {h} instead.")
        n = 1 if self._period is None else samples_in(self._period, t, h)
        length = h if self._period is None else self._period  # the exact length, without rounding errors of the times
        for k in range(n):
            begin, rest = t + k * length, length if k + 1 < n else h - k * length
            self._executor.step(self._executor.end_of_step(self._start, begin, rest), length)
        for name, reference in self._outputs.items():  # the FMU returns an error with the same text
            if not math.isfinite(value := self._executor.get(reference)):
                raise InputError(f"{name!r} is {'NaN' if math.isnan(value) else 'infinite'} at t = {t + h:g} s.")

    def tangent(self, t: float, du: Array) -> Array:
        """Return the exact tangent of the outputs for the present inputs. At a kink, the tangent is one-sided.

        Parameters
        ----------
        t : float
            End time of the last step (s).
        du : array, shape (n_inputs,)
            Direction (seeds), in the order of the scalar inputs.

        Returns
        -------
        array, shape (n_outputs,)
            Tangent of the outputs.

        Raises
        ------
        InputError
            `du` has a wrong shape.
        """
        n_inputs, n = (sum(p.size for p in self.graph.ports if p.kind == kind) for kind in ("input", "output"))
        seeds = np.array(du, dtype=np.float64)
        if seeds.shape != (n_inputs,):
            raise InputError(f"The seeds of a tangent must have shape ({n_inputs},). Got {seeds.shape} instead.")
        return self._executor.tangent_between(t, seeds, n)

    def reset(self) -> None:
        """Set all parameters and inputs to the values of the model. Afterwards, the unit must be initialised again."""
        self._executor.defaults()
        self._initialized = False

    @property
    def state(self) -> Array:
        """Copy of the complete state and the parameters, shape (n,). Assigning such a copy restores both."""
        return np.concatenate([self._executor.state, *(held for _, held in self._parameters)])

    @state.setter
    def state(self, value: Array) -> None:
        at = len(value) - sum(len(held) for _, held in self._parameters)
        self._executor.state = value[:at]
        for reference, held in self._parameters:
            for k in np.flatnonzero(held != value[at : at + len(held)]).tolist():
                self._executor.set(reference + k, value[at + k])
            at += len(held)
