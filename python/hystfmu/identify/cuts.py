"""Cuts of a record: validation blocks, a shorter record on which kinds of model compete, and records as one run.

If a record changes with time (a decaying sine, a staircase), a fit to its first part extrapolates in its last part.
With blocks between reversals, the model interpolates: the fitted rows and the blocks contain large and small, early and
late loops. The outermost loop is an exception. A fit without this loop extrapolates as long as the memory of the loop
lasts (`without_outermost`).

A record is shortened in two steps. First, rows are thinned evenly as far as extrema and spectra allow: `SAMPLES` rows
remain per cycle of the input, and the output has no significant content above half of the new Nyquist rate. If the
record is still too long, only the part that covers most of the range and of the speeds is used; of equal parts, the
earliest is used.

Several records become one run for kinds that fit a single run. Every record begins at rest. So a decaying oscillation
about the first input of a record is inserted before this record. The oscillation wipes out the memory of the previous
record, like demagnetisation, at the speed of the records. The inserted rows are held out: they have an input only. If a
record begins near an end of the range, the oscillation stays inside the range, and the memory is then displaced to one
side. In this case the rows up to the first full swing are also held out.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.data.columns import Covariates
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

CYCLES, DECAY = 12, 0.4  # of the oscillation; its last cycle has 1 % of the first
ROWS = (40, 200)  # in a cycle
SETTLE = 200  # rows at the first input
CENTRED = 0.2  # of half the range: a first input nearer to the middle leaves no memory that leans
SWUNG = 0.9  # of the range: a full swing


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


def one_run(data: Dataset) -> Dataset:
    """Return the records as one run with held-out rows between records; a single record is returned unchanged."""
    if len(data.starts) == 1:
        return data
    lo, hi = float(data.u.min()), float(data.u.max())
    held = np.zeros(len(data.u), dtype=bool) if data.held is None else data.held
    u, y, beside, out, place = [], [], [], [], np.zeros(len(data.u) + 1, dtype=int)
    at = 0
    for before, rows in zip((None, *data.records), data.records, strict=False):
        if before is not None:
            a, b = before.stop - 1, rows.start
            way = _way(float(data.u[a]), float(data.u[b]), lo, hi, float(np.sqrt(np.mean(np.diff(data.u) ** 2))))
            share = np.linspace(0, 1, len(way) + 2)[1:-1]
            u.append(way)
            y.append(data.y[a] + share * (data.y[b] - data.y[a]))
            values = data.covariates.values
            beside.append(values[a] + share[:, None] * (values[b] - values[a]))
            out.append(np.ones(len(way), dtype=bool))
            at += len(way)
        place[rows] = at + np.arange(rows.stop - rows.start)
        at += rows.stop - rows.start
        u.append(data.u[rows])
        y.append(data.y[rows])
        beside.append(data.covariates.values[rows])
        out.append(held[rows] if before is None else held[rows] | _leaning(data.u[rows], lo, hi))
    place[-1] = at
    covariates = Covariates(data.covariates.names, data.covariates.units, np.concatenate(beside))
    made = Dataset(
        np.arange(at) * data.h,
        np.concatenate(u),
        np.concatenate(y),
        data.name,
        data.path,
        (int(place[data.train.start]), int(place[data.train.stop - 1]) + 1),
        data.unit_u,
        data.unit_y,
        covariates=covariates,
    )
    return made.with_held(np.concatenate(out))


def _way(last: float, first: float, lo: float, hi: float, step: float) -> Array:
    """Return the input from the last row of a record to the first row of the next, in steps of about `step`."""
    size = max(hi - first, first - lo)
    rows = int(np.clip(4 * size / max(step, 1e-300), *ROWS))
    c = np.arange(CYCLES * rows) / rows
    swing = np.clip(first + size * np.exp(-DECAY * c) * np.cos(2 * np.pi * c), lo, hi)
    ramp = np.linspace(last, swing[0], max(rows // 2, 2) + 1)[1:-1]
    return np.concatenate([ramp, swing, np.full(SETTLE, first)])


def _leaning(u: Array, lo: float, hi: float) -> NDArray[np.bool_]:
    """Return the rows up to the first full swing if a record does not begin in the middle of the range.

    Without a full swing, the result is empty.
    """
    held = np.zeros(len(u), dtype=bool)
    if abs(u[0] - (lo + hi) / 2) <= CENTRED * (hi - lo) / 2:
        return held
    swing = np.maximum.accumulate(u) - np.minimum.accumulate(u)
    held[: int(np.argmax(swing >= SWUNG * (hi - lo)))] = True
    return held
