"""Linear filters, e.g. transfer functions, that the C core applies to many columns at once. Fits use them."""

import ctypes as C
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hystfmu.base import Array, Indices, InputError
from hystfmu.core.library import library
from hystfmu.graph.node import Node


class _Raw(C.Structure):
    """The structure `hyst_recursion` of columns.h."""

    _fields_ = [("n", C.c_int64), *((name, C.c_void_p) for name in ("A", "B0", "B1", "c", "start")), ("d", C.c_double)]


@dataclass(frozen=True)
class Recursion:
    """Linear filter v_k = A v_(k-1) + B0 u_(k-1) + B1 u_k, y_k = c v_k + d u_k, with v_0 = start u_0.

    Parameters
    ----------
    A : array, shape (n, n)
        State matrix; n is at most 64.
    B0, B1, c, start : array, shape (n,)
        Vectors of the equations. `start` is the steady state for the input 1.
    d : float
        Direct feed-through.
    """

    A: Array
    B0: Array
    B1: Array
    c: Array
    start: Array
    d: float

    @cached_property
    def _raw(self) -> tuple[_Raw, list[Array]]:
        arrays = [np.ascontiguousarray(v, dtype=np.float64) for v in (self.A, self.B0, self.B1, self.c, self.start)]
        return _Raw(len(self.c), *(v.ctypes.data for v in arrays), float(self.d)), arrays

    def run(self, columns: Array, rows: Indices | None = None) -> Array:
        """Return the filtered `columns` (n, p) in the ascending `rows` (m,), or in all rows; shape (m, p)."""
        u = np.ascontiguousarray(columns, dtype=np.float64)
        picked: NDArray[np.int64] = np.ascontiguousarray(np.arange(len(u)) if rows is None else rows, dtype=np.int64)
        y = np.empty((len(picked), u.shape[1]))
        raw, _ = self._raw
        work = np.empty((2 * len(self.c), u.shape[1]))
        places = u.ctypes.data, len(picked), picked.ctypes.data, y.ctypes.data, work.ctypes.data
        library().hyst_columns_run(C.byref(raw), u.shape[1], *places)
        return y

    def fraction(self) -> tuple[Array, Array]:
        """Return numerator and denominator (n + 1,) of the transfer function in z, with the highest power first."""
        B: Array = self.B0 + self.A @ self.B1
        impulse: list[float] = [self.d + float(self.c @ self.B1), float(self.c @ B)]
        for _ in range(len(self.c) - 1):
            B = self.A @ B
            impulse.append(float(self.c @ B))
        bottom: Array = np.atleast_1d(np.poly(self.A))
        return np.convolve(np.array(impulse), bottom)[: len(bottom)], bottom


def lag(h: float, T: float) -> Recursion:
    """Return the filter of one first-order lag with the time constant T (s) for the step h (s), from steady state."""
    return parallel_lags(-np.expm1(-h / np.array([T])), np.ones(1), 0.0)


def parallel_lags(shares: Array, weights: Array, direct: float = 1.0) -> Recursion:
    """Return the filter with the output d x + sum_j w_j q_j of first-order lags q_j in parallel.

    The lags are q_j[k] = q_j[k - 1] + s_j (x[k] - q_j[k - 1]), with q_j[0] = x[0].

    `shares` (m,) contains the factors s_j, `weights` (m,) the factors w_j, and `direct` is d.
    """
    return Recursion(np.diag(1 - shares), np.zeros(len(shares)), shares, weights, np.ones(len(shares)), direct)


def discretised(node: Node, h: float) -> Recursion:
    """Return the discrete filter of a transfer function block for the step h (s), which starts in steady state.

    Raises
    ------
    InputError
        The block does not accept its parameters for this step, or it has no steady state.
    """
    block, sizes = node.block, node.sizes
    held = block.of("param", "fixed", "derived")
    ends = np.cumsum([sizes[v.name] for v in held])
    p: Array = np.zeros(ends[-1] + 1)
    places = {v.name: p[end - sizes[v.name] : end] for v, end in zip(held, ends, strict=True)}
    for v in block.parameters:
        places[v.name][:] = node.value(v.name)
    wrong = block.raw.prepare(block.raw_dims(node.dims), p.ctypes.data_as(C.POINTER(C.c_double)), h)
    if wrong:
        raise InputError(f"{node.name}: {wrong.decode()}")
    n, last = len(places["c"]), places["alpha"][0]
    if last == 0:
        raise InputError(f"{node.name}: The last coefficient of a must not be 0. Got an integrator.")
    steady: Array = np.zeros(n)
    steady[0] = 1 / last
    A = places["A"].reshape(n, n)
    return Recursion(A, places["B0"], places["B1"], places["c"], steady, float(places["d"][0]))
