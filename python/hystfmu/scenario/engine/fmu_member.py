"""An FMU as a unit of the master in C. fmpy loads and initialises the FMU; the master in C calls its functions.

The master cannot call a foreign FMU directly if it has other types of variables, supports only Model Exchange, or has
FMI version 1.0. The class `AdaptedMember` gives the master functions in Python for such an FMU.
"""

from __future__ import annotations

import ctypes as C
import hashlib
import shutil
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.fmu.foreign.instance import Finding
from hystfmu.fmu.foreign.simulated import Simulated
from hystfmu.graph import Graph
from hystfmu.scenario.engine.member import FMI2, FMI3, Slot, Unit, slots, unit_of
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import System


def n_states(graph: Graph) -> int:
    """Return the number of states of the blocks of a graph."""
    return sum(n.sizes[v.name] for n in graph.nodes for v in n.block.of("cstate", "state"))


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
_NAMES = ("set", "step", "get", "save", "restore")  # functions of a unit in C; the last two for iterative coupling


class FmuMember(ABC):
    """Inputs and outputs of an FMU. A subclass loads the FMU and states its functions.

    `linked` contains the inputs that are set in every step. `fixed` contains the inputs that are set once.

    Raises
    ------
    Stopped
        The FMU cannot be instantiated, or the coupling needs a state that it cannot save.
    """

    kind = FMI2
    component = 1
    vr_in: C.Array[Any]
    vr_out: C.Array[Any]
    functions: Sequence[Any]
    tangent: Any = None

    def __init__(self, system: System, k: int, fmi: Literal[1, 2, 3], saves: bool) -> None:
        part = system.parts[k]
        self._system, self._k, self._fmi, self.name, self._graph = system, k, fmi, part.name, part.graph
        # iterative coupling restores the states before the present point
        self._rollback = system.case.coupling.scheme == "iterative"
        if self._rollback and not saves:
            raise Stopped(f"{part.name}: iterative coupling needs an FMU that can get and set its state")
        self._said: list[str] = []  # log messages of the FMU, which the verdict shows instead of the terminal
        # Connected inputs are set in every step, constant inputs once. An array of FMI 3.0 has one reference for all
        # elements and is set as a whole; its values are contiguous, as in the values of the system.
        links = {part.inputs[link.input]: link for link in system.links if link.to == k}
        of = {
            kind: [s for p in part.graph.ports if p.kind == kind for s in slots(p, fmi)] for kind in ("input", "output")
        }
        self.read_back = of["output"]
        self.linked = [slot for slot in of["input"] if any(n in links for n in slot[1])]
        self.fixed = [slot for slot in of["input"] if slot not in self.linked]
        read = [n for _, names in self.linked for n in names]
        self._links = [links.get(n) for n in read]
        self._source = np.array([-1 if link is None else link.source for link in self._links], dtype=np.int64)
        self._u = np.array([part.constants.get(n, 0.0) for n in read])

    def start(self, values: C.Array[C.c_double]) -> None:
        """Initialise at t = 0 with the present values, and write the first outputs."""
        first, places = self._system.parts[self._k].first, self._source.tolist()
        found = self._start([u if j < 0 else values[j] for u, j in zip(self._u.tolist(), places, strict=True)])
        for place, y in enumerate(found, first):
            values[place] = y

    @abstractmethod
    def _start(self, u: list[float]) -> list[float]:
        """Initialise with the connected inputs `u`, and return the first outputs."""

    def raw(self, values: C.Array[C.c_double]) -> tuple[Unit, list[Any]]:
        """Return the structure for C, and arrays that must exist during the run. All units must be initialised."""
        sizes = {"n_vr_in": len(self.vr_in), "n_vr_out": len(self.vr_out)}
        sizes["n_out"] = len(self._system.parts[self._k].outputs)
        places = {"vr_in": C.addressof(self.vr_in), "vr_out": C.addressof(self.vr_out), "u": self._u.ctypes.data}
        calls: dict[str, int | None] = {
            n: _pointer(f) for n, f in zip(_NAMES if self._rollback else _NAMES[:3], self.functions, strict=False)
        }
        facts = {
            "kind": self.kind,
            "self": self.component,
            "rollback": self._rollback,
            "tangent": _pointer(self.tangent),
        }
        return unit_of(self._system, self._k, values, self._source, self._links, **sizes, **places, **calls, **facts)

    def forget(self, unit: Unit) -> None:
        """Free the state that the master saved last."""
        if unit.state:
            self.free_state(unit.state)

    @abstractmethod
    def free_state(self, state: int) -> None:
        """Free a saved state."""

    @abstractmethod
    def close(self) -> None:
        """Free the instance, with all states that it saved."""

    def why(self) -> str:
        """Return the last log message of the FMU, or its inputs if it has logged nothing."""
        return self._said[-1] if self._said else f"inputs {self._u.tolist()}"


