"""Continuous-time form of a graph for a Model Exchange solver: evaluate, derivatives, commit, sample."""

from __future__ import annotations

import ctypes as C
import functools

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.core.executor import Executor
from hystfmu.core.library import library


@functools.cache
def _declared() -> C.CDLL:
    lib = library()
    lib.hyst_graph_continuous.argtypes = [C.c_void_p, C.c_int64]
    lib.hyst_graph_continuous.restype = C.POINTER(C.c_double)
    lib.hyst_graph_is_sampled.argtypes = [C.c_void_p]
    lib.hyst_graph_evaluate.argtypes = [C.c_void_p, C.c_double]
    lib.hyst_graph_evaluate.restype = None
    lib.hyst_graph_derivatives.argtypes = [C.c_void_p, C.c_void_p]
    lib.hyst_graph_derivatives.restype = None
    lib.hyst_graph_commit.argtypes = [C.c_void_p, C.c_double]
    lib.hyst_graph_commit.restype = None
    lib.hyst_graph_tangent.argtypes = [C.c_void_p] * 5
    lib.hyst_graph_tangent.restype = None
    lib.hyst_graph_sample.argtypes = [C.c_void_p, C.c_double, C.c_double]
    return lib


class ContinuousExecutor(Executor):
    """An `Executor` whose continuous states belong to the caller; see `fmu_build/core/graph/continuous.h`.

    Call `start` first.  Then set inputs and `x`, call `evaluate`, and read outputs and `derivatives`, as often as the
    solver needs.  Call `commit` on each accepted step and `sample` once per sample period.

    Parameters
    ----------
    file : bytes
        A block file.

    Raises
    ------
    InputError
        Raised as by `Executor`.
    """

    def __init__(self, file: bytes) -> None:
        super().__init__(file)
        lib = _declared()
        self._places = [lib.hyst_graph_continuous(self._g, k) for k in range(lib.hyst_graph_n_continuous(self._g))]

    @property
    def is_sampled(self) -> bool:
        """True if the graph has a block that advances at sample times only."""
        return bool(self._lib.hyst_graph_is_sampled(self._g))

    @property
    def x(self) -> Array:
        """Copy of the continuous states, shape (n,); assignment sets them."""
        return np.array([place[0] for place in self._places])

    @x.setter
    def x(self, value: Array) -> None:
        for place, v in zip(self._places, value, strict=True):
            place[0] = v

    def evaluate(self, t: float) -> None:
        """Evaluate the outputs at time `t` (s) for the present inputs and continuous states; memories do not change."""
        self._lib.hyst_graph_evaluate(self._g, t)

    def derivatives(self) -> Array:
        """Return the derivatives of `x` (1/s), shape (n,), at the point of the last `evaluate`."""
        dx = np.empty(len(self._places))
        self._lib.hyst_graph_derivatives(self._g, dx.ctypes.data)
        return dx

    def tangent(self, du: Array, dx: Array, n_outputs: int) -> tuple[Array, Array]:
        """Tangent at the point of the last `evaluate`: exact, one-sided at kinks.

        Parameters
        ----------
        du : array, shape (n_inputs,)
            Seeds of the inputs of the graph.
        dx : array, shape (n,)
            Seeds of `x`.
        n_outputs : int
            Number of scalar outputs.

        Returns
        -------
        dy : array, shape (n_outputs,)
            Tangent of the outputs.
        ddx : array, shape (n,)
            Tangent of the derivatives.
        """
        du, dx = np.ascontiguousarray(du, dtype=np.float64), np.ascontiguousarray(dx, dtype=np.float64)
        dy, ddx = np.empty(n_outputs), np.empty(len(self._places))
        pointers = [a.ctypes.data for a in (du, dx, dy, ddx)]
        self._lib.hyst_graph_tangent(self._g, *pointers)
        return dy, ddx

    def commit(self, t: float) -> None:
        """Evaluate at `t` (s) and update the hysteretic memories with their inputs."""
        self._lib.hyst_graph_commit(self._g, t)

    def sample(self, t: float, dt: float) -> None:
        """Evaluate at `t` (s), advance the sampled blocks by `dt` (s), then evaluate all outputs."""
        self._check(self._lib.hyst_graph_sample(self._g, t, dt))
