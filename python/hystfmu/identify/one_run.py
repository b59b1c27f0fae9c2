"""Several records as one run, for kinds of model that fit a single run; between records the memory returns to rest.

Every record begins at rest. So a decaying oscillation about the first input of a record is inserted before this record.
The oscillation wipes out the memory of the previous record, like demagnetisation, at the speed of the records. The
inserted rows are held out: they have an input only. If a record begins near an end of the range, the oscillation stays
inside the range, and the memory is then displaced to one side. In this case the rows up to the first full swing are
also held out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.data.columns import Covariates

CYCLES, DECAY = 12, 0.4  # of the oscillation; its last cycle has 1 % of the first
ROWS = (40, 200)  # in a cycle
SETTLE = 200  # rows at the first input
CENTRED = 0.2  # of half the range: a first input nearer to the middle leaves no memory that leans
SWUNG = 0.9  # of the range: a full swing


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
