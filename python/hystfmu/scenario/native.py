"""Running a case wholly in the C core: the master loop of `fmu_build/master`, without a call into Python per step.

With Gauss-Seidel coupling, neighbours in the order that have the same rate become one graph; otherwise every unit is
one.
The lock of the interpreter is free while it runs: threads run cases in parallel.
"""

from __future__ import annotations

import ctypes as C
import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hystfmu.core import Array, Executor, library
from hystfmu.errors import InputError
from hystfmu.scenario.spec import split_end
from hystfmu.scenario.system import System, changed, fuse, segments
from hystfmu.scenario.trace import Stopped, Trace

_SCHEMES = ("gauss_seidel", "jacobi", "iterative")  # as in master.h
_GRAPH = 0


class _Unit(C.Structure):
    """`master_unit` of master.h."""

    _fields_ = (
        ("kind", C.c_int32),
        ("rollback", C.c_int32),
        ("period", C.c_int64),
        ("h", C.c_double),
        ("self", C.c_void_p),
        ("set", C.c_void_p),
        ("step", C.c_void_p),
        ("get", C.c_void_p),
        ("save", C.c_void_p),
        ("restore", C.c_void_p),
        ("n_in", C.c_int64),
        ("n_out", C.c_int64),
        ("first", C.c_int64),
        ("source", C.c_void_p),
        ("u", C.c_void_p),
        ("vr_in", C.c_void_p),
        ("vr_out", C.c_void_p),
        ("n_vr_in", C.c_int64),
        ("n_vr_out", C.c_int64),
        ("at", C.c_void_p),
        ("saved", C.c_void_p),
        ("state", C.c_void_p),
    )


class _Master(C.Structure):
    """`master` of master.h."""

    _fields_ = (
        ("scheme", C.c_int32),
        ("most_sweeps", C.c_int32),
        ("tolerance", C.c_double),
        ("n_units", C.c_int64),
        ("units", C.c_void_p),
        ("values", C.c_void_p),
        ("n_values", C.c_int64),
        ("n_early", C.c_int64),
        ("early", C.c_void_p),
        ("begin", C.c_void_p),
        ("guess", C.c_void_p),
        ("residual", C.c_void_p),
        ("n_columns", C.c_int64),
        ("columns", C.c_void_p),
        ("row", C.c_int64),
        ("unit", C.c_int64),
        ("sweeps", C.c_int64),
    )


@functools.cache
def _run() -> Any:
    run = library().master_run
    run.argtypes = [C.POINTER(_Master), C.c_int64, C.c_void_p, C.c_void_p]
    return run


class _Member:
    """Units that are one graph: how they are called, and where their inputs and outputs stand."""

    def __init__(self, system: System, parts: tuple[int, ...]) -> None:
        first = system.parts[parts[0]]
        graph, outside = fuse(system, parts)
        self.name = "+".join(system.parts[k].name for k in parts)
        self.period, self.h, self.first = first.period, system.length(first), first.first
        self.executor: Executor = graph.executor()
        source = {(link.to, link.input): link.source for link in system.links}
        inputs = [p.reference for p in graph.ports if p.kind == "input"]
        linked = [(r, source[end]) for r, end in zip(inputs, outside, strict=True) if end in source]
        self.vr_in = np.array([r for r, _ in linked], dtype=np.uint32)
        self.source = np.array([j for _, j in linked], dtype=np.int64)
        self.vr_out = np.array([p.reference for p in graph.ports if p.kind == "output"], dtype=np.uint32)
        self.parameters = {
            (graph.nodes[p.node].name, p.var.name): p.reference for p in graph.ports if p.kind in ("param", "fixed")
        }

    def start(self, values: Array) -> None:
        """Initialise at t = 0 with the present values, and write the first outputs."""
        try:
            for reference, j in zip(self.vr_in.tolist(), self.source.tolist(), strict=True):
                self.executor.set(reference, values[j])
        except InputError as e:
            raise Stopped(f"{self.name} refuses its inputs: {e}") from None
        self.executor.start(0.0)
        values[self.first : self.first + len(self.vr_out)] = [self.executor.get(r) for r in self.vr_out.tolist()]

    def raw(self) -> tuple[_Unit, list[Any]]:
        """For C, with the arrays that must live as long as it runs."""
        at = np.zeros(len(self.vr_in) + len(self.vr_out), dtype=np.uint64)
        saved = self.executor.state
        keep: list[Any] = [at, saved, self.vr_in, self.vr_out, self.source]
        unit = _Unit(
            kind=_GRAPH,
            period=self.period,
            h=self.h,
            self=self.executor.handle,
            n_in=len(self.vr_in),
            n_out=len(self.vr_out),
            first=self.first,
            source=self.source.ctypes.data,
            vr_in=self.vr_in.ctypes.data,
            vr_out=self.vr_out.ctypes.data,
            n_vr_in=len(self.vr_in),
            n_vr_out=len(self.vr_out),
            at=at.ctypes.data,
            saved=saved.ctypes.data,
        )
        return unit, keep