def _pointer(function: Any) -> int | None:
    return None if function is None else C.cast(function, C.c_void_p).value


def _callbacks(log: Callable[..., None]) -> Any:
    """Return FMI 2.0 callbacks that pass log messages to `log`."""
    from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(log)
    callbacks.allocateMemory = defaultCallbacks.allocateMemory
    callbacks.freeMemory = defaultCallbacks.freeMemory
    return callbacks


class DirectMember(FmuMember):
    """An FMU whose functions the master in C calls directly."""

    def __init__(self, system: System, k: int, store: FmuStore | None) -> None:
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        part = system.parts[k]
        fmi: Literal[2, 3] = 2 if part.runs_as == "fmu2" else 3
        if isinstance(part.graph, Foreign):
            folder, description = part.graph.folder, part.graph.description
        else:
            assert store is not None
            folder, description = store.get(part.graph, fmi)
        super().__init__(system, k, fmi, description.coSimulation.canGetAndSetFMUstate)
        self._fmu = (FMU2Slave if fmi == 2 else FMU3Slave)(
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName=part.name,
        )
        if fmi == 2:
            self._fmu.instantiate(callbacks=_callbacks(lambda _c, _n, _s, _k, m: self._said.append(m.decode())))
        else:
            self._fmu.instantiate(logMessage=lambda _e, _s, _k, m: self._said.append(m.decode()))
        reference = {v.name: v.valueReference for v in description.modelVariables}
        if isinstance(part.graph, Foreign):
            self._apply(part.graph)
        self._constants = [(reference[name], [part.constants[n] for n in names]) for name, names in self.fixed]
        self.vr_in, self.vr_out = (
            (C.c_uint32 * len(of))(*[reference[name] for name, _ in of]) for of in (self.linked, self.read_back)
        )
        self.kind, self.component = (FMI2, FMI3)[fmi - 2], self._fmu.component
        of, state = ("Real", "FMUstate") if fmi == 2 else ("Float64", "FMUState")
        names = [f"Set{of}", "DoStep", f"Get{of}", f"Get{state}", f"Set{state}"]
        self.functions = [self._fmu.dll[f"fmi{fmi}{n}"] for n in names[: 5 if self._rollback else 3]]
        if system.newton and k in system.loops():
            self.tangent = self._fmu.dll[f"fmi{fmi}GetDirectionalDerivative"]
        self._kind = of

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

    def _start(self, u: list[float]) -> list[float]:
        fmu, put, get = self._fmu, getattr(self._fmu, f"set{self._kind}"), getattr(self._fmu, f"get{self._kind}")
        if self._fmi == 2:
            fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        for reference, constants in self._constants:
            put([reference], constants)
        try:
            put([*self.vr_in], u)
        except Exception:  # fmpy raises several kinds of exceptions
            why = self._said[-1] if self._said else f"inputs {u}"
            raise Stopped(f"{self.name} refuses its inputs: {why}") from None
        fmu.exitInitializationMode()
        n = len(self._system.parts[self._k].outputs)
        return list(get([*self.vr_out], *[n] * (self._fmi == 3)) if n else ())

    def free_state(self, state: int) -> None:
        """Free a saved state."""
        self._fmu.freeFMUState(C.c_void_p(state))

    def state_hashes(self) -> dict[str, str]:
        """Return the hash of the present states of the FMU, which must not be a foreign FMU."""
        assert not isinstance(self._graph, Foreign)
        state = self._fmu.getFMUState()
        serialize = self._fmu.serializeFMUstate if self._fmi == 2 else self._fmu.serializeFMUState
        # the serialised state of an own FMU ends with the state of the core: the last step, the states, and all other
        # values that change during a run
        content = np.frombuffer(serialize(state)[-8 * len(self._graph.executor().state) :])
        self._fmu.freeFMUState(state)
        return {self.name: state_hash(self._graph, content)}

    def close(self) -> None:
        """Free the instance."""
        self._fmu.freeInstance()


