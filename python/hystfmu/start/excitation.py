"""The next measurement: an input that tells memory, rate dependence and dynamics of a device apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.data.csv_file import write_csv
from hystfmu.data.signals import nested_reversals, ramps

REVERSALS = 40  # at each speed
SPEEDS = (1 / 3, 1.0, 3.0)  # of the reversals, relative to those of the record
LEAST_ROWS = 40  # between two ends of the range
REST = 0.1  # of the duration of the loops: creep
SMALL, FASTEST = 0.05, 0.1  # amplitude of the sweep (of half the range), and its last frequency (of the sample rate)
MOST_ROWS = 200_000


def write_excitation(path: Path, data: Dataset, frequency: float) -> None:
    """Write the columns t and u of `excitation` to a CSV file."""
    u = excitation(data, frequency)
    unit = f" [{data.unit_u}]" if data.unit_u else ""
    t: Array = data.h * np.arange(len(u), dtype=np.float64)
    write_csv(path, {"t [s]": t, f"u{unit}": u})


def excitation(data: Dataset, frequency: float) -> Array:
    """Design an input for the range, the step and the speed of a record.

    A full loop, nested reversals at three speeds, a rest at the middle of the range, and a sweep of small amplitude.

    Parameters
    ----------
    data : Dataset
        What was measured so far.
    frequency : float
        Of a full loop (Hz) at the speed of the record.

    Returns
    -------
    array, shape (n,)
        In the unit of measure of u.  It starts and ends at the first input of the record, and is faster than the record
        where it would have more than `MOST_ROWS` rows.
    """
    lo, hi = float(data.u.min()), float(data.u.max())
    middle, half = (lo + hi) / 2, (hi - lo) / 2
    start = (float(data.u[0]) - middle) / half
    cycle = 1 / (frequency * data.h)
    v = _path(start, cycle)
    while len(v) > MOST_ROWS:  # never cut off, because it would end far from where it begins
        cycle /= 2
        v = _path(start, cycle)
    return np.asarray(middle + half * v)


def _path(start: float, cycle: float) -> Array:
    """Return the path in [-1, 1] from `start` back to it, with `cycle` rows for a full loop."""
    parts = [ramps([start, 1.0, -1.0, 1.0, -1.0, 0.0], _step(cycle, 1.0))]
    for k, speed in enumerate(SPEEDS):
        parts.append(nested_reversals(REVERSALS, seed=k + 1, step=_step(cycle, speed))[1:])
        parts.append(ramps([float(parts[-1][-1]), 0.0], _step(cycle, speed))[1:])
    parts.append(np.zeros(round(REST * sum(map(len, parts)))))
    parts.append(_sweep(cycle))
    parts.append(ramps([float(parts[-1][-1]), start], _step(cycle, 1.0))[1:])
    return np.concatenate(parts)


def _step(cycle: float, speed: float) -> float:
    """Return the step of a ramp over a range of 2, `cycle` rows there and back."""
    return 2 / max(cycle / (2 * speed), LEAST_ROWS)


def _sweep(cycle: float) -> Array:
    """Return a sine that gets faster by the same factor in the same time, up to `FASTEST`."""
    first, last = max(1 / cycle, 1e-4), FASTEST
    if first >= last:
        return np.zeros(0)
    n = int(min(20 / first, MOST_ROWS / 4))
    k = np.arange(n)
    rate = np.log(last / first) / n
    return np.asarray(SMALL * np.sin(2 * np.pi * first * np.expm1(rate * k) / rate))
