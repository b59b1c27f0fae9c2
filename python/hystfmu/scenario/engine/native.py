"""Simulate a whole case in the C core, by the master loop of `fmu_build/master`, without Python in a step.

With Gauss-Seidel coupling, units that are neighbours in the order and have the same rate are joined to one graph. With
other couplings, every unit is a separate graph. The interpreter lock is released during a run, so that threads can run
cases in parallel.

The units of the master in C are graphs of the core, and foreign FMUs with their function pointers.
"""

import ctypes as C
import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.core.executor import Executor
from hystfmu.core.library import library
from hystfmu.graph import Node
from hystfmu.scenario.engine import member as c_unit
from hystfmu.scenario.engine.member import GRAPH, AdaptedMember, DirectMember, FmuStore, Unit, fields, state_hash
from hystfmu.scenario.outcome.trace import Stopped, Sweeps, Trace
from hystfmu.scenario.system.case import changed, split_end
from hystfmu.scenario.system.events import cuts, in_file
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Part, System, fuse, segments


class GraphUnit:
    """Units that are joined to one graph, with the indices of the inputs and outputs among the values of the system."""

    def __init__(self, system: System, parts: tuple[int, ...]) -> None:
        graph, outside = fuse(system, parts, own=True)
        self._system, self._first = system, parts[0]
        self._parts = {system.parts[k].name: system.parts[k].own for k in parts}
        self.name = "+".join(self._parts)
        self.executor: Executor = graph.executor()
        into = {(link.to, link.input): link for link in system.links}
        inputs, outputs = ([p.reference for p in graph.ports if p.kind == kind] for kind in ("input", "output"))
        linked = [(r, into[end]) for r, end in zip(inputs, outside, strict=True) if end in into]
        self._links = [link for _, link in linked]
        self.vr_in, self.vr_out = (np.array(r, dtype=np.uint32) for r in ([r for r, _ in linked], outputs))
        self.source = np.array([link.source for link in self._links], dtype=np.int64)
        self.parameters = {(graph.nodes[p.node].name, p.var.name): p.reference for p in graph.ports if p.is_parameter}

    def start(self, values: C.Array[C.c_double]) -> None:
        """Initialise at t = 0 with the present values, and write the first outputs."""
        try:
            for reference, j in zip(self.vr_in.tolist(), self.source.tolist(), strict=True):
                self.executor.set(reference, values[j])
        except InputError as e:
            raise Stopped(f"{self.name} reports an error of its inputs: {e}") from None
        self.executor.start(0.0)
        first = self._system.parts[self._first].first
        values[first : first + len(self.vr_out)] = [self.executor.get(r) for r in self.vr_out.tolist()]

    def raw(self, values: C.Array[C.c_double]) -> tuple[Unit, list[Any]]:
        """Return the structure for C, and arrays that must exist during the run. All units must be initialised."""
        at = np.zeros(len(self.vr_in) + len(self.vr_out), dtype=np.uint64)
        rooms: dict[str, np.ndarray[Any, Any]] = {
            "vr_in": self.vr_in,
            "vr_out": self.vr_out,
            "at": at,
            "saved": self.executor.state,
        }
        if self._system.newton and self._first in self._system.loops():
            # a saved state also contains inputs and continuous states
            rooms["seeds"] = np.empty(4 * len(rooms["saved"]))
        sizes = {"n_out": len(self.vr_out), "n_vr_in": len(self.vr_in), "n_vr_out": len(self.vr_out)}
        places = {name: room.ctypes.data for name, room in rooms.items()}
        facts = {"kind": GRAPH, "self": self.executor.handle}
        unit, keep = c_unit.unit_of(
            self._system, self._first, values, self.source, self._links, **sizes, **places, **facts
        )
        return unit, [*keep, rooms]

    def state_hashes(self) -> dict[str, str]:
        """Return the hash of the present states of every unit in the graph."""
        found, skip, state = dict[str, str](), 0, self.executor.state
        for name, graph in self._parts.items():
            found[name] = state_hash(graph, state, skip)
            skip += c_unit.n_states(graph)
        return found

    def forget(self, unit: Unit) -> None:
        """Do nothing after a run, because the next run uses the same graph."""

    def why(self) -> str:
        """Last error of the core."""
        return self.executor.error()

    def close(self) -> None:
        """Do nothing, because the next run uses the same graph."""


