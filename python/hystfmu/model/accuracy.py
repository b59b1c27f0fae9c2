"""Accuracy of a model: errors on a record and on held-out signals; interval that contains the error of a new row.

The interval is computed by hierarchical conformal prediction. Neighbouring errors are similar, so rows are not
independent samples. Therefore errors on rows outside the fit are cut into K blocks. The blocks are assumed to be
exchangeable with a new part of the same kind of signal. The half-width of the interval is the least size that contains
a mean share of 95 % (K + 1)/K of the errors of the blocks. The factor (K + 1)/K treats the new block as a block with
infinite errors (Lee, Barber & Willett 2023, arXiv:2306.06342). To test the interval, the same rule is applied without
one block at a time. The share of the errors of this block inside the resulting interval is its coverage.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data.signals import held_out
from hystfmu.model import Model
from hystfmu.model.coverage import clamped

__all__ = ["Interval", "errors", "held_out_table", "interval", "rms", "width"]

SHARE = 0.95
LEAST_BLOCKS = 20  # the fewest that leave 19 when one is left out, which is what 95 % needs
BLOCKS = 40  # at most
ROWS = 4  # in a block, at least


def rms(e: Array) -> float:
    """Return the root mean square of e (n,), in its unit of measure."""
    return float(np.sqrt(np.mean(e**2)))


def errors(y: Array, measured: Array, span: float) -> dict[str, float]:
    """Compute RMS and largest error, absolute and in percent of `span`.

    Parameters
    ----------
    y, measured : array, shape (n,)
        Output of the model, and the measured output.
    span : float
        100 % of full scale, in the unit of measure of y.

    Returns
    -------
    dict of str to float
        ``rms``, ``max``, ``rms_percent``, ``max_percent``.
    """
    e = y - measured
    typical, most = rms(e), float(np.abs(e).max())
    return {"rms": typical, "max": most, "rms_percent": 100 * typical / span, "max_percent": 100 * most / span}


def held_out_table(
    model: Model, plant: Callable[[Array], Array], span: float, signals: dict[str, Array] | None = None
) -> dict[str, dict[str, float]]:
    """Compute the errors of a model against a plant on every held-out signal.

    Parameters
    ----------
    model : Model
        Model; it runs free from a fresh start.
    plant : function
        Returns the true output (n,) for an input (n,), from a fresh start.
    span : float
        100 % of full scale: the span of y in the training data.
    signals : dict of str to array, optional
        Held-out signals; default `held_out()`.

    Returns
    -------
    dict of str to dict
        For each signal the errors of `errors`, and `clamped_percent`, the share of rows at which the limits of a
        network act (%).
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
    """Return the interval that contains the error of a new row; None for fewer than 80 rows.

    Parameters
    ----------
    e : array, shape (n,)
        Errors on rows that the fit has not seen.
    """
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
