"""States of the memory that a record does not contain: an input that reaches such states, and their share.

The half cycles of this input have the same shapes and durations as the half cycles of the record. Their order and
amplitudes are random, so the input causes other states of the memory.
"""

from itertools import pairwise

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import reversals
from hystfmu.identify.features.plays import with_plays
from hystfmu.model.coverage import covered

MOST_ROWS, LEAST_REVERSALS = 8000, 12
SEED = 77
PLAYS = 2  # number of plays that represent the memory of a kind with local parameters


def other_memory(u: Array, start: float) -> Array:
    """Return an input (m,) with full loops and then random loops within the range of an input u (n,).

    The input begins with the value `start`. Each half cycle has the shape of a half cycle of u.
    """
    rng, lo, hi = np.random.default_rng(SEED), float(u.min()), float(u.max())
    turns = reversals(u)
    shapes = [(u[a + 1 : b + 1] - u[a]) / (u[b] - u[a]) for a, b in pairwise(turns)]
    if not shapes:  # an input without reversals: ramps of a quarter of its length
        shapes = [np.linspace(0.0, 1.0, max(len(u) // 4, 2) + 1)[1:]]
    order = rng.permutation(len(shapes))
    parts, rows, last = [np.array([start])], 1, start
    for k in range(MOST_ROWS):
        if rows >= MOST_ROWS and k >= LEAST_REVERSALS:
            break
        up = k % 2 == 0
        level = hi if up else lo  # full loops come first, because they bring every model to the same memory
        if k >= 4:
            level = float(rng.uniform(last, hi) if up else rng.uniform(lo, last))
        shape = shapes[order[k % len(order)]]
        parts.append(last + (level - last) * shape)
        rows, last = rows + len(shape), level
    return np.concatenate(parts)


def unseen(data: Dataset) -> float:
    """Return the share (0 to 1) of memory states of other signals that are far from the states of all training rows.

    A state consists of the input and the outputs of `PLAYS` plays (see `hystfmu.model.coverage`).
    """
    if data.covariates:  # kinds with local parameters accept no covariates
        return 0.0
    first, u = float(data.u[0]), data.u[data.train]
    r = np.arange(1, PLAYS + 1) * float(np.ptp(u)) / 2 / (PLAYS + 1)

    def states(v: Array) -> Array:
        return with_plays(v, r, first)

    seen = data.along(states)[data.train]
    return 1 - covered(states, seen, np.ptp(seen, axis=0), first, u, np.zeros((len(u), 0))) / 100
