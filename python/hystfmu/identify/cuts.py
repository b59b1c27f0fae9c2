"""Selection of rows: validation blocks, a shorter record for ``auto``, and the connection of several records.

Validation blocks. If a record changes with time, such as a decaying sine or a staircase, a fit to its first part
extrapolates in its last part. Therefore the validation blocks are cut between reversals and spread over the record.
Training rows and blocks then both contain large and small, early and late loops. The outermost loop is an exception and
always belongs to the training rows. A model fitted without it would extrapolate in this loop and afterwards, until a
full swing of the input wipes out the memory of this loop (`without_outermost`).

Shorter record. First, the rows are thinned evenly. At least `SAMPLES` rows per cycle of the input remain, and the
signals must have no significant content above half of the new Nyquist frequency. If the record is still too long, one
part of it is used, which covers the largest shares of the range and of the speeds. If several parts cover almost as
much, the earliest of them is used.

Several records. Some kinds can be fitted only to a single run, so the records are connected to one run. Each record
begins at rest. Therefore a decaying oscillation about the first input of a record is inserted before this record. This
oscillation has the speed of the records. It wipes out the memory of the previous record, like a demagnetisation. The
inserted rows have no measured output and are held out. If a record begins near an end of the range, the range limits
the oscillation on one side. The memory after it then differs from the memory of a device at rest. Therefore the rows of
this record up to its first full swing are also held out.
"""

import math
from dataclasses import replace

import numpy as np

from hystfmu.base import Array, Indices, Mask
from hystfmu.data import Dataset
from hystfmu.data.columns import Covariates
from hystfmu.data.reversals import noise, reversals
from hystfmu.model import rms

BLOCKS = 40  # default of the maximum number of blocks
EVERY = 4  # one of `EVERY` consecutive blocks is a validation block
ALONE = 0.01  # excess over the extreme of all other rows, relative to the range, that identifies the outermost loop

SAMPLES = 100  # minimum number of rows in a mean cycle after thinning
ABOVE = 1e-3  # largest RMS, without noise, above half of the new Nyquist frequency, relative to the span of the signal
PLACES = 9  # number of compared parts
AS_MUCH = 0.95  # the earliest part that reaches this fraction of the best score is used
FAST = 95.0  # percentile of the speeds that represents the speed of a part

CYCLES, DECAY = 12, 0.4  # number of cycles of the oscillation and decay per cycle; the last cycle has 1 % of the first
ROWS = (40, 200)  # smallest and largest number of rows in a cycle
SETTLE = 200  # number of rows at the first input of the record after the oscillation
CENTRED = 0.2  # distance of the first input from the middle, in half ranges, up to which the memory counts as centred
SWUNG = 0.9  # amplitude of a full swing, peak to peak, relative to the range


def validation_rows(u: Array, which: int = EVERY - 1, blocks: int = BLOCKS) -> Mask:
    """Return a mask (n,) that is True at the rows of an input u (n,) that belong to a validation block.

    The input is cut into at most `blocks` blocks. In each group of `EVERY` consecutive blocks, block number `which`,
    counted from 0, is a validation block. Masks with different values of `which` have no common rows.
    """
    n = len(u)
    turns = reversals(u)
    # an input with few reversals is cut at equal distances
    cuts = turns if len(turns) >= 2 * EVERY else np.arange(1, 5 * EVERY) * n // (5 * EVERY)
    wanted = np.arange(1, blocks) * n // blocks
    chosen = np.unique(cuts[np.searchsorted(cuts, wanted).clip(0, len(cuts) - 1)])
    block = np.searchsorted(chosen, np.arange(n), side="right")
    return np.asarray(block % EVERY == which)


def without_outermost(u: Array, held: Mask) -> Mask:
    """Remove from the validation rows (n,) the blocks with the outermost loop, unless no validation row would remain.

    A block contains the outermost loop if u in this block is above its maximum, or below its minimum, on the rows
    outside all validation blocks. The difference must be more than a share `ALONE` of the range.
    """
    left, block = held.copy(), np.cumsum(np.diff(held, prepend=False))
    for v in (u, -u):
        if v[held].max(initial=-np.inf) > v[~held].max(initial=-np.inf) + ALONE * float(np.ptp(u)):
            left[block == block[int(np.argmax(v))]] = False
    return left if left.any() else held


