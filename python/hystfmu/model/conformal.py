"""Interval that a stated share of the errors on new rows falls into: split conformal, with its measured coverage.

Errors of rows that the fit has not seen are sorted; the interval is +- the value below which 95 % of them lie, with the
correction for their number (Lei et al. 2018, Journal of the American Statistical Association 113(523), eq. 3).
Neighbouring rows are not independent, so the coverage is measured: the rows are cut into blocks, every other block
gives the interval, and the others are counted; then the other way round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array

SHARE = 0.95
BLOCKS = 20
LEAST_ROWS = 80  # below them there is no interval: 40 errors do not tell their 95 % quantile


@dataclass(frozen=True)
class Interval:
    """An interval around the output of a model.

    Parameters
    ----------
    half_width : float
        In the unit of measure of y.
    coverage, lowest : float
        Share of the errors inside (%) that was measured on blocks that did not give the interval: over all of them, and
        in the worst of them.
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
    if len(e) < LEAST_ROWS:
        return None
    blocks = np.array_split(np.abs(e), BLOCKS)
    shares = []
    for first in (0, 1):
        width = quantile(np.concatenate(blocks[first::2]))
        shares += [(float(np.mean(b <= width)), len(b)) for b in blocks[1 - first :: 2]]
    inside, counts = np.array(shares).T
    mean = float(inside @ counts / counts.sum())
    return Interval(quantile(np.abs(e)), 100 * mean, 100 * float(inside.min()), len(e), BLOCKS)


def quantile(size: Array) -> float:
    """Return the least of the sizes (n,) that at least 95 % of n + 1 exchangeable ones do not exceed."""
    k = min(len(size), int(np.ceil((len(size) + 1) * SHARE)))
    return float(np.partition(size, k - 1)[k - 1])
