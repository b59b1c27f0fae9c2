"""Units for the master in C: graphs of the core, and foreign FMUs with their function pointers."""

from __future__ import annotations

import ctypes as C
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.core.executor import Executor
from hystfmu.scenario.engine.adapted_member import fmu_member
from hystfmu.scenario.engine.fmu_member import n_states, state_hash
from hystfmu.scenario.engine.member import weights
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.fused import fuse
from hystfmu.scenario.system.system import System

_GRAPH, _FMI2, _FMI3 = 0, 1, 2  # as in system.h


class Unit(C.Structure):
    """`master_unit` of system.h."""

    _fields_ = (
        ("kind", C.c_int32),
        ("rollback", C.c_int32),
        ("any_step", C.c_int64),
        ("period", C.c_int64),
        ("substeps", C.c_int64),
        ("h", C.c_double),
        ("self", C.c_void_p),
        ("set", C.c_void_p),
        ("step", C.c_void_p),
        ("get", C.c_void_p),
        ("save", C.c_void_p),
        ("restore", C.c_void_p),
        ("tangent", C.c_void_p),
        ("n_in", C.c_int64),
        ("n_out", C.c_int64),
        ("first", C.c_int64),
        ("source", C.c_void_p),
        ("u", C.c_void_p),
        ("vr_in", C.c_void_p),
        ("vr_out", C.c_void_p),
        ("n_vr_in", C.c_int64),
        ("n_vr_out", C.c_int64),
        ("ahead", C.c_void_p),
        ("line", C.c_void_p),
        ("at", C.c_void_p),
        ("saved", C.c_void_p),
        ("state", C.c_void_p),
        ("seeds", C.c_void_p),
        ("t", C.c_double),
    )


