"""A second master loop, in Python: it steps the graph of every unit alone, and must have the bits of the master in C.

It reads the order, the links, the grid and the events of a system. Everything else, from the coupling to the divided
steps, is written here again. It knows no foreign FMU.
"""

import ctypes as C
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.core.library import library
from hystfmu.scenario.outcome.trace import Sweeps, Trace
from hystfmu.scenario.system.events import cuts
from hystfmu.scenario.system.system import System, fuse


class Member:
    """One unit with its inputs, its step and its outputs."""

    def __init__(self, system: System, k: int, values: Array) -> None:
        self.part, self.values, self.k = system.parts[k], values, k
        graph, outside = fuse(system, (k,), own=True)
        self.unit, self.h = graph.executor(), system.length(self.part) / self.part.substeps
        self.nominal, self.anew, self.t = self.h, False, 0.0
        links = {(n.to, n.input): n for n in system.links}
        inputs = [p.reference for p in graph.ports if p.kind == "input"]
        self.linked = [(r, links[end]) for r, end in zip(inputs, outside, strict=True) if end in links]
        self.places = [n.source for _, n in self.linked]
        self.sources = [links[end].source if end in links else -1 for end in outside]
        self.outputs = [p.reference for p in graph.ports if p.kind == "output"]
        self.own = slice(self.part.first, self.part.first + len(self.outputs))
        late = [system.maker(n).period / self.part.period for _, n in self.linked]
        self.ahead = np.array(
            [1.0 if system.fresh(n) else 1.0 - x for (_, n), x in zip(self.linked, late, strict=True)]
        )
        self.straight = self.part.hold == "first"

    def start(self) -> None:
        self._set(self.values[self.places])
        self.unit.start(0.0)
        self.take()

    def begin(self) -> None:
        self.now = self.before = self.values[self.places]

    def copy(self) -> None:
        new = self.values[self.places]
        if self.straight:
            self.before, self.now, self.anew = new if self.anew else self.now, new, False
        else:
            self._set(new)

    def advance(self) -> None:
        for i in range(self.part.substeps):
            if self.straight:
                end = (i + 1) / self.part.substeps
                self._set(self.now + (self.now - self.before) * (end - self.ahead))
            self.last = self.t + i * self.h + self.h
            self.unit.step(self.last, self.h)

    def take(self) -> None:
        self.values[self.own] = [self.unit.get(r) for r in self.outputs]

    def turn(self) -> None:
        self.copy()
        self.advance()
        self.take()

    def stretch(self, h: float | None) -> None:
        self.h, self.anew = self.nominal if h is None else h / self.part.substeps, True

    def save(self) -> None:
        self.kept = self.unit.state, getattr(self, "now", None), getattr(self, "before", None), self.anew

    def restore(self) -> None:
        self.unit.state, self.now, self.before, self.anew = self.kept

    def tangent(self, du: list[float]) -> Array:
        return self.unit.tangent_between(self.last, np.array(du), len(self.outputs))

    def _set(self, u: Array) -> None:
        for (reference, _), v in zip(self.linked, u.tolist(), strict=True):
            self.unit.set(reference, v)


class Newton:
    """Newton's method for one step: tangents from unit to unit, with the matrix of the C core."""

    def __init__(self, system: System, due: Sequence[Member], values: Array) -> None:
        self.due, self.values, self.early, self.loops = due, values, system.early(), system.loops()
        n, steps = len(self.early), {m.k for m in due}
        self.steps = [k in steps for k in system.makers().tolist()]
        self.J, self.H, self.change, self.room = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty(2 * n)
        self.lib, self.n = library(), C.c_int64(n)

    def start(self, begin: Array, guess: Array) -> bool:
        for c, steps in enumerate(self.steps):
            d, read = np.zeros_like(self.values), begin.copy()
            read[self.early], d[self.early[c]] = guess, float(steps)
            for m in self.due:
                du = [float(d[j]) if j >= 0 else 0.0 for j in m.sources]
                along = sum(v * float(read[j] - begin[j]) for j, v in zip(m.sources, du, strict=True) if v)
                d[m.own] = 0.0
                if m.k in self.loops and any(du) and m.outputs:
                    sign = -1.0 if along < 0 else 1.0
                    d[m.own] = sign * m.tangent([sign * v for v in du])
                read[m.own] = self.values[m.own]
            self.J[:, c] = d[self.early]
        return not self.lib.newton_start(self.n, _at(self.J), _at(self.H))

    def step(self, residual: Array) -> Array:
        self.lib.newton_step(self.n, _at(self.H), _at(residual), _at(self.change))
        return self.change

    def learn(self, before: Array, now: Array) -> None:
        self.lib.newton_learn(self.n, *[_at(a) for a in (self.H, self.change, before, now, self.room)])


def _at(a: Array) -> C.c_void_p:
    return C.c_void_p(a.ctypes.data)


def run(system: System) -> Trace:
    """Simulate a case without foreign FMUs."""
    values = system.starts()
    members = [Member(system, k, values) for k in range(len(system.parts))]
    for m in members:
        m.start()
    for m in members:
        m.begin()
    sweeps, pieces = Sweeps(), dict[int, list[float]]()
    for n, end in zip(*(a.tolist() for a in cuts(system)), strict=True):
        pieces.setdefault(n, []).append(end)
    t, rows = system.times(0, system.n_steps + 1), [values.copy()]
    for n in range(1, system.n_steps + 1):
        due = [m for m in members if n % m.part.period == 0]
        for m in due:
            m.t = float(t[n - m.part.period])
        if n in pieces:
            cut = [m for m in members if m.part.any_step]
            for begin, end in pairwise([float(t[n - 1]), *pieces[n], float(t[n])]):
                for m in cut:
                    m.t = begin
                    m.stretch(end - begin)
                _step(system, due if end == t[n] else cut, values, sweeps)
            for m in cut:
                m.stretch(None)
        else:
            _step(system, due, values, sweeps)
        rows.append(values.copy())
    return Trace(t, np.array(rows), system.columns, system.case.ripple, sweeps=sweeps)


def _step(system: System, due: Sequence[Member], values: Array, sweeps: Sweeps) -> None:
    spec, early = system.case.coupling, system.early()
    calls: dict[str, Sequence[Callable[[Member], None]]] = {"jacobi": (Member.copy, Member.advance, Member.take)}
    if spec.scheme != "iterative":
        for call in calls.get(spec.scheme, (Member.turn,)):
            for m in due:
                call(m)
        return
    newton = Newton(system, due, values) if system.newton else None
    for m in due:
        m.save()
    begin, guess, relax, steep = values.copy(), values[early], 1.0, False
    last = guess
    for k in range(spec.max_sweeps):
        if k:
            for m in due:
                m.restore()
            values[:] = begin
            values[early] = guess
        for m in due:
            m.turn()
        sweeps.add(Sweeps(1, k + 1, k == 0))
        out = values[early]
        residual = out - guess
        if (np.abs(residual) <= spec.tolerance * (1 + np.abs(out))).all():
            return
        if k == 0:
            steep = newton is not None and newton.start(begin, guess)
        elif steep and newton is not None:
            newton.learn(last, residual)
        else:  # relaxation of a vector (Irons & Tuck 1969)
            along = square = 0.0
            for a, b in zip(last.tolist(), residual.tolist(), strict=True):
                along, square = along + a * (b - a), square + (b - a) * (b - a)
            relax = -relax * along / square if square > 0 else relax
        change = newton.step(residual) if steep and newton is not None else relax * residual
        guess, last = guess + change, residual
    raise AssertionError("the sweeps do not agree")
