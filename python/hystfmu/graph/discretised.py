"""A transfer function over many columns, with the steps of its block: the matrices are the derived values of the
block."""

from __future__ import annotations

import ctypes as C

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.core.columns import Recursion
from hystfmu.graph.node import Node


def discretised(node: Node, h: float) -> Recursion:
    """Return a transfer function stepped by h (s) from its steady state.

    Raises
    ------
    InputError
        The block refuses its parameters for this step, or has no steady state.
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
