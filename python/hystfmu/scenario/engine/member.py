"""Common parts of all FMUs in a run: connections to inputs, substeps, first-order hold, order of calls.

The first-order hold is a straight line through the last two values of a source. If the source precedes the unit with
the hold in the order, the line interpolates. If the source follows this unit, the line extrapolates.
"""

from __future__ import annotations

import ctypes as C
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, Protocol

from hystfmu.graph.node import Port
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.foreign import ForeignPort
from hystfmu.scenario.system.system import Link, Part, System


def weights(system: System, links: Sequence[Link]) -> list[float]:
    """Return for each connection the time of the newest value of the source within the step of the connected unit.

    The time is a fraction of the step: 0 is the start of the step, and 1 is the end.

    If the source follows the connected unit in the order, the value is older than the end of the step by one step of
    the source.
    """
    late = [system.maker(link).period / system.parts[link.to].period for link in links]
    return [1.0 if system.fresh(link) else 1.0 - part for link, part in zip(links, late, strict=True)]


class Lines:
    """First-order hold of the inputs of a unit.

    `sources` contains the indices of the connected values in `values`. `ahead` is the result of `weights`. `substeps`
    is the number of substeps in a step of the unit.
    """

    def __init__(
        self, sources: Sequence[int], ahead: Sequence[float], substeps: int, values: C.Array[C.c_double]
    ) -> None:
        self._sources, self._ahead, self._substeps, self._values = sources, ahead, substeps, values

    def begin(self) -> None:
        """Make the first lines constant, with the first outputs of the sources."""
        self._now = self._before = [self._values[j] for j in self._sources]
        self._anew = False

    def cut(self) -> None:
        """Make the next line constant, because the length of the step changes."""
        self._anew = True

    def save(self) -> None:
        """Save the present lines, for `restore`."""
        self._saved = self._now, self._before, self._anew

    def restore(self) -> None:
        """Restore the lines of the last `save`."""
        self._now, self._before, self._anew = self._saved

    def take(self) -> None:
        """Compute the next lines: from the last values of the sources to the newest values."""
        now = [self._values[j] for j in self._sources]
        self._before, self._now = now if self._anew else self._now, now
        self._anew = False

    def at(self, i: int) -> list[float]:
        """Return the inputs at the end of substep i."""
        end = (i + 1) / self._substeps
        both = zip(self._now, self._before, self._ahead, strict=True)
        return [now + (now - before) * (end - ahead) for now, before, ahead in both]


class Member(Protocol):
    """Interface of a unit for the master.

    The unit reads its inputs from the values of the system, and writes its outputs into these values.
    """

    period: int
    """Number of fine steps between two calls."""
    name: str
    sources: list[int]
    """Index of the value that each input reads; -1 for a constant."""
    any_step: bool
    """True if `stretch` may be called."""
    turn: Sequence[Callable[[], int]]
    """`copy`, `advance`, `take` as a list of calls; a status above 1 is a failure."""

    def start(self, t0: float) -> None:
        """Initialise at `t0` with the present values and write the first outputs."""

    def stopped(self) -> Stopped:
        """Return the reason why the last call failed."""

    def begin(self) -> None:
        """Begin the run, after all units are initialised."""

    def stretch(self, h: float | None) -> None:
        """Set the length of the following steps (s). None restores the nominal step."""

    def copy(self) -> None:
        """Copy the inputs from the values of the system."""

    def advance(self) -> None:
        """Make one step from the present time of the unit."""

    def take(self) -> None:
        """Copy the outputs to the values of the system."""

    def save(self) -> None:
        """Save the present state."""

    def restore(self) -> None:
        """Restore the state that was saved last."""

    def close(self) -> None:
        """Free the resources of the unit."""


def whole_turn(member: Member) -> int:
    """Set the inputs of a unit, make a step and get the outputs. Return 0, the status of success.

    An exception is raised if a call fails.
    """
    member.copy()
    member.advance()
    member.take()
    return 0


Slot = tuple[str, tuple[str, ...]]


def slots(port: Port | ForeignPort, fmi: int) -> list[Slot]:
    """Return the name and the names of the elements of each variable that a port needs in an FMU of version `fmi`."""
    return [(port.name, port.scalar_names)] if fmi == 3 else [(n, (n,)) for n in port.scalar_names]


def _window(values: C.Array[C.c_double], first: int, n: int) -> C.Array[C.c_double]:
    return (C.c_double * n).from_buffer(values, 8 * first)


def _nothing() -> int:
    return 0


@dataclass(frozen=True)
class Calls:
    """Function pointers of an FMU: set, step and get; if the engine needs them, save, restore and tangent.

    `source` contains one index for every element of the inputs: the index of the connected value, or -1. With -1, the
    element has the constant value in `inputs`.
    """

    fmi3: bool
    functions: list[int | None]
    tangent: int | None
    component: int
    source: list[int]
    inputs: list[float]
    vr_in: Any
    vr_out: Any
    rollback: bool


