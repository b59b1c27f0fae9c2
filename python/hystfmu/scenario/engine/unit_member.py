"""A Python unit as a member of a run, in the place of an FMU."""

from __future__ import annotations

import ctypes as C
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.scenario.engine.hold import Lines, weights
from hystfmu.scenario.engine.member import whole_turn
from hystfmu.scenario.engine.memory import mark
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.system import Part, System
from hystfmu.unit import Unit


class UnitMember:
    """One Python unit in the place of an FMU."""

    def __init__(
        self,
        system: System,
        part: Part,
        sources: Sequence[tuple[int, int]],
        values: C.Array[C.c_double],
        clock: C.c_double,
    ) -> None:
        self.name, self.period = part.name, part.period
        self.any_step, self._length = part.any_step, system.length(part)
        self._h, self._substeps = self._length / part.substeps, part.substeps
        self._graph, self._unit = part.own, Unit(part.own)
        self._constants, self._values, self._t = part.constants, values, clock
        self.turn: Sequence[Callable[[], int]] = [partial(whole_turn, self)]
        links = [link for link in system.links if link.to == system.parts.index(part)]
        self._lines = Lines([j for _, j in sources], weights(system, links), part.substeps, values)
        self._straight = part.hold == "first"
        self.sources = [j for _, j in sources]
        self._elements, self._n_inputs = [i for i, _ in sources], len(part.inputs)
        self._inputs = [(part.inputs[i], j) for i, j in sources]
        self._outputs = [(part.first + i, n) for i, n in enumerate(part.outputs)]

    def start(self, t0: float) -> None:
        for name, value in self._constants.items():
            self._unit.set(name, value)
        self._set([self._values[j] for _, j in self._inputs])
        self._unit.initialize(t0)
        self.take()

    def stopped(self) -> Stopped:
        return Stopped(f"{self.name} refuses the step from t = {self._t.value:g} s")

    def begin(self) -> None:
        self._lines.begin()

    def stretch(self, h: float | None) -> None:
        self._h = (self._length if h is None else h) / self._substeps
        self._lines.cut()

    def copy(self) -> None:
        if self._straight:
            self._lines.take()
        else:
            self._set([self._values[j] for _, j in self._inputs])

    def _set(self, inputs: Sequence[float]) -> None:
        try:
            for (name, _), value in zip(self._inputs, inputs, strict=True):
                self._unit.set(name, value)
        except InputError as e:
            raise Stopped(f"{self.name} refuses its inputs: {e}") from None

    def advance(self) -> None:
        try:
            for i in range(self._substeps):
                if self._straight:
                    self._set(self._lines.at(i))
                begin = self._t.value + i * self._h
                self._unit.do_step(begin, self._h)
                self._end = begin + self._h
        except InputError as e:
            raise Stopped(f"{self.stopped()}: {e}") from None

    def take(self) -> None:
        for j, name in self._outputs:
            self._values[j] = self._unit.get(name)

    def save(self) -> None:
        self._state = self._unit.state
        self._lines.save()

    def restore(self) -> None:
        self._unit.state = self._state
        self._lines.restore()

    def slope(self, du: list[float]) -> list[float] | None:
        seeds = np.zeros(self._n_inputs)
        seeds[self._elements] = du
        dy = self._unit.tangent(self._end, seeds)
        return dy.tolist() if np.isfinite(dy).all() else None

    def memory(self) -> str:
        return mark(self._graph, self._unit.state)

    def close(self) -> None: ...
