"""Interval that contains the error of a new row with a stated probability: hierarchical conformal prediction.

Neighbouring errors are similar, so rows are not independent samples. Therefore errors on rows outside the fit are cut
into K blocks. The blocks are assumed to be exchangeable with a new part of the same kind of signal. The half-width of
the interval is the least size that contains a mean share of 95 % (K + 1)/K of the errors of the blocks. The factor (K +
1)/K treats the new block as a block with infinite errors (Lee, Barber & Willett 2023, arXiv:2306.06342, hierarchical
conformal prediction). To test the interval, the same rule is applied without one block at a time. The share of the
errors of this block inside the resulting interval is its coverage.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array

SHARE = 0.95
LEAST_BLOCKS = 20  # the fewest that leave 19 when one is left out, which is what 95 % needs
BLOCKS = 40  # at most
ROWS = 4  # in a block, at least


@dataclass(frozen=True)
class Interval:
    """An interval around the output of a model.

    Parameters
    ----------
    half_width : float
        Half of the width, in the unit of measure of y.
    coverage, lowest : float
        Share of the errors of a block (%) inside the interval from the remaining blocks: mean over all blocks, and
        least share of a block.
    rows, blocks : int
        Number of rows, and number of blocks.
    """

    half_width: float
    coverage: float
    lowest: float
    rows: int
    blocks: int


def interval(e: Array) -> Interval | None:
    """Return the interval for errors (n,) on rows that the fit has not seen; None for fewer than 80."""
    count = min(BLOCKS, len(e) // ROWS)
    if count < LEAST_BLOCKS:
        return None
    blocks = np.array_split(np.abs(e), count)
    shares = [float(np.mean(b <= width(blocks[:k] + blocks[k + 1 :]))) for k, b in enumerate(blocks)]
    mean = float(np.average(shares, weights=[len(b) for b in blocks]))
    return Interval(width(blocks), 100 * mean, 100 * min(shares), len(e), count)


def width(blocks: list[Array]) -> float:
    """Return the size that a row of a new block exceeds with a probability of at most 5 %.

    Parameters
    ----------
    blocks : list of arrays, shape (n_k,)
        Sizes of errors in at least 19 blocks, which are exchangeable with the new block.
    """
    size = np.concatenate(blocks)
    weight = np.concatenate([np.full(len(b), 1 / len(b)) for b in blocks])
    order = np.argsort(size)
    share = np.cumsum(weight[order]) / (len(blocks) + 1)
    at = min(int(np.searchsorted(share, SHARE - 1e-9)), len(size) - 1)
    return float(size[order][at])
