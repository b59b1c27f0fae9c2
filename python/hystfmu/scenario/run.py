"""Running a case: the master loop, on real FMUs (fmpy), Python units, or fused graphs in the C core.

All engines step the same grid in the same order with the same values, so their results have the same bits (a test says
so); the FMUs are the reference.  Buffers are laid out once: an output buffer of a unit is a window into the values of
the system, an input costs one copy, and the functions of the binary are called without a wrapper in between.
"""

from __future__ import annotations

import ctypes as C
import math
import shutil
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Protocol

import numpy as np

from hystfmu.core import Array
from hystfmu.errors import InputError
from hystfmu.graph import Graph, Port
from hystfmu.scenario.system import Part, System, fuse, segments
from hystfmu.unit import Unit

Engine = Literal["fmpy", "python", "native"]


class Stopped(Exception):
    """A unit refused to go on (a diverged loop ends with values that are not finite): a failure, not bad input."""


@dataclass(frozen=True)
class Trace:
    """All outputs of all units of one run.

    t : shape (n + 1,), times of the fine grid (s);  values : shape (n + 1, n_values), `columns` says which is which.
    """

    t: Array
    values: Array
    columns: dict[str, int]
    ripple: int

    def __getitem__(self, end: str) -> Array:
        return self.values[:, self.columns[end]]

    def only(self, ends: Iterable[str]) -> Trace:
        """A copy that holds these outputs alone: many cases are kept for a report."""
        kept = list(dict.fromkeys(ends))
        values = self.values[:, [self.columns[e] for e in kept]]
        return Trace(self.t, values, {e: k for k, e in enumerate(kept)}, self.ripple)


class _Member(Protocol):
    """What the master steps: a unit, or several fused ones."""

    period: int
    name: str

    def start(self, t0: float) -> None: ...

    def step(self, t: float) -> None: ...

    def close(self) -> None: ...