def fitted_and_held(data: Dataset, most: int) -> tuple[Indices, Indices, Indices]:
    """Return three arrays of row numbers: all training rows without held-out rows, fitted rows, and validation rows.

    The training rows are thinned evenly to at most `most` rows. Each of them is either a fitted row or a validation
    row.
    """
    held = np.zeros(data.train.stop, dtype=bool)
    for which in range(EVERY - 1, 0, -1):  # all rows of a fold may already be held out
        held[data.train] = validation_rows(data.u[data.train], which)
        if held[data.counted].any():
            break
    held[data.counted] = without_outermost(data.u[data.counted], held[data.counted])
    every = np.arange(data.train.stop)[data.counted]
    every = every[:: -(-len(every) // most)]
    return every, every[~held[every]], every[held[every]]


def shortened(data: Dataset, most: int) -> Dataset:
    """Return a data set with at most about `most` training rows; data of several records stay unchanged.

    Rows after the last training row are removed.
    """
    n = data.train.stop - data.train.start
    if n <= most or len(data.starts) > 1:
        return data
    thinned = _rows(data, slice(0, data.train.stop, _factor(data, -(-n // most))), data.train.start)
    n = thinned.train.stop - thinned.train.start
    if n <= most:
        return thinned
    first = _place(thinned.u[thinned.train], most) + thinned.train.start
    # rows before the training rows determine the memory only if the part begins with the first training row
    start = 0 if first == thinned.train.start else first
    return _rows(thinned, slice(start, first + most), first)


def beginning(data: Dataset, rows: int) -> Dataset:
    """Return the data without the rows after the first `rows` training rows; data of several records stay unchanged."""
    n = data.train.start + rows
    if n >= data.train.stop or len(data.starts) > 1:
        return data
    made = _rows(data, slice(0, n), data.train.start)
    return made if data.held is None else made.with_held(data.held[:n])


def _rows(data: Dataset, rows: slice, first: int) -> Dataset:
    """Return the selected rows of a data set; its training rows begin at row `first` of the original data."""
    t, u, y, beside = data.t[rows], data.u[rows], data.y[rows], data.covariates.rows(rows)
    begin = -(-(first - rows.start) // (rows.step or 1))
    return replace(data, t=t, u=u, y=y, covariates=beside, train=slice(begin, len(t)))


def _factor(data: Dataset, wanted: int) -> int:
    """Return the largest permitted thinning factor that does not exceed `wanted`."""
    u, y = data.u[data.train], data.y[data.train]
    turns = reversals(u)
    between = np.diff(turns)
    cycle = 2 * float(between.mean()) if len(between) else float(len(u))
    found = max(1, min(wanted, int(cycle / SAMPLES)))
    while found > 1 and any(_lost(v, found) for v in (u, y)):
        found -= 1
    return found


def _lost(v: Array, factor: int) -> bool:
    """Return whether thinning by `factor` would lose content of a signal above half of the new Nyquist frequency."""
    smooth = v - np.linspace(v[0], v[-1], len(v))  # the Fourier transform would see a jump from the last to row 0
    lines = np.fft.rfft(smooth)
    lines[: len(lines) // (2 * factor)] = 0
    above = rms(np.fft.irfft(lines, len(v)))
    return above > math.hypot(2 * noise(v), ABOVE * float(np.ptp(v)))


def _place(u: Array, most: int) -> int:
    """Return the first row of the part of u, `most` rows long, that covers the range and the speeds of u best."""
    speed = np.abs(np.diff(u, append=u[-1]))
    places = np.unique(np.linspace(0, len(u) - most, PLACES).astype(int))
    parts = [slice(a, a + most) for a in places]
    wide = np.array([float(np.ptp(u[p])) for p in parts])
    fast = np.array([float(np.percentile(speed[p], FAST)) for p in parts])
    shown = np.minimum(wide / max(wide.max(), 1e-300), fast / max(fast.max(), 1e-300))
    return int(places[int(np.argmax(shown >= AS_MUCH * shown.max()))])


def one_run(data: Dataset) -> Dataset:
    """Connect several records to one run with held-out rows between them; return a single record unchanged."""
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
    """Return the inserted input between two records: a ramp, a decaying oscillation, and a constant part.

    `last` is the last input of the previous record, and `first` is the first input of the next record. The input stays
    between `lo` and `hi`, and it changes by about `step` per row.
    """
    size = max(hi - first, first - lo)
    rows = int(np.clip(4 * size / max(step, 1e-300), *ROWS))
    c = np.arange(CYCLES * rows) / rows
    swing = np.clip(first + size * np.exp(-DECAY * c) * np.cos(2 * np.pi * c), lo, hi)
    ramp = np.linspace(last, swing[0], max(rows // 2, 2) + 1)[1:-1]
    return np.concatenate([ramp, swing, np.full(SETTLE, first)])


def _leaning(u: Array, lo: float, hi: float) -> Mask:
    """Return a mask (n,) of the rows before the first full swing of u (n,), if u begins near an end of its range.

    `lo` and `hi` are the ends of the range. The mask is False everywhere if u begins near the middle of the range, or
    if u has no full swing.
    """
    held = np.zeros(len(u), dtype=bool)
    if abs(u[0] - (lo + hi) / 2) <= CENTRED * (hi - lo) / 2:
        return held
    swing = np.maximum.accumulate(u) - np.minimum.accumulate(u)
    held[: int(np.argmax(swing >= SWUNG * (hi - lo)))] = True
    return held
