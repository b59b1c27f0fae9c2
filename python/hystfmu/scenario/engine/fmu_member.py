"""An FMU as a unit of a run. The FMU is exported and unpacked once, and called through fmpy.

The FMU writes its outputs directly into the values of the system, and each input is copied once. For speed, the
functions that set inputs, make a step and get outputs are called without the wrappers of fmpy.

The master cannot call a foreign FMU directly if it has other types of variables, supports only Model Exchange, or has
FMI version 1.0. The class `AdaptedMember` adapts such an FMU to the interface of the master.
"""

from __future__ import annotations

import ctypes as C
import hashlib
import shutil
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.fmu.foreign.instance import Finding
from hystfmu.fmu.foreign.simulated import Simulated
from hystfmu.graph import Graph
from hystfmu.scenario.engine.member import Calls, Slot, SteppedMember
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Part, System


def n_states(graph: Graph) -> int:
    """Return the number of states of the blocks of a graph."""
    return sum(n.sizes[v.name] for n in graph.nodes for v in n.block.of("cstate", "state"))


def n_saved(graph: Graph) -> int:
    """Return the number of values in the saved state of a graph in the core.

    The values are the last step, the states, and all other values that change during a run.
    """
    return len(graph.executor().state)


def state_hash(graph: Graph, saved: Array, skip: int = 0) -> str:
    """Return the hash of the states of a graph, which are in the `saved` state (n,) of the core.

    `skip` is the number of preceding states that belong to other graphs.
    """
    return hashlib.sha256(saved[1 + skip : 1 + skip + n_states(graph)].tobytes()).hexdigest()[:16]


