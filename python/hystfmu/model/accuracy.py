"""Accuracy of a model: its errors on a record and on held-out signals, and a 95 % prediction interval of its error.

The interval is computed by hierarchical conformal prediction. Rows are not independent samples, because errors of
neighbouring rows are similar. Therefore the errors on rows that were not used in the fit are cut into K blocks. The
blocks are assumed to be exchangeable with a new part of the same kind of signal, the new block. The half-width of the
interval is the smallest limit that at least 95 % (K + 1)/K of the absolute errors do not exceed, where each block has
the same weight. The factor (K + 1)/K takes the new block into account. The errors of this block are unknown, so they
are assumed to be infinite (Lee, Barber & Willett 2023, arXiv:2306.06342). The coverage is a test of the interval. For
each block, an interval is computed from the other blocks. The coverage of the block is the percentage of its errors
that lie inside this interval.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array
from hystfmu.data.signals import held_out
from hystfmu.model import Model, errors, rms
from hystfmu.model.coverage import clamped

__all__ = ["Interval", "errors", "held_out_table", "interval", "rms", "width"]

SHARE = 0.95
LEAST_BLOCKS = 20  # the coverage test omits one block, and an interval of 95 % needs at least 19 blocks
BLOCKS = 40  # maximum number of blocks
ROWS = 4  # minimum number of rows in a block


def held_out_table(
    model: Model, plant: Callable[[Array], Array], span: float, signals: dict[str, Array] | None = None
) -> dict[str, dict[str, float]]:
    """Compute the errors between a model and a plant for every held-out signal.

    Parameters
    ----------
    model : Model
        Model to test. It is simulated from its initial state, without use of measured outputs.
    plant : function
        Function that returns the true output (n,) for an input (n,) from the initial state of the plant.
    span : float
        Span of y in the training data, which counts as 100 %.
    signals : dict of str to array, optional
        Held-out signals by name. The default is `held_out()`.

    Returns
    -------
    dict of str to dict
        Results of `errors` for each signal, and ``clamped_percent``, the percentage of rows at which the input of a
        network is limited to its trained range.
    """
    h = 1.0 if model.step is None else model.step
    return {
        name: {
            **errors(model.predict(u), plant(u), span),
            "clamped_percent": 100 * float(np.mean(clamped(model.graph, u, h))),
        }
        for name, u in (held_out() if signals is None else signals).items()
    }


@dataclass(frozen=True)
class Interval:
    """A prediction interval around the output of a model, and its coverage test.

    Parameters
    ----------
    half_width : float
        Half of the width, in the unit of measure of y.
    coverage, lowest : float
        Mean coverage and smallest coverage of the blocks (%). The coverage of a block is the percentage of its errors
        inside the interval that is computed from the other blocks.
    rows, blocks : int
        Number of rows and number of blocks.
    """

    half_width: float
    coverage: float
    lowest: float
    rows: int
    blocks: int


def interval(e: Array) -> Interval | None:
    """Return the 95 % prediction interval for the error of a new row; None for fewer than 80 rows.

    Parameters
    ----------
    e : array, shape (n,)
        Errors on rows that were not used in the fit.
    """
    count = min(BLOCKS, len(e) // ROWS)
    if count < LEAST_BLOCKS:
        return None
    blocks = np.array_split(np.abs(e), count)
    shares = [float(np.mean(b <= width(blocks[:k] + blocks[k + 1 :]))) for k, b in enumerate(blocks)]
    mean = float(np.average(shares, weights=[len(b) for b in blocks]))
    return Interval(width(blocks), 100 * mean, 100 * min(shares), len(e), count)


def width(blocks: list[Array]) -> float:
    """Return the half-width of the prediction interval, which 95 % of the absolute errors of a new block do not exceed.

    Parameters
    ----------
    blocks : list of arrays, shape (n_k,)
        Absolute errors in at least 19 blocks, which are assumed to be exchangeable with the new block.
    """
    size = np.concatenate(blocks)
    weight = np.concatenate([np.full(len(b), 1 / len(b)) for b in blocks])
    order = np.argsort(size)
    share = np.cumsum(weight[order]) / (len(blocks) + 1)
    at = min(int(np.searchsorted(share, SHARE - 1e-9)), len(size) - 1)
    return float(size[order][at])
