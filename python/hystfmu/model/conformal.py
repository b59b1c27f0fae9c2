"""Interval that contains the error of a new row with a stated probability: hierarchical conformal prediction.

Neighbouring errors are similar, so rows are not independent samples. Therefore errors on rows outside the fit are cut
into blocks, and blocks count as exchangeable with a new part of such a signal. The interval is +- the least size that
contains a mean share of 95 % (K + 1)/K of the errors of K blocks: the new block counts as a block with infinite errors
(Lee, Barber & Willett 2023, arXiv:2306.06342, hierarchical conformal prediction). The same rule is applied with each
block left out in turn; this gives the share of its errors inside the interval.
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
        In the unit of measure of y.
    coverage, lowest : float
        Share of the errors (%) inside the interval that the other blocks give: over all blocks, and in the worst.
    rows, blocks : int
        Rows and blocks that were counted.
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
        Sizes of errors; at least 19 blocks, exchangeable with the new one.
    """
    size = np.concatenate(blocks)
    weight = np.concatenate([np.full(len(b), 1 / len(b)) for b in blocks])
    order = np.argsort(size)
    share = np.cumsum(weight[order]) / (len(blocks) + 1)
    at = min(int(np.searchsorted(share, SHARE - 1e-9)), len(size) - 1)
    return float(size[order][at])