class FmuStore:
    """Exported and unpacked FMUs in a temporary folder, which is removed at the end of the `with` block.

    The temporary folder is in the folder `within`.
    """

    def __init__(self, within: str | None = None) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="hystfmu_run_", dir=within))
        self._known: dict[tuple[str, int], tuple[Path, Any]] = {}

    def __enter__(self) -> FmuStore:
        return self

    def __exit__(self, kind: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Remove all exported and unpacked FMUs."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def get(self, graph: Graph, fmi: Literal[2, 3]) -> tuple[Path, Any]:
        """Return the folder and the model description of the FMU of a graph, which is exported on first use.

        The FMU has no sample time, because the master determines the step sizes and divides steps at discontinuities.
        """
        graph = graph.with_step(0.0)
        key = (graph.token, fmi)
        if key not in self._known:
            import fmpy

            from hystfmu.fmu.write.export import export_fmu

            archive = self.folder / f"unit_{len(self._known)}.fmu"
            export_fmu(graph, archive, fmi=fmi)
            folder = self.folder / archive.stem
            fmpy.extract(str(archive), str(folder))
            archive.unlink()
            self._known[key] = (folder, fmpy.read_model_description(str(folder), validate=False))
        return self._known[key]


_ERROR = 3


def _references(values: Sequence[int]) -> C.Array[C.c_uint32]:
    return (C.c_uint32 * len(values))(*values)


def _callbacks(log: Callable[..., None]) -> Any:
    """Return FMI 2.0 callbacks that pass log messages to `log`."""
    from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(log)
    callbacks.allocateMemory = defaultCallbacks.allocateMemory
    callbacks.freeMemory = defaultCallbacks.freeMemory
    return callbacks


def _size(values: C.Array[Any]) -> Any:
    return C.c_size_t.from_param(len(values))


def _not_ended(step: Callable[[], int], end: C.c_bool, early: C.c_bool) -> int:
    """Make a step, and return the status. The status is an error if the FMU has requested the end of the simulation."""
    status = step()
    return status if status > 1 or not (end.value or early.value) else _ERROR


class FmuMember(SteppedMember):
    """An FMU whose binary fmpy has loaded. The arrays of inputs and outputs are allocated once for the whole run."""

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
        super().__init__(system, part, sources, values, clock, fmi)
        kind = FMU2Slave if fmi == 2 else FMU3Slave
        self._fmu = kind(
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName=part.name,
        )
        self._state: Any = None
        if fmi == 2:
            self._fmu.instantiate(callbacks=_callbacks(lambda _c, _n, _s, _k, m: self._said.append(m.decode())))
        else:
            self._fmu.instantiate(logMessage=lambda _e, _s, _k, m: self._said.append(m.decode()))
        reference = {v.name: v.valueReference for v in description.modelVariables}
        if isinstance(part.graph, Foreign):
            self._apply(part.graph)
        self._constants = [(reference[name], [part.constants[n] for n in names]) for name, names in self.fixed]
        vr_in = _references([reference[name] for name, _ in self.linked])
        vr_out = _references([reference[name] for name, _ in self.read_back])
        y, forward = self._y, not self._rollback
        # The functions are called without the argument types that fmpy declares. Converting the arguments once saves a
        # third.
        # Own FMUs never wait and never call Python from another thread, so the interpreter lock is kept (a fifth
        # faster).
        dll = self._fmu.dll if isinstance(part.graph, Foreign) else C.PyDLL(None, handle=self._fmu.dll._handle)
        instance = C.c_void_p.from_param(self._fmu.component)
        # the length of a step that is never divided is converted only once
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
            event, end, early, reached = C.c_bool(), C.c_bool(), C.c_bool(), C.c_double()
            told = [C.byref(event), C.byref(end), C.byref(early), C.byref(reached)]
            do = partial(dll["fmi3DoStep"], instance, self._t, h, C.c_bool.from_param(forward), *told)
            if isinstance(part.graph, Foreign):
                do = partial(_not_ended, do, end, early)
        self._derivative, self._tangent = f"fmi{fmi}GetDirectionalDerivative", None
        if system.newton and system.parts.index(part) in system.loops():
            du, dy = (C.c_double * len(self._u))(), (C.c_double * len(part.outputs))()
            seeds, changes = ([C.byref(a), _size(a)][: fmi - 1] for a in (du, dy))
            self._du, self._dy = du, dy
            self._tangent = partial(dll[self._derivative], instance, *outputs, *inputs, *seeds, *changes)
        self._vr = vr_in, vr_out
        self._call(part, put, do, get)

    def _apply(self, foreign: Foreign) -> None:
        """Set the parameters of the FMU to the values in the scenario (structural ones in Configuration Mode)."""
        variables = {v.name: v for v in foreign.description.modelVariables}
        groups: dict[bool, dict[str, Any]] = {True: {}, False: {}}
        for name, value in foreign.settings.items():
            groups[variables[name].causality == "structuralParameter"][name] = value
        if groups[True]:
            self._fmu.enterConfigurationMode()
        for name, value in groups[True].items():
            self._set(variables[name], value)
        if groups[True]:
            self._fmu.exitConfigurationMode()
        for name, value in groups[False].items():
            self._set(variables[name], value)

    def _set(self, v: Any, value: Any) -> None:
        kind = v.type if v.type != "Enumeration" else "Integer" if self._fmi == 2 else "Int64"
        whole = kind not in ("Real", "Float64", "Float32", "Boolean", "String")
        values = value if isinstance(value, list) else [int(value) if whole else value]
        try:
            getattr(self._fmu, f"set{kind}")([v.valueReference], values)
        except Exception as e:
            raise Stopped(f"{self.name} refuses {v.name} = {value!r}: {e}") from None

    def calls(self) -> Calls:
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
        self._fmu.freeFMUState(C.c_void_p(state))

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

    def tangent(self, du: list[float]) -> list[float] | None:
        """Return the change of the outputs, to first order, for a change `du` of the inputs in the last step.

        Return None if the FMU cannot compute this tangent.
        """
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
        """Return the hash of the present states of the FMU, which must not be a foreign FMU."""
        assert not isinstance(self._graph, Foreign)
        self.save()
        serialize = self._fmu.serializeFMUstate if self._fmi == 2 else self._fmu.serializeFMUState
        # the serialised state of an own FMU ends with the state of the core
        state = np.frombuffer(serialize(self._state)[-8 * n_saved(self._graph) :])
        return state_hash(self._graph, state)

    def close(self) -> None:
        if self._state is not None:
            self._fmu.freeFMUState(self._state)
        self._fmu.freeInstance()


_SET = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_void_p, C.c_size_t, C.POINTER(C.c_double))
_STEP = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_double, C.c_double, C.c_int)
_SAVE = C.CFUNCTYPE(C.c_int, C.c_void_p, C.POINTER(C.c_void_p))
_RESTORE = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_void_p)


def fmu_member(
    system: System,
    part: Part,
    sources: Sequence[tuple[int, int]],
    values: C.Array[C.c_double],
    store: FmuStore | None,
    clock: C.c_double,
) -> SteppedMember:
    """Return the object through which the master calls an FMU: an adapter if direct calls are not possible."""
    if isinstance(part.graph, Foreign) and not part.graph.direct:
        return AdaptedMember(system, part, part.graph, sources, values, clock)
    return FmuMember(system, part, sources, values, store, clock)


