"""Direct calls of a block's C functions on guarded arrays, a reference for graph and executor."""

import ctypes as C
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystfmu.core.library import library
from hystfmu.graph import Node

Array = NDArray[np.float64]
GUARD, MARK = 16, 6.02214076e23


def _guarded(n: int) -> tuple[Array, Array]:
    whole = np.full(n + 2 * GUARD, MARK)
    return whole, whole[GUARD : GUARD + n]


def _pointer(a: Array) -> "C._Pointer[C.c_double]":
    return a.ctypes.data_as(C.POINTER(C.c_double))


def function(name: str, *arguments: Any, result: Any = C.c_int) -> Any:
    """A function of the core with its own argument types: those of the binding belong to the whole process."""
    found = C.CDLL(library()._name)[name]
    found.argtypes, found.restype = arguments, result
    return found


class Raw:
    """Flat arrays p, u, y, x, dx of a node, each between guard values."""

    def __init__(self, node: Node) -> None:
        self.node, self.c = node, node.block.raw
        self.dims = (C.c_int * (len(node.dims) + 1))(*[node.dims[d.name] for d in node.block.dims])
        groups = {
            "p": ("param", "fixed", "derived"), "u": ("input", "time"), "y": ("output",), "x": ("cstate", "state"),
        }  # fmt: skip
        self.places: dict[str, slice] = {}
        self._whole: list[Array] = []
        for attribute, kinds in groups.items():
            at = 0
            for v in node.block.of(*kinds):
                self.places[v.name] = slice(at, at + node.sizes[v.name])
                at += node.sizes[v.name]
            whole, inner = _guarded(at)
            self._whole.append(whole)
            setattr(self, attribute, inner)
            for v in node.block.of(*kinds):
                inner[self.places[v.name]] = v.start
        self.p: Array
        self.u: Array
        self.y: Array
        self.x: Array
        for v in node.block.parameters:
            self.p[self.places[v.name]] = node.value(v.name)
        self.n_cstates = sum(node.sizes[v.name] for v in node.block.of("cstate"))
        whole, self.dx = _guarded(self.n_cstates)
        self._whole.append(whole)
        self.time = [self.places[v.name].start for v in node.block.of("time")]

    def check_guards(self) -> None:
        for whole in self._whole:
            assert (whole[:GUARD] == MARK).all(), "written before an array"
            assert (whole[-GUARD:] == MARK).all(), "written behind an array"

    def prepare(self, dt: float) -> str | None:
        text = self.c.prepare(self.dims, _pointer(self.p), dt) if self.c.prepare else None
        return text.decode() if text else None

    def init(self, mark: float | None = None) -> None:
        """Start values, or a mark in their place, and what the block makes of them."""
        for v in self.node.block.of("cstate", "state"):
            self.x[self.places[v.name]] = v.start if mark is None else mark
        if self.c.init:
            self.c.init(self.dims, _pointer(self.p), _pointer(self.x))

    def update(self, dt: float) -> None:
        if self.c.update:
            self.c.update(self.dims, _pointer(self.p), _pointer(self.x), _pointer(self.u), dt)

    def output(self) -> Array:
        self.c.output(self.dims, _pointer(self.p), _pointer(self.x), _pointer(self.u), _pointer(self.y))
        return self.y.copy()

    def deriv(self) -> Array:
        self.c.deriv(self.dims, _pointer(self.p), _pointer(self.x), _pointer(self.u), _pointer(self.dx))
        return self.dx.copy()

    def tangent(self, du: Array, dx: Array) -> tuple[Array, Array]:
        """Tangent of output and deriv; zero if the block has none."""
        whole_y, dy = _guarded(self.y.size)
        whole_x, ddx = _guarded(self.n_cstates)
        dy[:], ddx[:] = 0.0, 0.0
        if self.c.tangent:
            dy[:], ddx[:] = MARK, MARK
            arrays = (self.p, self.x, self.u, np.ascontiguousarray(du), np.ascontiguousarray(dx), dy, ddx)
            self.c.tangent(self.dims, *map(_pointer, arrays))
            for whole in (whole_y, whole_x):
                assert (whole[:GUARD] == MARK).all(), "written before an array"
                assert (whole[-GUARD:] == MARK).all(), "written behind an array"
        return dy, ddx

    def set_inputs(self, row: Array, t: float) -> None:
        """Inputs in the order of the table, and the time where the block asks for it."""
        mask = np.ones(self.u.size, dtype=bool)
        mask[self.time] = False
        self.u[mask] = row
        self.u[self.time] = t

    def run(self, u: Array, h: float) -> Array:
        """The same rows that `Graph.run` gives: row 0 after initialisation."""
        wrong = self.prepare(0.0)
        assert wrong is None, wrong
        self.init()
        rows = []
        for k, row in enumerate(u):
            dt = h if k else 0.0
            self.set_inputs(row, 0.0 + (k - 1) * h + h if k else 0.0)
            if k == 1:
                self.prepare(h)
            self.update(dt)
            rows.append(self.output())
        self.check_guards()
        return np.array(rows)