class SteppedMember(ABC):
    """An FMU with its inputs and outputs. A subclass defines the calls of the FMU.

    `y` is the part of the values of the system for the outputs of the FMU. `linked` contains the inputs that are set in
    every step. `fixed` contains the inputs that are set once.
    """

    def __init__(
        self,
        system: System,
        part: Part,
        sources: Sequence[tuple[int, int]],
        values: C.Array[C.c_double],
        clock: C.c_double,
        fmi: Literal[1, 2, 3],
    ) -> None:
        self.name, self.period, self._graph, self._substeps = part.name, part.period, part.graph, part.substeps
        self.any_step, self._length = part.any_step, system.length(part)
        self._h = C.c_double(self._length / part.substeps)
        self._fmi, self._t = fmi, clock
        self._said: list[str] = []  # log messages of the FMU, which the verdict shows instead of the terminal
        # Connected inputs are set in every step, constant inputs once. An array of FMI 3.0 has one reference for all
        # # elements and is set as a whole; its values are contiguous, as in the values of the system.
        ports = {k: [p for p in part.graph.ports if p.kind == k] for k in ("input", "output")}
        source = {part.inputs[i]: j for i, j in sources}
        inputs = [slot for p in ports["input"] for slot in slots(p, fmi)]
        self.linked = [slot for slot in inputs if any(n in source for n in slot[1])]
        self.fixed = [slot for slot in inputs if slot not in self.linked]
        self.read_back = [slot for p in ports["output"] for slot in slots(p, fmi)]
        read = [n for _, names in self.linked for n in names]
        self._u, self._values = (C.c_double * len(read))(*[part.constants.get(n, 0.0) for n in read]), values
        self._copies = [(k, source[n]) for k, n in enumerate(read) if n in source]
        links = {link.source: link for link in system.links if link.to == system.parts.index(part)}
        places = [j for _, j in self._copies]
        self._lines: Lines | None = None
        if part.hold == "first":
            self._lines = Lines(places, weights(system, [links[j] for j in places]), part.substeps, values)
        elif len(read) == 1:  # this input uses the output buffer of its source without a copy
            self._u, self._copies = _window(values, source[read[0]], 1), []
        self._y = _window(values, part.first, len(part.outputs))
        self.sources = [source.get(n, -1) for n in read]
        # iterative coupling restores the states before the present point
        self._rollback = system.case.coupling.scheme == "iterative"

    def _call(self, part: Part, put: Callable[[], int], do: Callable[[], int], get: Callable[[], int]) -> None:
        """Store the calls that set the inputs, make a step and get the outputs. A status above 1 is a failure."""
        self._put, self._do = put if len(self._u) else _nothing, do
        self._get = get if part.outputs else _nothing
        self.turn: Sequence[Callable[[], int]] = [partial(whole_turn, self)]
        if part.substeps > 1 or self._lines is not None:
            return
        wanted: list[tuple[object, Callable[[], int]]] = [(self._copies, self._copy), (len(self._u), put), (do, do)]
        wanted.append((part.outputs, get))
        self.turn = [call for needed, call in wanted if needed]

    def _copy(self) -> int:
        u, values = self._u, self._values
        for i, j in self._copies:
            u[i] = values[j]
        return 0

    def begin(self) -> None:
        if self._lines is not None:
            self._lines.begin()

    def stretch(self, h: float | None) -> None:
        self._h.value = (self._length if h is None else h) / self._substeps
        if self._lines is not None:
            self._lines.cut()

    def copy(self) -> None:
        if self._lines is not None:
            self._lines.take()
            return
        self._copy()
        if self._put() > 1:
            raise self.stopped()

    def advance(self) -> None:
        begin = self._t.value  # all units with this period share this time
        for i in range(self._substeps):
            if self._lines is not None:
                for (k, _), value in zip(self._copies, self._lines.at(i), strict=True):
                    self._u[k] = value
            self._t.value = begin + i * self._h.value
            if (self._lines is not None and self._put() > 1) or self._do() > 1:
                raise self.stopped()
        self._t.value = begin

    def take(self) -> None:
        if self._get() > 1:
            raise self.stopped()

    @property
    def said(self) -> str:
        """Last log message of the FMU."""
        return self._said[-1] if self._said else "without a word"

    def stopped(self) -> Stopped:
        why = self._said[-1] if self._said else f"inputs {list(self._u)}"
        return Stopped(f"{self.name} refuses the step from t = {self._t.value:g} s: {why}")

    @abstractmethod
    def start(self, t0: float) -> None:
        """Initialise at `t0` (s) with the present values and write the first outputs."""

    @abstractmethod
    def save(self) -> None:
        """Save the present state."""

    @abstractmethod
    def restore(self) -> None:
        """Restore the state that was saved last."""

    @abstractmethod
    def close(self) -> None:
        """Free the resources of the FMU."""

    @abstractmethod
    def calls(self) -> Calls:
        """Return the function pointers and data for the master in C."""

    @abstractmethod
    def free_state(self, state: int) -> None:
        """Free a state that the master in C saved."""
