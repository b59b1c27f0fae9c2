"""Units of the master in C: their structure, first-order hold of inputs, and FMUs as units.

The first-order hold is a straight line through the last two values of a source. If the source precedes the unit with
the hold in the order, the line interpolates. If the source follows this unit, the line extrapolates.

`Simulated` loads and initialises an FMU; the master in C calls its functions. The master cannot call a foreign FMU
directly if it has other types of variables, supports only Model Exchange, or has FMI version 1.0. The class
`AdaptedMember` gives the master functions in Python for such an FMU.
"""

import ctypes as C
import hashlib
import shutil
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import numpy as np

from hystfmu.base import Array
from hystfmu.fmu.foreign.instance import Finding, version
from hystfmu.fmu.foreign.simulated import Simulated
from hystfmu.graph import Graph
from hystfmu.graph.node import Port
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.foreign import Foreign, ForeignPort
from hystfmu.scenario.system.system import Link, Rows, System

GRAPH, FMI2, FMI3 = 0, 1, 2  # as in system.h


def fields(declared: str) -> tuple[tuple[str, Any], ...]:
    """Return the fields of a structure, declared as in C: a type and its fields, then ``;`` and the next type."""
    types = {"pointer": C.c_void_p, "int32": C.c_int32, "int64": C.c_int64, "double": C.c_double}
    groups = (group.split() for group in declared.split(";"))
    return tuple((name, types[kind]) for kind, *names in groups for name in names)


class Unit(C.Structure):
    """`master_unit` of system.h."""

    _fields_ = fields(
        "int32 kind rollback; int64 any_step period substeps; double h; pointer self set step get save "
        "restore tangent; int64 n_in n_out first; pointer source u vr_in vr_out; int64 n_vr_in n_vr_out; "
        "pointer ahead line at saved state seeds; double t"
    )


def unit_of(
    system: System, k: int, values: C.Array[C.c_double], source: Rows, links: Sequence[Link | None], **more: Any
) -> tuple[Unit, list[Any]]:
    """Return the structure of unit k for C, and arrays that must exist during the run.

    Parameters
    ----------
    system : System
    k : int
        Index of the unit in the order, or of the first of several units that are one graph.
    values : array of C
        Present values of the system. The lines of a first-order hold start with these values.
    source : array of int, shape (n,)
        Index of the value that each input reads; -1 for a constant.
    links : sequence of Link or None
        Connection of each input; None for a constant.
    **more
        Further fields of the structure.
    """
    part = system.parts[k]
    facts = {"any_step": part.any_step, "period": part.period, "substeps": part.substeps, "first": part.first}
    h = system.length(part) / part.substeps
    unit = Unit(h=h, n_in=len(source), source=source.ctypes.data, **facts, **more)
    if part.hold == "zero":
        return unit, [source]
    now = [values[j] if j >= 0 else 0.0 for j in source.tolist()]
    line, ahead = np.array(5 * now), np.array([0.0 if link is None else weight(system, link) for link in links])
    unit.ahead, unit.line = ahead.ctypes.data, line.ctypes.data
    return unit, [source, line, ahead]


def weight(system: System, link: Link) -> float:
    """Return the time of the newest value of a source within the step of the connected unit.

    The time is a fraction of the step: 0 is the start of the step, and 1 is the end.

    If the source follows the connected unit in the order, the value is older than the end of the step by one step of
    the source.
    """
    late = system.maker(link).period / system.parts[link.to].period
    return 1.0 if system.fresh(link) else 1.0 - late


Slot = tuple[str, tuple[str, ...]]