class AdaptedMember(SteppedMember):
    """A foreign FMU whose variables are set and read one by one, according to their types."""

    def __init__(
        self,
        system: System,
        part: Part,
        foreign: Foreign,
        sources: Sequence[tuple[int, int]],
        values: C.Array[C.c_double],
        clock: C.c_double,
    ) -> None:
        super().__init__(system, part, sources, values, clock, foreign.fmi)
        if self._rollback and not foreign.saves:
            raise Stopped(f"{part.name}: iterative coupling needs an FMU that can get and set its state")
        self._variables = {p.name: p.variable for p in foreign.ports}
        self._constants = [(self._variables[name], [part.constants[n] for n in names]) for name, names in self.fixed]
        self._states: dict[int, Any] = {}
        self._last: int | None = None
        try:
            self._unit = Simulated(
                foreign.folder,
                foreign.description,
                self._of(self.linked),
                self._of(self.read_back),
                part.name,
                self._said.append,
            )
            self._unit.set_parameters(foreign.settings)
        except Finding as e:
            raise Stopped(f"{part.name}: {e}") from None
        self._call(part, self._put_all, self._advance_once, self._get_all)

    def _of(self, wanted: Sequence[Slot]) -> list[tuple[Any, int]]:
        return [(self._variables[name], len(names)) for name, names in wanted]

    def _status(self, call: Callable[[], object]) -> int:
        """Call a function of the FMU and return its status. An exception becomes the last message of the FMU."""
        try:
            call()
        except Exception as e:  # no exception may reach the master in C
            self._said.append(str(e) if isinstance(e, Finding) else f"{type(e).__name__}: {e}")
            return _ERROR
        return 0

    def _put_all(self) -> int:
        return self._status(lambda: self._unit.put(list(self._u)))

    def _advance_once(self) -> int:
        return self._status(lambda: self._unit.step(self._t.value, self._h.value))

    def _get_all(self) -> int:
        def get() -> None:
            for k, x in enumerate(self._unit.get()):
                self._y[k] = x

        return self._status(get)

    def start(self, t0: float) -> None:
        self._copy()
        if self._status(lambda: self._unit.start(t0, list(self._u), self._constants)):
            raise Stopped(f"{self.name} cannot be initialized: {self.said}")
        self.take()

    def save(self) -> None:
        if self._lines is not None:
            self._lines.save()
        if self._last is not None:
            self.free_state(self._last)
        self._last = self._keep()

    def _keep(self) -> int:
        number = max(self._states, default=0) + 1
        self._states[number] = self._unit.save()
        return number

    def restore(self) -> None:
        if self._lines is not None:
            self._lines.restore()
        assert self._last is not None
        self._unit.restore(self._states[self._last])

    def free_state(self, state: int) -> None:
        self._unit.forget(self._states.pop(state))

    def calls(self) -> Calls:
        n = len(self._y)

        def put(_c: Any, _r: Any, size: int, u: Any) -> int:
            return self._status(lambda: self._unit.put(u[:size]))

        def step(_c: Any, t: float, h: float, _forward: int) -> int:
            return self._status(lambda: self._unit.step(t, h))

        def get(_c: Any, _r: Any, _size: int, y: Any) -> int:
            def read() -> None:
                for k, x in enumerate(self._unit.get()):
                    y[k] = x

            return self._status(read)

        def save(_c: Any, state: Any) -> int:
            def keep() -> None:
                if state[0]:
                    self.free_state(state[0])
                state[0] = self._keep()

            return self._status(keep)

        def restore(_c: Any, state: int) -> int:
            return self._status(lambda: self._unit.restore(self._states[state]))

        kinds: list[tuple[Any, Any]] = [(_SET, put), (_STEP, step), (_SET, get), (_SAVE, save), (_RESTORE, restore)]
        # the callbacks must exist as long as this object
        self._callbacks = [kind(function) for kind, function in kinds]
        functions = [C.cast(f, C.c_void_p).value for f in self._callbacks]
        vr_in, vr_out = ((C.c_uint32 * size)() for size in (len(self._u), n))
        return Calls(
            False,
            functions if self._rollback else functions[:3],
            None,
            1,
            self.sources,
            list(self._u),
            vr_in,
            vr_out,
            self._rollback,
        )

    def close(self) -> None:
        for state in list(self._states):
            self.free_state(state)
        self._unit.close()