_SET = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_void_p, C.c_size_t, C.POINTER(C.c_double))
_STEP = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_double, C.c_double, C.c_int)
_SAVE = C.CFUNCTYPE(C.c_int, C.c_void_p, C.POINTER(C.c_void_p))
_RESTORE = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_void_p)


class AdaptedMember(FmuMember):
    """A foreign FMU whose variables are set and read one by one, according to their types."""

    def __init__(self, system: System, k: int, foreign: Foreign) -> None:
        super().__init__(system, k, foreign.fmi, foreign.saves)
        part, variables = system.parts[k], {p.name: p.variable for p in foreign.ports}
        self._constants = [(variables[name], [part.constants[n] for n in names]) for name, names in self.fixed]
        self._states: dict[int, Any] = {}

        def of(wanted: Sequence[Slot]) -> list[tuple[Any, int]]:
            return [(variables[name], len(names)) for name, names in wanted]

        try:
            ends = of(self.linked), of(self.read_back)
            self._unit = Simulated(foreign.folder, foreign.description, *ends, part.name, self._said.append)
            self._unit.set_parameters(foreign.settings)
        except Finding as e:
            raise Stopped(f"{part.name}: {e}") from None
        self.vr_in, self.vr_out = ((C.c_uint32 * size)() for size in (len(self._u), len(part.outputs)))
        # the callbacks must exist as long as this object
        self.functions = [
            _SET(self._put),
            _STEP(self._step),
            _SET(self._get),
            _SAVE(self._save),
            _RESTORE(self._restore),
        ]

    def _status(self, call: Callable[[], object]) -> int:
        """Call a function of the FMU and return its status. An exception becomes the last message of the FMU."""
        try:
            call()
        except Exception as e:  # no exception may reach the master in C
            self._said.append(str(e) if isinstance(e, Finding) else f"{type(e).__name__}: {e}")
            return _ERROR
        return 0

    def _start(self, u: list[float]) -> list[float]:
        if self._status(lambda: self._unit.start(0.0, u, self._constants)):
            raise Stopped(f"{self.name} cannot be initialized: {self.why()}")
        return list(self._unit.get())

    def _put(self, _c: Any, _r: Any, size: int, u: Any) -> int:
        return self._status(lambda: self._unit.put(u[:size]))

    def _step(self, _c: Any, t: float, h: float, _forward: int) -> int:
        return self._status(lambda: self._unit.step(t, h))

    def _get(self, _c: Any, _r: Any, _size: int, y: Any) -> int:
        def read() -> None:
            for k, x in enumerate(self._unit.get()):
                y[k] = x

        return self._status(read)

    def _save(self, _c: Any, state: Any) -> int:
        def keep() -> None:
            if state[0]:
                self.free_state(state[0])
            number = max(self._states, default=0) + 1
            self._states[number] = self._unit.save()
            state[0] = number

        return self._status(keep)

    def _restore(self, _c: Any, state: int) -> int:
        return self._status(lambda: self._unit.restore(self._states[state]))

    def free_state(self, state: int) -> None:
        """Free a saved state."""
        self._unit.forget(self._states.pop(state))

    def close(self) -> None:
        """Free the states and the instance."""
        for state in list(self._states):
            self.free_state(state)
        self._unit.close()


def fmu_member(system: System, k: int, store: FmuStore | None) -> DirectMember | AdaptedMember:
    """Return unit k as an FMU: with functions in Python if the master cannot call the functions of the FMU."""
    graph = system.parts[k].graph
    if isinstance(graph, Foreign) and not graph.direct:
        return AdaptedMember(system, k, graph)
    return DirectMember(system, k, store)