class FmuStore:
    """Exported and unpacked FMUs in a temporary folder (TMPDIR is honoured) that is gone at the end of the `with`."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="hystfmu_run_"))
        self._known: dict[tuple[str, int], tuple[Path, Any]] = {}

    def __enter__(self) -> FmuStore:
        return self

    def __exit__(self, kind: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)

    def get(self, graph: Graph, fmi: Literal[2, 3]) -> tuple[Path, Any]:
        """Folder and model description of the graph as an FMU; exported on first use."""
        key = (graph.token, fmi)
        if key not in self._known:
            import fmpy

            from hystfmu.fmu.export import export_fmu

            archive = self.folder / f"unit_{len(self._known)}.fmu"
            export_fmu(graph, archive, fmi=fmi)
            folder = self.folder / archive.stem
            fmpy.extract(str(archive), str(folder))
            archive.unlink()
            self._known[key] = (folder, fmpy.read_model_description(str(folder), validate=False))
        return self._known[key]


def _window(values: C.Array[C.c_double], first: int, n: int) -> C.Array[C.c_double]:
    return (C.c_double * n).from_buffer(values, 8 * first)


def _slots(port: Port, fmi: int) -> list[tuple[str, tuple[str, ...]]]:
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


class _FmuMember:
    """One FMU, called through fmpy's loaded library with buffers that live as long as the run."""

    def __init__(
        self,
        system: System,
        part: Part,
        sources: Sequence[tuple[int, int]],
        values: C.Array[C.c_double],
        store: FmuStore,
    ) -> None:
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        fmi: Literal[2, 3] = 2 if part.runs_as == "fmu2" else 3
        folder, description = store.get(part.graph, fmi)
        self.name, self.period, self._h = part.name, part.period, system.length(part)
        kind = FMU2Slave if fmi == 2 else FMU3Slave
        self._fmu = kind(
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName=part.name,
        )
        self._said: list[str] = []  # what the FMU logs belongs into the verdict, not onto the terminal
        if fmi == 2:
            self._fmu.instantiate(callbacks=_callbacks(lambda _c, _n, _s, _k, m: self._said.append(m.decode())))
        else:
            self._fmu.instantiate(logMessage=lambda _e, _s, _k, m: self._said.append(m.decode()))
        reference = {v.name: v.valueReference for v in description.modelVariables}
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
        if len(read) == 1:  # reads the output of its source where it stands
            self._u, self._copies = _window(values, source[read[0]], 1), []
        vr_in = _references([reference[name] for name, _ in linked])
        vr_out = _references([reference[name] for p in ports["output"] for name, _ in _slots(p, fmi)])
        self._t, y = C.c_double(), _window(values, part.first, len(part.outputs))
        # Called without the argument types that fmpy declares: the arguments are converted once, here (a third faster).
        dll, instance, h = self._fmu.dll, C.c_void_p.from_param(self._fmu.component), C.c_double.from_param(self._h)
        u, n_u, n_y = C.byref(self._u), _size(self._u), _size(y)
        inputs, outputs = (C.byref(vr_in), _size(vr_in)), (C.byref(vr_out), _size(vr_out))
        if fmi == 2:
            put = partial(dll["fmi2SetReal"], instance, *inputs, u)
            get = partial(dll["fmi2GetReal"], instance, *outputs, C.byref(y))
            do = partial(dll["fmi2DoStep"], instance, self._t, h, C.c_int.from_param(1))
        else:
            put = partial(dll["fmi3SetFloat64"], instance, *inputs, u, n_u)
            get = partial(dll["fmi3GetFloat64"], instance, *outputs, C.byref(y), n_y)
            told = [C.byref(C.c_bool()), C.byref(C.c_bool()), C.byref(C.c_bool()), C.byref(C.c_double())]
            do = partial(dll["fmi3DoStep"], instance, self._t, h, C.c_bool.from_param(True), *told)
        self._put, self._do, self._get = put if read else _nothing, do, get if part.outputs else _nothing

    def start(self, t0: float) -> None:
        if hasattr(self._fmu, "setupExperiment"):
            self._fmu.setupExperiment(startTime=t0)
            self._fmu.enterInitializationMode()
        else:
            self._fmu.enterInitializationMode(startTime=t0)
        put = self._fmu.setFloat64 if hasattr(self._fmu, "setFloat64") else self._fmu.setReal
        for reference, constants in self._constants:
            put([reference], constants)
        for i, j in self._copies:
            self._u[i] = self._values[j]
        if self._put() > 1:
            raise self._stopped(t0)
        self._fmu.exitInitializationMode()
        if self._get() > 1:
            raise self._stopped(t0)

    def step(self, t: float) -> None:
        u, values = self._u, self._values
        for i, j in self._copies:
            u[i] = values[j]
        self._t.value = t
        if self._put() > 1 or self._do() > 1 or self._get() > 1:
            raise self._stopped(t)

    def _stopped(self, t: float) -> Stopped:
        why = self._said[-1] if self._said else f"inputs {list(self._u)}"
        return Stopped(f"{self.name} refuses the step from t = {t:g} s: {why}")

    def close(self) -> None:
        self._fmu.freeInstance()


class _UnitMember:
    """One Python unit in the place of an FMU."""

    def __init__(
        self, system: System, part: Part, sources: Sequence[tuple[int, int]], values: C.Array[C.c_double]
    ) -> None:
        self.name, self.period, self._h = part.name, part.period, system.length(part)
        self._unit = Unit(part.graph)
        self._constants, self._values = part.constants, values
        self._inputs = [(part.inputs[i], j) for i, j in sources]
        self._outputs = [(part.first + i, n) for i, n in enumerate(part.outputs)]

    def _exchange(self) -> None:
        try:
            for name, j in self._inputs:
                self._unit.set(name, self._values[j])
        except InputError as e:
            raise Stopped(f"{self.name} refuses its inputs: {e}") from None

    def _read(self) -> None:
        for j, name in self._outputs:
            self._values[j] = self._unit.get(name)

    def start(self, t0: float) -> None:
        for name, value in self._constants.items():
            self._unit.set(name, value)
        self._exchange()
        self._unit.initialize(t0)
        self._read()

    def step(self, t: float) -> None:
        self._exchange()
        try:
            self._unit.do_step(t, self._h)
        except InputError as e:
            raise Stopped(f"{self.name} refuses the step from t = {t:g} s: {e}") from None
        self._read()

    def close(self) -> None: ...


