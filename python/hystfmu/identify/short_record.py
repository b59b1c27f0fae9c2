"""A shorter record of the same device, on which kinds of model compete if the whole record takes too long.

Rows are thinned as far as extrema and spectra allow: `SAMPLES` rows remain per cycle of the input, and the output has
no significant content above half of the new Nyquist rate. If the record is still too long, it is cut to the part that
covers most of the range and of the speeds.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise, reversals
from hystfmu.model.accuracy import rms

SAMPLES = 100  # rows in a mean cycle that thinning leaves
ABOVE = 1e-3  # of the span: RMS beyond the noise that may lie above half of the Nyquist rate of the thinned rows
PLACES = 9  # parts that are compared
AS_MUCH = 0.95  # of the most range and speed of any part: the earliest such part is taken
FAST = 95.0  # percentile of the speeds


def shortened(data: Dataset, most: int) -> Dataset:
    """Return a record of about `most` training rows at most; several records are not changed.

    Parameters
    ----------
    data : Dataset
        Measured data.
    most : int
        Training rows wanted.

    Returns
    -------
    Dataset
        The same data if they are short enough; otherwise rows after the training rows are omitted.
    """
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
    """Return some rows; rows from row `first` of the data on count."""
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
