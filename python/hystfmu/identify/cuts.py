"""Cuts of a record: validation blocks spread over it, and a shorter record on which kinds of model compete.

If a record changes with time (a decaying sine, a staircase), a fit to its first part extrapolates in its last part.
With blocks between reversals, the model interpolates: the fitted rows and the blocks contain large and small, early and
late loops. The outermost loop is an exception. A fit without this loop extrapolates as long as the memory of the loop
lasts (`without_outermost`).

A record is shortened in two steps. First, rows are thinned evenly as far as extrema and spectra allow: `SAMPLES` rows
remain per cycle of the input, and the output has no significant content above half of the new Nyquist rate. If the
record is still too long, only the part that covers most of the range and of the speeds is used; of equal parts, the
earliest is used.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise, reversals
from hystfmu.model.accuracy import rms

BLOCKS = 40  # by default, at most
EVERY = 4  # one of so many consecutive blocks is a validation block
ALONE = (
    0.01  # of the range: a block that reaches an end of the range farther than all other rows holds the outermost loop
)

SAMPLES = 100  # rows in a mean cycle that thinning leaves
ABOVE = 1e-3  # of the span: RMS beyond the noise that may lie above half of the Nyquist rate of the thinned rows
PLACES = 9  # parts that are compared
AS_MUCH = 0.95  # of the most range and speed of any part: the earliest such part is taken
FAST = 95.0  # percentile of the speeds


def validation_rows(u: Array, which: int = EVERY - 1, blocks: int = BLOCKS) -> NDArray[np.bool_]:
    """Return which rows of an input u (n,) belong to validation blocks, (n,).

    There are at most `blocks` blocks. Of every `EVERY` consecutive blocks, block number `which`, counted from 0, is a
    validation block. Different numbers give disjoint rows.
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
    """Return validation rows (n,) without the blocks that alone reach an end of the range of u, if others remain."""
    left, block = held.copy(), np.cumsum(np.diff(held, prepend=False))
    for v in (u, -u):
        if v[held].max(initial=-np.inf) > v[~held].max(initial=-np.inf) + ALONE * float(np.ptp(u)):
            left[block == block[int(np.argmax(v))]] = False
    return left if left.any() else held


def fitted_and_held(data: Dataset, most: int) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Return three sets of rows, thinned evenly to at most `most`: counted, fitted, and validation rows."""
    held = np.zeros(data.train.stop, dtype=bool)
    for which in range(EVERY - 1, 0, -1):  # the data may hold out a fold themselves
        held[data.train] = validation_rows(data.u[data.train], which)
        if held[data.counted].any():
            break
    held[data.counted] = without_outermost(data.u[data.counted], held[data.counted])
    every = np.arange(data.train.stop)[data.counted]
    every = every[:: -(-len(every) // most)]
    return every, every[~held[every]], every[held[every]]


def shortened(data: Dataset, most: int) -> Dataset:
    """Return a record of at most about `most` training rows without later rows. Several records stay unchanged."""
    n = data.train.stop - data.train.start
    if n <= most or len(data.starts) > 1:
        return data
    thinned = _rows(data, slice(0, data.train.stop, _factor(data, -(-n // most))), data.train.start)
    n = thinned.train.stop - thinned.train.start
    if n <= most:
        return thinned
    first = _place(thinned.u[thinned.train], most) + thinned.train.start
    # memory begins at the first training row: rows before it are run where they belong to the beginning
    start = 0 if first == thinned.train.start else first
    return _rows(thinned, slice(start, first + most), first)


def beginning(data: Dataset, rows: int) -> Dataset:
    """Return the data up to the first `rows` training rows, with the held-out rows."""
    n = data.train.start + rows
    if n >= data.train.stop or len(data.starts) > 1:
        return data
    made = _rows(data, slice(0, n), data.train.start)
    return made if data.held is None else made.with_held(data.held[:n])


def _rows(data: Dataset, rows: slice, first: int) -> Dataset:
    """Return selected rows; training rows begin at row `first` of the data."""
    t, u, y, beside = data.t[rows], data.u[rows], data.y[rows], data.covariates.rows(rows)
    begin = -(-(first - rows.start) // (rows.step or 1))
    return replace(data, t=t, u=u, y=y, covariates=beside, train=slice(begin, len(t)))


def _factor(data: Dataset, wanted: int) -> int:
    """Return the thinning factor, up to the wanted one."""
    u, y = data.u[data.train], data.y[data.train]
    turns = reversals(u)
    between = np.diff(turns)
    cycle = 2 * float(between.mean()) if len(between) else float(len(u))
    found = max(1, min(wanted, int(cycle / SAMPLES)))
    while found > 1 and any(_lost(v, found) for v in (u, y)):
        found -= 1
    return found


def _lost(v: Array, factor: int) -> bool:
    """Return whether a signal exceeds the noise above half of the Nyquist rate of every `factor`-th row."""
    smooth = v - np.linspace(v[0], v[-1], len(v))  # without a jump from the last row to the first
    lines = np.fft.rfft(smooth)
    lines[: len(lines) // (2 * factor)] = 0
    above = rms(np.fft.irfft(lines, len(v)))
    return above > math.hypot(2 * noise(v), ABOVE * float(np.ptp(v)))


def _place(u: Array, most: int) -> int:
    """Return the first row of the most informative part of `most` rows."""
    speed = np.abs(np.diff(u, append=u[-1]))
    places = np.unique(np.linspace(0, len(u) - most, PLACES).astype(int))
    parts = [slice(a, a + most) for a in places]
    wide = np.array([float(np.ptp(u[p])) for p in parts])
    fast = np.array([float(np.percentile(speed[p], FAST)) for p in parts])
    shown = np.minimum(wide / max(wide.max(), 1e-300), fast / max(fast.max(), 1e-300))
    return int(places[int(np.argmax(shown >= AS_MUCH * shown.max()))])