def slots(port: Port | ForeignPort, fmi: int) -> list[Slot]:
    """Return the name and the names of the elements of each variable that a port needs in an FMU of version `fmi`."""
    return [(port.name, port.scalar_names)] if fmi == 3 else [(n, (n,)) for n in port.scalar_names]


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

    def __enter__(self) -> "FmuStore":
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
    """An FMU with its inputs and outputs. A subclass states its functions.

    An FMU of HystFMU is exported to the folder of `store`.

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

    def __init__(self, system: System, k: int, store: FmuStore | None) -> None:
        part = system.parts[k]
        self._system, self._k, self.name, self._graph = system, k, part.name, part.graph
        settings: Mapping[str, Any] = {}
        if isinstance(part.graph, Foreign):
            folder, description, settings = part.graph.folder, part.graph.description, part.graph.settings
        else:
            assert store is not None
            folder, description = store.get(part.graph, 2 if part.runs_as == "fmu2" else 3)
        self._fmi = version(description)
        # iterative coupling restores the states before the present point
        self._rollback = system.case.coupling.scheme == "iterative"
        if self._rollback and isinstance(part.graph, Foreign) and not part.graph.saves:
            raise Stopped(f"{part.name}: iterative coupling needs an FMU that can get and set its state")
        self._said: list[str] = []  # log messages of the FMU, which the verdict shows instead of the terminal
        # Connected inputs are set in every step, constant inputs once. An array of FMI 3.0 has one reference for all
        # elements and is set as a whole; its values are contiguous, as in the values of the system.
        links = {part.inputs[link.input]: link for link in system.links if link.to == k}
        of = {
            kind: [s for p in part.graph.ports if p.kind == kind for s in slots(p, self._fmi)]
            for kind in ("input", "output")
        }
        self.read_back = of["output"]
        self.linked = [slot for slot in of["input"] if any(n in links for n in slot[1])]
        self.fixed = [slot for slot in of["input"] if slot not in self.linked]
        read = [n for _, names in self.linked for n in names]
        self._links = [links.get(n) for n in read]
        self._source = np.array([-1 if link is None else link.source for link in self._links], dtype=np.int64)
        self._u = np.array([part.constants.get(n, 0.0) for n in read])
        variables = {v.name: v for v in description.modelVariables}
        self._constants = [(variables[name], [part.constants[n] for n in names]) for name, names in self.fixed]
        inputs, outputs = ([(variables[n], len(names)) for n, names in of] for of in (self.linked, self.read_back))
        try:
            self._unit = Simulated(folder, description, inputs, outputs, part.name, self._said.append)
            self._unit.set_parameters(settings)
        except Finding as e:
            raise Stopped(f"{part.name}: {e}") from None
        self.references = [v.valueReference for v, _ in inputs], [v.valueReference for v, _ in outputs]

    def start(self, values: C.Array[C.c_double]) -> None:
        """Initialise at t = 0 with the present values, and write the first outputs."""
        first, places = self._system.parts[self._k].first, self._source.tolist()
        u = [u if j < 0 else values[j] for u, j in zip(self._u.tolist(), places, strict=True)]
        try:
            self._unit.start(0.0, u, self._constants)
            found = self._unit.get()
        except Exception as e:  # fmpy raises several kinds of exceptions
            raise Stopped(f"{self.name} cannot be initialized: {': '.join([str(e), *self._said[-1:]])}") from None
        for place, y in enumerate(found, first):
            values[place] = y

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

    def close(self) -> None:
        """Free the instance."""
        self._unit.close()

    def why(self) -> str:
        """Return the last log message of the FMU, or its inputs if it has logged nothing."""
        return self._said[-1] if self._said else f"inputs {self._u.tolist()}"


def _pointer(function: Any) -> int | None:
    return None if function is None else C.cast(function, C.c_void_p).value


class DirectMember(FmuMember):
    """An FMU whose functions the master in C calls directly."""

    def __init__(self, system: System, k: int, store: FmuStore | None) -> None:
        super().__init__(system, k, store)
        self._fmu = self._unit.made.unit
        self.vr_in, self.vr_out = ((C.c_uint32 * len(of))(*of) for of in self.references)
        self.kind, self.component = FMI2 if self._fmi == 2 else FMI3, self._fmu.component
        of, state = ("Real", "FMUstate") if self._fmi == 2 else ("Float64", "FMUState")
        names = [f"Set{of}", "DoStep", f"Get{of}", f"Get{state}", f"Set{state}"]
        self.functions = [self._fmu.dll[f"fmi{self._fmi}{n}"] for n in names[: 5 if self._rollback else 3]]
        if system.newton and k in system.loops():
            self.tangent = self._fmu.dll[f"fmi{self._fmi}GetDirectionalDerivative"]

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


_SET = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_void_p, C.c_size_t, C.POINTER(C.c_double))
_STEP = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_double, C.c_double, C.c_int)
_SAVE = C.CFUNCTYPE(C.c_int, C.c_void_p, C.POINTER(C.c_void_p))
_RESTORE = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_void_p)


class AdaptedMember(FmuMember):
    """A foreign FMU whose variables are set and read one by one, according to their types."""

    def __init__(self, system: System, k: int) -> None:
        super().__init__(system, k, None)
        self._states: dict[int, Any] = {}
        self.vr_in, self.vr_out = ((C.c_uint32 * size)() for size in (len(self._u), len(system.parts[k].outputs)))
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
        super().close()


def fmu_member(system: System, k: int, store: FmuStore | None) -> DirectMember | AdaptedMember:
    """Return unit k as an FMU: with functions in Python if the master cannot call the functions of the FMU."""
    graph = system.parts[k].graph
    if isinstance(graph, Foreign) and not graph.direct:
        return AdaptedMember(system, k)
    return DirectMember(system, k, store)
