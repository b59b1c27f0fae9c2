"""An FMU as a member of a run, called through fmpy: bound functions, buffers that live as long as the run.

An output buffer of a member is a window into the values of the system, an input costs one copy, and the functions of
the binary are called without a wrapper in between.
"""

from __future__ import annotations

import ctypes as C
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np

from hystfmu.graph.ports import Port
from hystfmu.scenario.engine.final_states import n_saved, state_hash
from hystfmu.scenario.engine.fmu_store import FmuStore
from hystfmu.scenario.engine.hold import Lines, weights
from hystfmu.scenario.engine.member import whole_turn
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.foreign import Foreign, ForeignPort
from hystfmu.scenario.system.system import Part, System


def _window(values: C.Array[C.c_double], first: int, n: int) -> C.Array[C.c_double]:
    return (C.c_double * n).from_buffer(values, 8 * first)


def _slots(port: Port | ForeignPort, fmi: int) -> list[tuple[str, tuple[str, ...]]]:
    """The variables of an FMU that a port is, each with the names of its elements."""
    return [(port.name, port.scalar_names)] if fmi == 3 else [(n, (n,)) for n in port.scalar_names]


def _references(values: Sequence[int]) -> C.Array[C.c_uint32]:
    return (C.c_uint32 * len(values))(*values)


def _callbacks(log: Callable[..., None]) -> Any:
    """FMI 2.0 callbacks that hand log messages to `log`."""
    from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(log)
    callbacks.allocateMemory = defaultCallbacks.allocateMemory
    callbacks.freeMemory = defaultCallbacks.freeMemory
    return callbacks


def _size(values: C.Array[Any]) -> Any:
    return C.c_size_t.from_param(len(values))


def _nothing() -> int:
    return 0


