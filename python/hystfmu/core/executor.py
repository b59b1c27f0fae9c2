"""Executors that run a graph in the C core: `Executor` in discrete time, `ContinuousExecutor` in continuous time.

The continuous-time executor has the functions that a solver of FMI Model Exchange needs.
"""

import ctypes as C

import numpy as np
from numpy.typing import NDArray

from hystfmu.base import Array, Indices, InputError
from hystfmu.core.library import RawError, library


def _message(error: RawError) -> str:
    text = C.create_string_buffer(512)
    library().hyst_message(C.byref(error), text, len(text))
    return text.value.decode(errors="replace")


SEED = np.dtype([("parameter", np.int64), ("column", np.int64), ("size", np.float64)])
"""Value reference of a parameter, and derivative of this parameter with respect to the variable of a column.

The structure is `hyst_seed` of sensitivity.h.
"""


class _Sensitivity(C.Structure):
    """The structure `hyst_sensitivity` of sensitivity.h."""

    _fields_ = [
        *((name, C.c_int64) for name in ("n_columns", "n_seeds", "n_picked")),
        *((name, C.c_void_p) for name in ("seeds", "picked")),
        ("step", C.c_double),
        *((name, C.c_void_p) for name in ("y", "dy")),
    ]


class Executor:
    """An instance of a graph of blocks in the C core, created from the bytes of a block file (`Graph.to_bytes`).

    This object owns all memory of the instance; the core has no global variables.

    Raises
    ------
    InputError
        The file is damaged, a value is out of range, or the blocks form an algebraic loop.
    """

    def __init__(self, file: bytes) -> None:
        lib, error, size = library(), RawError(), C.c_size_t()
        if lib.hyst_graph_measure(file, len(file), C.byref(size), C.byref(error)):
            raise InputError(_message(error))
        self._memory = (C.c_double * ((size.value + 15) // 8 + 2))()  # doubles do not need 16-byte alignment
        handle = C.c_void_p()
        if lib.hyst_graph_open(
            file, len(file), C.byref(self._memory), C.sizeof(self._memory), C.byref(handle), C.byref(error)
        ):
            raise InputError(_message(error))
        self._lib, self._g = lib, handle
        n = C.c_int64()
        state = lib.hyst_graph_state(handle, C.byref(n))
        self._state: Array = np.ctypeslib.as_array(state, (n.value,)) if n.value else np.zeros(0)

    def _check(self, status: int) -> None:
        if status:
            raise InputError(self.error())

    @property
    def handle(self) -> C.c_void_p:
        """Pointer to the instance, for calls of C functions."""
        return self._g

    def error(self) -> str:
        """Return the message of the last error in the C core."""
        return _message(self._lib.hyst_graph_error(self._g).contents)

    def get(self, reference: int) -> float:
        """Return the value of the variable with the value reference `reference`."""
        return float(self._lib.hyst_graph_value(self._g, reference)[0])

    def view(self, reference: int, size: int) -> Array:
        """Return the present values, shape (size,), of the variable with the value reference `reference`, to read."""
        return np.ctypeslib.as_array(self._lib.hyst_graph_value(self._g, reference), (size,))

    def set(self, reference: int, value: float) -> None:
        """Set the parameter or the input with the value reference `reference`.

        Raises
        ------
        InputError
            The value is out of range.
        """
        self._check(self._lib.hyst_graph_set(self._g, reference, value))

    def defaults(self) -> None:
        """Set all parameters and inputs to the values in the block file."""
        self._lib.hyst_graph_defaults(self._g)

    def start(self, t: float) -> None:
        """Initialise the states at time `t` (s), then compute the outputs for the present inputs."""
        self._check(self._lib.hyst_graph_start(self._g, t))

    def step(self, t_end: float, dt: float) -> None:
        """Compute one step of length `dt` (s) that ends at `t_end` (s), with the present inputs."""
        self._check(self._lib.hyst_graph_step(self._g, t_end, dt))

    def end_of_step(self, start: float, t: float, h: float) -> float:
        """Return the end time (s) of a step of length `h` that begins at `t`, without accumulated rounding errors.

        `start` is the time of the first step (s).
        """
        return float(self._lib.hyst_graph_end_of_step(self._g, start, t, h))

    def run(self, u: Array, n_outputs: int, h: float, t0: float = 0.0) -> Array:
        """Return the outputs (n, n_outputs) for input rows u (n, n_inputs), from the initial state.

        The rows have the step `h` (s) and begin at the time `t0` (s).
        """
        u = np.ascontiguousarray(u, dtype=np.float64)
        y = np.empty((len(u), n_outputs))
        self._check(self._lib.hyst_graph_run(self._g, len(u), t0, h, u.ctypes.data, y.ctypes.data))
        return y

    def sensitivities(
        self,
        u: Array,
        n_outputs: int,
        h: float,
        seeds: NDArray[np.void],
        rows: Indices | None = None,
        step: float = 1e-6,
    ) -> tuple[Array, Array]:
        """Compute the outputs like `run`, and their derivatives with respect to parameters and initial states.

        Each column of the derivatives belongs to one variable of a fit. Such a variable may determine several
        parameters.

        Each element of the array `seeds` (m,), of the type `SEED`, contains a parameter, the column whose variable
        determines this parameter, and the derivative of the parameter with respect to this variable. The elements are
        sorted by column, and within a column by the node of the parameter. The columns are sorted by their first node.
        Of the columns with the same first node, those with several seeds for this node come first. If a block has no
        function `sensitivity`, its derivatives are finite differences, for which the variable is changed by `step`.
        Returns the outputs (k, n_outputs) and their derivatives (k, n_outputs, columns) in the ascending `rows` (k,);
        by default, in all rows.

        Raises
        ------
        InputError
            The seeds are not in order, a seed does not belong to a parameter, the graph has an implicit inverse, or
            the core refuses a value.
        """
        u, seeds = np.ascontiguousarray(u, dtype=np.float64), np.ascontiguousarray(seeds, dtype=SEED)
        picked: NDArray[np.int64] = np.ascontiguousarray(np.arange(len(u)) if rows is None else rows, dtype=np.int64)
        columns = int(seeds["column"].max(initial=-1)) + 1
        y, dy = np.empty((len(picked), n_outputs)), np.empty((len(picked), n_outputs, columns))
        places = seeds.ctypes.data, picked.ctypes.data, step, y.ctypes.data, dy.ctypes.data
        raw = _Sensitivity(columns, len(seeds), len(picked), *places)
        size = self._lib.hyst_sensitivity_measure(self._g, C.byref(raw))
        memory = np.empty(size // 8 + 2)
        run = self._lib.hyst_sensitivity_run
        self._check(run(self._g, len(u), 0.0, h, u.ctypes.data, C.byref(raw), memory.ctypes.data))
        return y, dy

    def tangent_between(self, t: float, du: Array, n_outputs: int) -> Array:
        """Return the tangent of the outputs at time `t` (s), between two steps, in the direction `du` of the inputs.

        `du` has the shape (n_inputs,), the result the shape (n_outputs,). The call changes no state.
        """
        n = self._lib.hyst_graph_n_continuous(self._g)
        seeds, dy, room = np.ascontiguousarray(du), np.empty(n_outputs), np.zeros(2 * n + len(self._state))
        dx, ddx, memory = room[:n], room[n : 2 * n], room[2 * n :]
        places = [a.ctypes.data for a in (seeds, dx, dy, ddx, memory)]
        self._lib.hyst_graph_tangent_between(self._g, t, *places)
        return dy

    @property
    def state(self) -> Array:
        """Copy of the complete state, shape (n,). Assigning such a copy restores the state."""
        return self._state.copy()

    @state.setter
    def state(self, value: Array) -> None:
        self._state[:] = value


class ContinuousExecutor(Executor):
    """An `Executor` whose continuous states are integrated by the caller; see `fmu_build/core/graph/continuous.h`.

    Call `start` first. Then set the inputs and `x`, call `evaluate`, and get the outputs and `derivatives`. Repeat this
    as often as the solver needs. Call `commit` after each accepted step, and `sample` once per sample period.
    """

    def __init__(self, file: bytes) -> None:
        super().__init__(file)
        lib = self._lib
        self._places = [lib.hyst_graph_continuous(self._g, k) for k in range(lib.hyst_graph_n_continuous(self._g))]

    @property
    def is_sampled(self) -> bool:
        """True if the graph contains a block that changes its state only at sample times."""
        return bool(self._lib.hyst_graph_is_sampled(self._g))

    @property
    def x(self) -> Array:
        """Copy of the continuous states, shape (n,). An assignment sets the continuous states."""
        return np.array([place[0] for place in self._places])

    @x.setter
    def x(self, value: Array) -> None:
        for place, v in zip(self._places, value, strict=True):
            place[0] = v

    def evaluate(self, t: float) -> None:
        """Compute the outputs at time `t` (s) for the present inputs and continuous states.

        The hysteretic memories stay unchanged.
        """
        self._lib.hyst_graph_evaluate(self._g, t)

    def derivatives(self) -> Array:
        """Return the time derivatives of `x`, shape (n,), at the point of the last call of `evaluate`."""
        dx = np.empty(len(self._places))
        self._lib.hyst_graph_derivatives(self._g, dx.ctypes.data)
        return dx

    def tangent(self, du: Array, dx: Array, n_outputs: int) -> tuple[Array, Array]:
        """Return the exact tangent at the point of the last call of `evaluate`; at a kink, the tangent is one-sided.

        The direction is du (n_inputs,) for the inputs and dx (n,) for `x`. Returns the tangents dy (n_outputs,) of the
        outputs and ddx (n,) of the time derivatives of `x`.
        """
        du, dx = np.ascontiguousarray(du, dtype=np.float64), np.ascontiguousarray(dx, dtype=np.float64)
        dy, ddx = np.empty(n_outputs), np.empty(len(self._places))
        pointers = [a.ctypes.data for a in (du, dx, dy, ddx)]
        self._lib.hyst_graph_tangent(self._g, *pointers)
        return dy, ddx

    def commit(self, t: float) -> None:
        """Compute the outputs at time `t` (s), and update the hysteretic memories."""
        self._lib.hyst_graph_commit(self._g, t)

    def sample(self, t: float, dt: float) -> None:
        """Compute the sampled blocks over one period `dt` (s) that ends at `t` (s), then compute all outputs."""
        self._check(self._lib.hyst_graph_sample(self._g, t, dt))