class GraphUnit:
    """Units in one graph, with the calls, and the indices of inputs and outputs."""

    def __init__(self, system: System, parts: tuple[int, ...]) -> None:
        first = system.parts[parts[0]]
        graph, outside = fuse(system, parts, own=True)
        self._parts = {system.parts[k].name: system.parts[k].own for k in parts}
        self.name = "+".join(system.parts[k].name for k in parts)
        self.period, self.first, self._any_step = first.period, first.first, first.any_step
        self.substeps, self.h = first.substeps, system.length(first) / first.substeps
        self._hold = first.hold
        self._has_tangent = system.newton and parts[0] in system.loops()
        self.executor: Executor = graph.executor()
        source = {(link.to, link.input): link.source for link in system.links}
        into = {(link.to, link.input): link for link in system.links}
        inputs = [p.reference for p in graph.ports if p.kind == "input"]
        linked = [(r, source[end]) for r, end in zip(inputs, outside, strict=True) if end in source]
        self.vr_in = np.array([r for r, _ in linked], dtype=np.uint32)
        self.source = np.array([j for _, j in linked], dtype=np.int64)
        self._ahead = weights(system, [into[end] for end in outside if end in source])
        self.vr_out = np.array([p.reference for p in graph.ports if p.kind == "output"], dtype=np.uint32)
        self.parameters = {(graph.nodes[p.node].name, p.var.name): p.reference for p in graph.ports if p.is_parameter}

    def start(self, values: C.Array[C.c_double]) -> None:
        """Initialise at t = 0 with the present values, and write the first outputs."""
        try:
            for reference, j in zip(self.vr_in.tolist(), self.source.tolist(), strict=True):
                self.executor.set(reference, values[j])
        except InputError as e:
            raise Stopped(f"{self.name} refuses its inputs: {e}") from None
        self.executor.start(0.0)
        values[self.first : self.first + len(self.vr_out)] = [self.executor.get(r) for r in self.vr_out.tolist()]

    def raw(self, values: C.Array[C.c_double]) -> tuple[Unit, list[Any]]:
        """Return the structure for C, and the arrays that must exist during the run. All units are initialised."""
        at = np.zeros(len(self.vr_in) + len(self.vr_out), dtype=np.uint64)
        saved = self.executor.state
        keep: list[Any] = [at, saved, self.vr_in, self.vr_out, self.source]
        unit = Unit(
            kind=_GRAPH,
            any_step=self._any_step,
            period=self.period,
            substeps=self.substeps,
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
        if self._has_tangent:
            room = np.empty(4 * len(saved))  # a state holds inputs and continuous states
            unit.seeds = room.ctypes.data
            keep.append(room)
        if self._hold == "first":
            keep += _straight(unit, self.source.tolist(), self._ahead, values)
        return unit, keep

    def state_hashes(self) -> dict[str, str]:
        """Return the hash of the present states of every unit in the graph."""
        found, skip, state = dict[str, str](), 0, self.executor.state
        for name, graph in self._parts.items():
            found[name] = state_hash(graph, state, skip)
            skip += n_states(graph)
        return found

    def forget(self, unit: Unit) -> None:
        """Free nothing after a run."""

    def why(self) -> str:
        """Last error of the core."""
        return self.executor.error()

    def close(self) -> None:
        """Free nothing, because the next run uses the same graph."""


def _straight(unit: Unit, source: list[int], ahead: list[float], values: C.Array[C.c_double]) -> list[Array]:
    """Set inputs on straight lines for a unit. The lines start with the present values.

    Return the arrays that must exist during the run.
    """
    now = [values[j] if j >= 0 else 0.0 for j in source]
    line, weight = np.array(5 * now), np.array(ahead)
    unit.ahead, unit.line = weight.ctypes.data, line.ctypes.data
    return [line, weight]


class ForeignUnit:
    """A foreign FMU. fmpy makes and initialises a new instance; the master calls the functions of this instance."""

    def __init__(self, system: System, part: int, values: C.Array[C.c_double]) -> None:
        p = system.parts[part]
        sources = [(link.input, link.source) for link in system.links if link.to == part]
        self.name, self.period, self.first = p.name, p.period, p.first
        self.substeps, self.h = p.substeps, system.length(p) / p.substeps
        self._hold = p.hold
        links = {link.source: link for link in system.links if link.to == part}
        self._ahead = {j: weights(system, [link])[0] for j, link in links.items()}
        self._n_out = len(p.outputs)
        self._member = fmu_member(system, p, sources, values, None, C.c_double())

    def start(self, values: C.Array[C.c_double]) -> None:
        """Initialise at t = 0 with the present values, and write the first outputs."""
        self._member.start(0.0)

    def raw(self, values: C.Array[C.c_double]) -> tuple[Unit, list[Any]]:
        """Return the structure for C, and the arrays that must exist during the run. All units are initialised."""
        call = self._member.calls()
        u, source = np.array(call.inputs), np.array(call.source, dtype=np.int64)
        names = ("set", "step", "get", "save", "restore")
        unit = Unit(
            kind=_FMI3 if call.fmi3 else _FMI2,
            rollback=call.rollback,
            any_step=self._member.any_step,
            period=self.period,
            substeps=self.substeps,
            h=self.h,
            self=call.component,
            n_in=len(source),
            n_out=self._n_out,
            first=self.first,
            source=source.ctypes.data,
            u=u.ctypes.data,
            vr_in=C.addressof(call.vr_in),
            vr_out=C.addressof(call.vr_out),
            n_vr_in=len(call.vr_in),
            n_vr_out=len(call.vr_out),
            tangent=call.tangent,
            **dict(zip(names, call.functions, strict=False)),
        )
        keep: list[Any] = [u, source, call]
        if self._hold == "first":
            keep += _straight(unit, call.source, [self._ahead.get(j, 0.0) for j in call.source], values)
        return unit, keep

    def forget(self, unit: Unit) -> None:
        """Free the state that the master saved last."""
        if unit.state:
            self._member.free_state(unit.state)

    def why(self) -> str:
        """Last log message."""
        return self._member.said

    def close(self) -> None:
        """Free the instance."""
        self._member.close()