@dataclass(frozen=True)
class Calls:
    """Function pointers of an FMU: set, step, get; save and restore where states are needed; tangent in a loop.

    `source` says for every element of its inputs which value it reads; -1: it keeps what stands in `inputs`.
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


class FmuMember:
    """One FMU, called through fmpy's loaded library with buffers that live as long as the run."""

    def __init__(
        self,
        system: System,
        part: Part,
        sources: Sequence[tuple[int, int]],
        values: C.Array[C.c_double],
        store: FmuStore | None,
        clock: C.c_double,
    ) -> None:
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        fmi: Literal[2, 3] = 2 if part.runs_as == "fmu2" else 3
        if isinstance(part.graph, Foreign):
            folder, description = part.graph.folder, part.graph.description
        else:
            assert store is not None
            folder, description = store.get(part.graph, fmi)
        can_go_back = description.coSimulation.canGetAndSetFMUstate
        if system.case.coupling.scheme == "iterative" and not can_go_back:
            raise Stopped(f"{part.name}: iterative coupling needs an FMU that can get and set its state")
        self.name, self.period, self._graph, self._substeps = part.name, part.period, part.graph, part.substeps
        self.any_step, self._length = part.any_step, system.length(part)
        self._h = C.c_double(self._length / part.substeps)
        kind = FMU2Slave if fmi == 2 else FMU3Slave
        self._fmi = fmi
        self._fmu = kind(
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName=part.name,
        )
        self._state: Any = None
        self._said: list[str] = []  # what the FMU logs belongs into the verdict, not onto the terminal
        if fmi == 2:
            self._fmu.instantiate(callbacks=_callbacks(lambda _c, _n, _s, _k, m: self._said.append(m.decode())))
        else:
            self._fmu.instantiate(logMessage=lambda _e, _s, _k, m: self._said.append(m.decode()))
        reference = {v.name: v.valueReference for v in description.modelVariables}
        if isinstance(part.graph, Foreign):
            self._apply(part.graph)
        # What is connected is set in every step, what is constant once.  FMI 3.0 has arrays: one reference for all the
        # elements, set as a whole; their values lie side by side as ours do.
        ports = {k: [p for p in part.graph.ports if p.kind == k] for k in ("input", "output")}
        source = {part.inputs[i]: j for i, j in sources}
        slots = [slot for p in ports["input"] for slot in _slots(p, fmi)]
        linked = [slot for slot in slots if any(n in source for n in slot[1])]
        fixed = [slot for slot in slots if slot not in linked]
        self._constants = [(reference[name], [part.constants[n] for n in names]) for name, names in fixed]
        read = [n for _, names in linked for n in names]
        self._u, self._values = (C.c_double * len(read))(*[part.constants.get(n, 0.0) for n in read]), values
        self._copies = [(k, source[n]) for k, n in enumerate(read) if n in source]
        links = {link.source: link for link in system.links if link.to == system.parts.index(part)}
        places = [j for _, j in self._copies]
        self._lines: Lines | None = None
        if part.hold == "first":
            self._lines = Lines(places, weights(system, [links[j] for j in places]), part.substeps, values)
        elif len(read) == 1:  # reads the output of its source where it stands
            self._u, self._copies = _window(values, source[read[0]], 1), []
        vr_in = _references([reference[name] for name, _ in linked])
        vr_out = _references([reference[name] for p in ports["output"] for name, _ in _slots(p, fmi)])
        self._t, y = clock, _window(values, part.first, len(part.outputs))
        forward = system.case.coupling.scheme != "iterative"  # no state before the present point will be restored
        # Called without the argument types that fmpy declares: the arguments are converted once, here (a third faster).
        # Ours never wait and never call Python from another thread: the lock of the interpreter stays (a fifth faster).
        dll = self._fmu.dll if isinstance(part.graph, Foreign) else C.PyDLL(None, handle=self._fmu.dll._handle)
        instance = C.c_void_p.from_param(self._fmu.component)
        # a step that is never cut is converted once, as all else
        h = self._h if part.any_step else C.c_double.from_param(self._h.value)
        u, n_u, n_y = C.byref(self._u), _size(self._u), _size(y)
        inputs, outputs = (C.byref(vr_in), _size(vr_in)), (C.byref(vr_out), _size(vr_out))
        if fmi == 2:
            put = partial(dll["fmi2SetReal"], instance, *inputs, u)
            get = partial(dll["fmi2GetReal"], instance, *outputs, C.byref(y))
            do = partial(dll["fmi2DoStep"], instance, self._t, h, C.c_int.from_param(forward))
        else:
            put = partial(dll["fmi3SetFloat64"], instance, *inputs, u, n_u)
            get = partial(dll["fmi3GetFloat64"], instance, *outputs, C.byref(y), n_y)
            told = [C.byref(C.c_bool()), C.byref(C.c_bool()), C.byref(C.c_bool()), C.byref(C.c_double())]
            do = partial(dll["fmi3DoStep"], instance, self._t, h, C.c_bool.from_param(forward), *told)
        self.sources = [source.get(n, -1) for n in read]
        self._derivative, self._tangent = f"fmi{fmi}GetDirectionalDerivative", None
        if system.newton and system.parts.index(part) in system.loops():
            du, dy = (C.c_double * len(read))(), (C.c_double * len(part.outputs))()
            seeds, changes = ([C.byref(a), _size(a)][: fmi - 1] for a in (du, dy))
            self._du, self._dy = du, dy
            self._tangent = partial(dll[self._derivative], instance, *outputs, *inputs, *seeds, *changes)
        self._vr, self._rollback = (vr_in, vr_out), not forward
        self._put, self._do, self._get = put if read else _nothing, do, get if part.outputs else _nothing
        self.turn: Sequence[Callable[[], int]] = [partial(whole_turn, self)]
        if part.substeps > 1 or self._lines is not None:
            return
        wanted: list[tuple[object, Callable[[], int]]] = [(self._copies, self._copy), (read, put), (do, do)]
        wanted.append((part.outputs, get))
        self.turn = [call for needed, call in wanted if needed]

    def _apply(self, foreign: Foreign) -> None:
        """Give the FMU the values that the scenario has for its parameters."""
        variables = {v.name: v for v in foreign.description.modelVariables}
        for name, value in foreign.settings.items():
            v = variables[name]
            kind = v.type if v.type != "Enumeration" else "Integer" if foreign.fmi == 2 else "Int64"
            whole = kind not in ("Real", "Float64", "Float32", "Boolean", "String")
            try:
                getattr(self._fmu, f"set{kind}")([v.valueReference], [int(value) if whole else value])
            except Exception as e:
                raise Stopped(f"{self.name} refuses {name} = {value!r}: {e}") from None

    def calls(self) -> Calls:
        """What the master in C needs to call this FMU."""
        names = ["fmi2SetReal", "fmi2DoStep", "fmi2GetReal", "fmi2GetFMUstate", "fmi2SetFMUstate"]
        if self._fmi == 3:
            names = ["fmi3SetFloat64", "fmi3DoStep", "fmi3GetFloat64", "fmi3GetFMUState", "fmi3SetFMUState"]
        used = names if self._rollback else names[:3]
        functions = [C.cast(self._fmu.dll[n], C.c_void_p).value for n in used]
        tangent = None if self._tangent is None else C.cast(self._fmu.dll[self._derivative], C.c_void_p).value
        return Calls(
            self._fmi == 3,
            functions,
            tangent,
            self._fmu.component,
            self.sources,
            list(self._u),
            *self._vr,
            self._rollback,
        )

    def free_state(self, state: int) -> None:
        """Free a state that the master in C saved."""
        self._fmu.freeFMUState(C.c_void_p(state))

    @property
    def said(self) -> str:
        """What the FMU logged last."""
        return self._said[-1] if self._said else "without a word"

    def start(self, t0: float) -> None:
        if self._fmi == 2:
            self._fmu.setupExperiment(startTime=t0)
            self._fmu.enterInitializationMode()
        else:
            self._fmu.enterInitializationMode(startTime=t0)
        put = self._fmu.setReal if self._fmi == 2 else self._fmu.setFloat64
        for reference, constants in self._constants:
            put([reference], constants)
        self._copy()
        if self._put() > 1:
            raise self.stopped()
        self._fmu.exitInitializationMode()
        self.take()

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
        begin = self._t.value  # the clock is that of all units with this period
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

    def tangent(self, du: list[float]) -> list[float] | None:
        assert self._tangent is not None
        for k, v in enumerate(du):
            self._du[k] = v
        return None if self._tangent() > 1 else list(self._dy)

    def save(self) -> None:
        if self._lines is not None:
            self._lines.save()
        if self._state is not None:
            self._fmu.freeFMUState(self._state)
        self._state = self._fmu.getFMUState()

    def restore(self) -> None:
        if self._lines is not None:
            self._lines.restore()
        self._fmu.setFMUState(self._state)

    def state_hash(self) -> str:
        assert not isinstance(self._graph, Foreign)
        self.save()
        serialize = self._fmu.serializeFMUstate if self._fmi == 2 else self._fmu.serializeFMUState
        # the bytes of ours end with the state of the core
        state = np.frombuffer(serialize(self._state)[-8 * n_saved(self._graph) :])
        return state_hash(self._graph, state)

    def stopped(self) -> Stopped:
        why = self._said[-1] if self._said else f"inputs {list(self._u)}"
        return Stopped(f"{self.name} refuses the step from t = {self._t.value:g} s: {why}")

    def close(self) -> None:
        if self._state is not None:
            self._fmu.freeFMUState(self._state)
        self._fmu.freeInstance()