_SCHEMES = ("gauss_seidel", "jacobi", "iterative")  # as in system.h


class _Master(C.Structure):
    """`master` of system.h."""

    _fields_ = fields(
        "int32 scheme most_sweeps; double tolerance; int64 n_units; pointer units values; int64 n_values "
        "n_early; pointer early begin guess residual makers newton; int64 n_columns; pointer columns; int64 "
        "n_cuts; pointer cut_rows cuts; double base h; int64 ripple row cut; double now; int64 unit; double "
        "t; int64 sweeps most_in_step steps"
    )


@functools.cache
def _run() -> Any:
    run = library().master_run
    run.argtypes = [C.POINTER(_Master), C.c_int64, C.c_void_p]
    return run


class Native:
    """A case that can be simulated in C any number of times, with the recorded outputs `columns` (default: all).

    If `cut` is True, units whose steps can be divided and other units are in separate graphs. A run with divided steps
    always uses separate graphs for these units. With a `store`, every unit is exported as an FMU into this store, and
    the master calls the FMUs instead of the graphs.
    """

    def __init__(
        self, system: System, columns: Sequence[str] | None = None, cut: bool = False, store: FmuStore | None = None
    ) -> None:
        self._system, self._cut, self._store = system, cut or store is not None, store
        self._given: Mapping[str, Any] = {}
        self._apart: Native | None = None
        fused = system.case.coupling.scheme == "gauss_seidel" and store is None
        self._groups = segments(system, cut) if fused else [(k,) for k in range(len(system.parts))]
        ours = [g for g in self._groups if store is None and not isinstance(system.parts[g[0]].graph, Foreign)]
        self._members = {g[0]: GraphUnit(system, g) for g in ours}
        self._foreign: dict[int, Foreign] = {}
        self._graphs = {p.name: p.own for p in system.parts if not isinstance(p.graph, Foreign)}
        self._slots: dict[str, tuple[Executor, int, list[float]]] = {}
        self._names = list(dict.fromkeys(columns)) if columns is not None else list(system.columns)
        self._early = system.early()
        self._columns = np.array([system.columns[c] for c in self._names], dtype=np.int64)

    def set(self, values: Mapping[str, Any]) -> None:
        """Set the parameters of the next runs, ``{"unit.parameter": value}``.

        A parameter that is not in `values` has the value in the scenario, even if the last call changed this parameter.

        Values have the form of `set` of a scenario; ``"*1.2"`` is a factor. An unknown unit, an unknown parameter or a
        value out of range is an InputError.
        """
        for m in self._members.values():
            m.executor.defaults()
        self._foreign, self._given = {}, dict(values)
        for key, value in values.items():
            if self._set_foreign(key, value):
                continue
            executor, reference, now = self._slot(key)
            if isinstance(value, int | float):
                new = [float(value)] * len(now)
            elif isinstance(value, str) and value.startswith("*"):
                new = [v * float(value[1:]) for v in now]
            else:  # the value is the name of a choice, or a list
                unit, name = split_end(key, "set")
                new = changed(self._graphs[unit], name, value)[2]
            for k, v in enumerate(new):
                executor.set(reference + k, v)

    def _set_foreign(self, key: str, value: Any) -> bool:
        unit, name = split_end(key, "set")
        for k, part in enumerate(self._system.parts):
            if part.name == unit and isinstance(part.graph, Foreign):
                self._foreign[k] = self._foreign.get(k, part.graph).with_settings({name: value})
                return True
        return False

    def _slot(self, key: str) -> tuple[Executor, int, list[float]]:
        """Return for a parameter the executor of its graph, the value reference, and the values in the scenario."""
        if key not in self._slots:
            unit, name = split_end(key, "set")
            if unit not in self._graphs:
                raise InputError(f"{key}: no unit {unit!r}; there are {', '.join(self._graphs)}")
            port, first, now = changed(self._graphs[unit], name, "*1")
            end = (f"{unit}_{self._graphs[unit].nodes[port.node].name}", port.var.name)
            (member,) = (m for m in self._members.values() if end in m.parameters)
            self._slots[key] = (member.executor, member.parameters[end] + first, now)
        return self._slots[key]

    def _present(self, part: Part, node: Node, name: str) -> Array:
        """Return the present values of a parameter of a block."""
        end = (f"{part.name}_{node.name}", name)
        (member,) = (m for m in self._members.values() if end in m.parameters)
        first = member.parameters[end]
        return np.array([member.executor.get(first + k) for k in range(node.sizes[name])])

    def run(self) -> Trace:
        """Return the whole run as one trace."""
        return Trace.joined(self.chunks(), self._system.n_steps + 1)

    def chunks(self) -> Iterator[Trace]:
        """Simulate from t = 0 to the end, and yield chunks of rows. Too many events raise an InputError."""
        system = self._system
        cut = cuts(system, self._present if self._store is None else in_file)
        if len(cut[0]) and not self._cut:
            if self._apart is None:
                self._apart = Native(system, self._names, cut=True)
            self._apart.set(self._given)
            yield from self._apart.chunks()
            return
        if self._foreign:
            parts = [replace(p, graph=self._foreign.get(k, p.graph)) for k, p in enumerate(system.parts)]
            system = replace(system, parts=tuple(parts))
        values = (C.c_double * max(system.n_values, 1))(*system.starts())
        units: list[GraphUnit | DirectMember | AdaptedMember] = []
        try:
            for k, *_ in self._groups:
                units.append(self._members.get(k) or c_unit.fmu_member(system, k, self._store))
            for u in units:
                u.start(values)
            yield from self._chunks(system, units, values, cut)
        finally:
            for u in units:
                u.close()

    def _chunks(
        self,
        system: System,
        members: list[GraphUnit | DirectMember | AdaptedMember],
        values: C.Array[C.c_double],
        cut: tuple[Array, Array],
    ) -> Iterator[Trace]:
        coupling, early = system.case.coupling, self._early
        made = [m.raw(values) for m in members]
        units = (Unit * len(made))(*[unit for unit, _ in made])
        n = len(early)
        begin, guess, residual = np.empty(system.n_values), np.empty(n), np.empty(2 * n)
        widest = max(unit.n_in for unit, _ in made)
        newton, makers = np.empty(2 * system.n_values + widest + n * (2 * n + 3)), system.makers()
        arrays = early, begin, guess, residual, makers, self._columns, *cut
        named = "early", "begin", "guess", "residual", "makers", "columns", "cut_rows", "cuts"
        places = {name: array.ctypes.data for name, array in zip(named, arrays, strict=True)}
        places |= {"units": C.addressof(units), "values": C.addressof(values)}
        places |= {"newton": newton.ctypes.data} if system.newton else {}
        sizes = {"n_units": len(units), "n_values": system.n_values, "n_early": n}
        sizes |= {"n_columns": len(self._columns), "n_cuts": len(cut[0])}
        rule = {"scheme": _SCHEMES.index(coupling.scheme), "most_sweeps": coupling.max_sweeps}
        time = {"base": system.case.step, "h": system.h, "ripple": system.case.ripple}
        master = _Master(tolerance=coupling.tolerance, **rule, **time, **sizes, **places)
        places, run = {name: k for k, name in enumerate(self._names)}, _run()
        try:
            for first, end in system.chunks():
                record = np.empty((end - first, len(self._columns)))
                if run(C.byref(master), end - first, record.ctypes.data):
                    raise self._stopped(master, members)
                hashes: dict[str, str] = {}
                if system.case.final_states and end > system.n_steps:
                    for m in members:
                        hashes |= {} if isinstance(m, AdaptedMember) else m.state_hashes()
                sweeps = Sweeps(master.sweeps, master.most_in_step, master.steps)
                master.sweeps = master.most_in_step = master.steps = 0
                yield Trace(system.times(first, end), record, places, system.case.ripple, hashes, first, sweeps)
        finally:
            for m, unit in zip(members, units, strict=True):
                m.forget(unit)

    @staticmethod
    def _stopped(master: _Master, members: list[GraphUnit | DirectMember | AdaptedMember]) -> Stopped:
        t = master.t
        if master.unit == -1:
            return Stopped(f"values that are not finite at t = {t:g} s")
        if master.unit == -2:
            return Stopped(
                f"{master.most_sweeps} sweeps at t = {t:g} s do not converge; increase max_sweeps, or reduce the step"
            )
        m = members[master.unit]
        return Stopped(f"{m.name} refuses the step from t = {t:g} s: {m.why()}")
