"""Validation blocks: parts of a record between two reversals, spread over the whole record.

A split into a first and a last part extrapolates wherever the record changes (a decaying sine, a staircase). Blocks
between reversals interpolate: both sets of rows hold large and small, early and late loops. The outermost loop is an
exception: a fit without it extrapolates wherever the memory of this loop lasts (`without_outermost`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.data.reversals import reversals

BLOCKS = 40  # by default, at most
EVERY = 4  # one of so many consecutive blocks is a validation block
ALONE = (
    0.01  # of the range: a block that reaches an end of the range farther than all other rows holds the outermost loop
)


def validation_rows(u: Array, which: int = EVERY - 1, blocks: int = BLOCKS) -> NDArray[np.bool_]:
    """Return which rows of an input belong to validation blocks.

    Parameters
    ----------
    u : array, shape (n,)
        Input.
    which : int
        Number of the block among every `EVERY` consecutive ones, from 0; different numbers give disjoint rows.
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


def without_outermost(u: Array, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return validation rows without blocks that alone reach an end of the range of the input, unless these are all.

    Parameters
    ----------
    u : array, shape (n,)
        Input.
    held : array of bool, shape (n,)
        Which rows belong to validation blocks.

    Returns
    -------
    array of bool, shape (n,)
    """
    left, block = held.copy(), np.cumsum(np.diff(held, prepend=False))
    for v in (u, -u):
        if v[held].max(initial=-np.inf) > v[~held].max(initial=-np.inf) + ALONE * float(np.ptp(u)):
            left[block == block[int(np.argmax(v))]] = False
    return left if left.any() else held