class Native:
    """A case that is ready to run in C, any number of times.

    Parameters
    ----------
    system : System
    columns : sequence of str, optional
        Outputs (`unit.output`) that are recorded; all by default.
    """

    def __init__(self, system: System, columns: Sequence[str] | None = None) -> None:
        self._system = system
        fused = system.case.coupling.scheme == "gauss_seidel"
        groups = segments(system) if fused else [(k,) for k in range(len(system.parts))]
        self._members = [_Member(system, g) for g in groups]
        self._graphs = {p.name: p.graph for p in system.parts}
        self._slots: dict[str, tuple[Executor, int, list[float]]] = {}
        self._names = list(dict.fromkeys(columns)) if columns is not None else list(system.columns)
        self._columns = np.array([system.columns[c] for c in self._names], dtype=np.int64)

    def set(self, values: Mapping[str, Any]) -> None:
        """Parameters for the next runs, instead of those of the last call; all others are those of the scenario.

        Parameters
        ----------
        values : mapping
            ``{"unit.parameter": value}`` with the values that a scenario's `set` takes; ``"*1.2"`` scales.

        Raises
        ------
        InputError
            No such unit or parameter, value out of range.
        """
        for m in self._members:
            m.executor.defaults()
        for key, value in values.items():
            executor, reference, now = self._slot(key)
            if isinstance(value, int | float):
                new = [float(value)] * len(now)
            elif isinstance(value, str) and value.startswith("*"):
                new = [v * float(value[1:]) for v in now]
            else:  # a word or a list
                unit, name = split_end(key, "set")
                new = changed(self._graphs[unit], name, value)[2]
            for k, v in enumerate(new):
                executor.set(reference + k, v)

    def _slot(self, key: str) -> tuple[Executor, int, list[float]]:
        """Where a parameter stands: executor, reference of its first element, values in the scenario."""
        if key not in self._slots:
            unit, name = split_end(key, "set")
            if unit not in self._graphs:
                raise InputError(f"{key}: no unit {unit!r}; there are {', '.join(self._graphs)}")
            port, first, now = changed(self._graphs[unit], name, "*1")
            end = (f"{unit}_{self._graphs[unit].nodes[port.node].name}", port.var.name)
            (member,) = (m for m in self._members if end in m.parameters)
            self._slots[key] = (member.executor, member.parameters[end] + first, now)
        return self._slots[key]

    def run(self) -> Trace:
        """From t = 0 to the end.

        Raises
        ------
        Stopped
            As `simulate`.
        """
        system, coupling, early = self._system, self._system.case.coupling, self._system.early()
        values = system.starts()
        for m in self._members:
            m.start(values)
        made = [m.raw() for m in self._members]
        units = (_Unit * len(made))(*[unit for unit, _ in made])
        begin, guess, residual = np.empty(system.n_values), np.empty(len(early)), np.empty(2 * len(early))
        master = _Master(
            scheme=_SCHEMES.index(coupling.scheme),
            most_sweeps=coupling.most_sweeps,
            tolerance=coupling.tolerance,
            n_units=len(units),
            units=C.addressof(units),
            values=values.ctypes.data,
            n_values=len(values),
            n_early=len(early),
            early=early.ctypes.data,
            begin=begin.ctypes.data,
            guess=guess.ctypes.data,
            residual=residual.ctypes.data,
            n_columns=len(self._columns),
            columns=self._columns.ctypes.data,
        )
        times = system.times()
        record = np.empty((len(times), len(self._columns)))
        if _run()(C.byref(master), len(times) - 1, times.ctypes.data, record.ctypes.data):
            raise self._stopped(master, times)
        return Trace(times, record, {name: k for k, name in enumerate(self._names)}, system.case.ripple)

    def _stopped(self, master: _Master, times: Array) -> Stopped:
        t = times[master.row]
        if master.unit == -1:
            return Stopped(f"values that are not finite at t = {t:g} s")
        if master.unit == -2:
            return Stopped(f"{master.most_sweeps} sweeps at t = {t:g} s do not agree; allow more, or a shorter step")
        m = self._members[master.unit]
        return Stopped(f"{m.name} refuses the step from t = {times[master.row - m.period]:g} s: {m.executor.error()}")


def run_native(system: System) -> Trace:
    """One run, all outputs recorded."""
    return Native(system).run()
