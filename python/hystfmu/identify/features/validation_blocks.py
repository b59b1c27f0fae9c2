"""Validation blocks: parts of a record between two reversals, spread over the whole record.

A split into a first and a last part extrapolates wherever the record changes (a decaying sine, a staircase).  Blocks
between reversals interpolate: both sets of rows hold large and small, early and late loops.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.data.reversals import reversals

BLOCKS = 40  # by default, at most
EVERY = 4  # one of so many consecutive blocks is a validation block


def validation_rows(u: Array, which: int = EVERY - 1, blocks: int = BLOCKS) -> NDArray[np.bool_]:
    """Return which rows of an input belong to validation blocks.

    Parameters
    ----------
    u : array, shape (n,)
        Input.
    which : int
        Block of every `EVERY` consecutive ones, from 0; another number gives disjoint rows.
    blocks : int
        Number of blocks, at most.

    Returns
    -------
    array of bool, shape (n,)
    """
    n = len(u)
    turns = reversals(u)
    # without reversals enough, cuts at even distances serve
    cuts = turns if len(turns) >= 2 * EVERY else np.arange(1, 5 * EVERY) * n // (5 * EVERY)
    wanted = np.arange(1, blocks) * n // blocks
    chosen = np.unique(cuts[np.searchsorted(cuts, wanted).clip(0, len(cuts) - 1)])
    block = np.searchsorted(chosen, np.arange(n), side="right")
    return np.asarray(block % EVERY == which)