class _FusedMember:
    """Neighbours of one period as one graph in the C core: the same values at a fraction of the calls."""

    def __init__(self, system: System, parts: tuple[int, ...], values: C.Array[C.c_double]) -> None:
        first = system.parts[parts[0]]
        graph, outside = fuse(system, parts)
        self.name, self.period, self._h = "+".join(system.parts[k].name for k in parts), first.period, 0.0
        self._h = system.length(first)
        self._executor = graph.executor()
        source = {(link.to, link.input): link.source for link in system.links}
        ports = [p for p in graph.ports if p.kind == "input"]
        self._inputs = [(p.reference, source[end]) for p, end in zip(ports, outside, strict=True) if end in source]
        n = sum(len(system.parts[k].outputs) for k in parts)
        references = [p.reference for p in graph.ports if p.kind == "output"]
        self._outputs = list(zip(range(first.first, first.first + n), references, strict=True))
        self._values = values

    def _exchange(self) -> None:
        try:
            for reference, j in self._inputs:
                self._executor.set(reference, self._values[j])
        except InputError as e:
            raise Stopped(f"{self.name} refuses its inputs: {e}") from None

    def _read(self) -> None:
        get, values = self._executor.get, self._values
        for j, reference in self._outputs:
            values[j] = get(reference)

    def start(self, t0: float) -> None:
        self._exchange()
        self._executor.start(t0)
        self._read()

    def step(self, t: float) -> None:
        self._exchange()
        self._executor.step(t + self._h, self._h)
        self._read()

    def close(self) -> None: ...


def simulate(system: System, engine: Engine = "fmpy", store: FmuStore | None = None) -> Trace:
    """Run a case from t = 0 to its end.

    Parameters
    ----------
    system : System
    engine : {"fmpy", "python", "native"}
        "fmpy": every unit as its `as` says (the reference); "python": all as Python units; "native": neighbours of one
        rate fused into one graph in the C core.  All give the same bits.
    store : FmuStore, optional
        Where FMUs are unpacked; a temporary one by default.

    Raises
    ------
    Stopped
        A unit refused an input or a step; the message names it and the time.
    """
    if engine == "fmpy" and store is None:
        with FmuStore() as own:
            return simulate(system, engine, own)
    values = (C.c_double * max(system.n_values, 1))(*system.starts())
    sources: dict[int, list[tuple[int, int]]] = {}
    for link in system.links:
        sources.setdefault(link.to, []).append((link.input, link.source))
    members: list[_Member] = []
    try:
        if engine == "native":
            members += [_FusedMember(system, group, values) for group in segments(system)]
        else:
            for k, part in enumerate(system.parts):
                if engine == "python" or part.runs_as == "python":
                    members.append(_UnitMember(system, part, sources.get(k, ()), values))
                else:
                    assert store is not None
                    members.append(_FmuMember(system, part, sources.get(k, ()), values, store))
        return _loop(system, members, values)
    finally:
        for m in members:
            m.close()


def _loop(system: System, members: Sequence[_Member], values: C.Array[C.c_double]) -> Trace:
    times = system.times()
    t = times.tolist()
    now = np.ctypeslib.as_array(values)[: system.n_values]
    record = np.empty((len(t), system.n_values))
    for m in members:
        m.start(0.0)
    record[0] = now
    # who steps at fine step n depends on n modulo the least common multiple of the periods
    cycle = math.lcm(*{m.period for m in members})
    known: dict[tuple[bool, ...], list[tuple[Callable[[float], None], int]]] = {}
    due = []
    for k in range(min(cycle, len(t))):
        who = tuple(k % m.period == 0 for m in members)
        due.append(known.setdefault(who, [(m.step, m.period) for m, on in zip(members, who, strict=True) if on]))
    for n in range(1, len(t)):
        for step, period in due[n % cycle]:
            step(t[n - period])
        record[n] = now
    if not np.isfinite(record).all():
        row = int(np.argwhere(~np.isfinite(record).all(axis=1))[0][0])
        raise Stopped(f"values that are not finite at t = {t[row]:g} s")
    return Trace(times, record, system.columns, system.case.ripple)
