"""A graph of blocks loaded into the C core: set, get, start, step, run, and its whole state."""

from __future__ import annotations

import ctypes as C

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.core.library import RawError, library


def _message(error: RawError) -> str:
    text = C.create_string_buffer(512)
    library().hyst_message(C.byref(error), text, len(text))
    return text.value.decode(errors="replace")


def _raise(error: RawError) -> None:
    raise InputError(_message(error))


class Executor:
    """A graph of blocks in the C core, made from the bytes of a block file; the caller's memory, no globals.

    Parameters
    ----------
    file : bytes
        A block file as `hystfmu.graph.graph.Graph.to_bytes` writes it.

    Raises
    ------
    InputError
        If the file is damaged, a value is out of range, or the blocks form an algebraic loop.
    """

    def __init__(self, file: bytes) -> None:
        lib, error, size = library(), RawError(), C.c_size_t()
        if lib.hyst_graph_measure(file, len(file), C.byref(size), C.byref(error)):
            _raise(error)
        self._memory = (C.c_double * ((size.value + 15) // 8 + 2))()  # 16-byte alignment is not needed by doubles
        handle = C.c_void_p()
        if lib.hyst_graph_open(
            file, len(file), C.byref(self._memory), C.sizeof(self._memory), C.byref(handle), C.byref(error)
        ):
            _raise(error)
        self._lib, self._g = lib, handle
        n = C.c_int64()
        state = lib.hyst_graph_state(handle, C.byref(n))
        self._state: Array = np.ctypeslib.as_array(state, (n.value,)) if n.value else np.zeros(0)

    def _check(self, status: int) -> None:
        if status:
            _raise(self._lib.hyst_graph_error(self._g).contents)

    @property
    def handle(self) -> C.c_void_p:
        """The graph as the functions of the core take it."""
        return self._g

    def error(self) -> str:
        """What the core refused last."""
        return _message(self._lib.hyst_graph_error(self._g).contents)

    def get(self, reference: int) -> float:
        """The value behind a value reference."""
        return float(self._lib.hyst_graph_value(self._g, reference)[0])

    def set(self, reference: int, value: float) -> None:
        """Set a parameter or an input; refuses values out of range."""
        self._check(self._lib.hyst_graph_set(self._g, reference, value))

    def defaults(self) -> None:
        """Parameters and inputs as in the block file."""
        self._lib.hyst_graph_defaults(self._g)

    def start(self, t: float) -> None:
        """States from the parameters, then the outputs for the present inputs."""
        self._check(self._lib.hyst_graph_start(self._g, t))

    def step(self, t_end: float, dt: float) -> None:
        """One step of length `dt` to `t_end` with the present inputs."""
        self._check(self._lib.hyst_graph_step(self._g, t_end, dt))

    def run(self, u: Array, n_outputs: int, h: float, t0: float = 0.0) -> Array:
        """Rows `u` (n, number of inputs), `h` seconds apart, from a fresh start; returns (n, n_outputs)."""
        u = np.ascontiguousarray(u, dtype=np.float64)
        y = np.empty((len(u), n_outputs))
        self._check(self._lib.hyst_graph_run(self._g, len(u), t0, h, u.ctypes.data, y.ctypes.data))
        return y

    def slopes(self, t: float, du: Array, n_outputs: int) -> Array:
        """Change of the outputs at `t` (s) for a change of the inputs; nothing else changes."""
        n = self._lib.hyst_graph_n_continuous(self._g)
        seeds, dy, room = np.ascontiguousarray(du), np.empty(n_outputs), np.zeros(2 * n + len(self._state))
        dx, ddx, memory = room[:n], room[n : 2 * n], room[2 * n :]
        places = [a.ctypes.data for a in (seeds, dx, dy, ddx, memory)]
        self._lib.hyst_graph_tangent_between(self._g, t, *places)
        return dy

    @property
    def state(self) -> Array:
        """A copy of everything that a run changes, flat (n,); assign it to go back to that point."""
        return self._state.copy()

    @state.setter
    def state(self, value: Array) -> None:
        self._state[:] = value
