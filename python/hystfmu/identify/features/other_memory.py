"""An input of the same form as a record but with another memory: its half cycles, shuffled between other turning
points.

The half cycles keep their shape and duration, so that speeds and shapes are those of the record. Only the order and the
size of the loops differ, and with them the states of the memory.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data.reversals import reversals

MOST_ROWS, LEAST_REVERSALS = 8000, 12
SEED = 77


def other_memory(u: Array, start: float) -> Array:
    """Return random nested loops within the range of u, after a full one.

    Parameters
    ----------
    u : array, shape (n,)
        Input of a record.
    start : float
        First value.

    Returns
    -------
    array, shape (m,)
        Starts at `start`; half of the reversals lie inside the last loop, as in `hystfmu.data.signals`.
    """
    rng, lo, hi = np.random.default_rng(SEED), float(u.min()), float(u.max())
    turns = reversals(u)
    shapes = [(u[a + 1 : b + 1] - u[a]) / (u[b] - u[a]) for a, b in pairwise(turns)]
    if not shapes:  # one sweep: in quarters
        shapes = [np.linspace(0.0, 1.0, max(len(u) // 4, 2) + 1)[1:]]
    order = rng.permutation(len(shapes))
    parts, rows, last = [np.array([start])], 1, start
    for k in range(MOST_ROWS):
        if rows >= MOST_ROWS and k >= LEAST_REVERSALS:
            break
        up = k % 2 == 0
        level = hi if up else lo  # full loops first, which leave the same memory in every model
        if k >= 4:
            level = float(rng.uniform(last, hi) if up else rng.uniform(lo, last))
        shape = shapes[order[k % len(order)]]
        parts.append(last + (level - last) * shape)
        rows, last = rows + len(shape), level
    return np.concatenate(parts)
