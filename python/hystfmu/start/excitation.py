"""The next measurement: an input that shows memory, rate dependence and dynamics of a device separately."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.data.csv_file import write_csv
from hystfmu.data.signals import nested_reversals, ramps

REVERSALS = 40  # at each speed
SPEEDS = (1 / 3, 1.0, 3.0)  # of the reversals, relative to those of the record
LEAST_ROWS = 40  # between two ends of the range
REST = 0.1  # of the duration of the loops: creep
SMALL, FASTEST = 0.05, 0.1  # amplitude of the sweep (of half the range), and its last frequency (of the sample rate)
FINE = 0.01  # amplitude of a sweep over resonances, of half the range
ROWS = 5.0  # in a period of its last frequency, at least
PERIODS, WIDEST = 10.0, 300.0  # of its first frequency; last over first frequency, at most
MOST_ROWS = 200_000


def write_excitation(path: Path, data: Dataset, frequency: float, up_to: float | None = None) -> str:
    """Write the columns t and u of `excitation` to a CSV file.

    Parameters
    ----------
    path : Path
    data, frequency, up_to
        As for `excitation`.

    Returns
    -------
    str
        A line about the file: last frequency of the sweep, number of rows and rate; and a remark if the rate is higher
        than that of the record because of the sweep.
    """
    u, h = excitation(data, frequency, up_to)
    unit = f" [{data.unit_u}]" if data.unit_u else ""
    t: Array = h * np.arange(len(u), dtype=np.float64)
    write_csv(path, {"t [s]": t, f"u{unit}": u})
    highest = FASTEST / h if up_to is None else up_to
    line = f"sweep up to {highest:.4g} Hz, {len(u)} rows at {1 / h:.6g} Hz"
    if h == data.h:
        return line
    return (
        f"{line}: the record has {1 / data.h:.6g} Hz, of which {1 / (ROWS * data.h):.4g} Hz are the most that it shows"
    )


def excitation(data: Dataset, frequency: float, up_to: float | None = None) -> tuple[Array, float]:
    """Design an input for the range, the step and the speed of a record.

    A full loop, nested reversals at three speeds, a rest at the middle of the range, and a sweep of small amplitude.
    With `up_to`, the sweep shows resonances: it is five times smaller, because a lightly damped resonance amplifies it,
    and long enough to average the noise of a sensor.

    Parameters
    ----------
    data : Dataset
        Previous measurement.
    frequency : float
        Of a full loop (Hz) at the speed of the record.
    up_to : float, optional
        Last frequency of the sweep (Hz): at least twice the highest frequency of interest.

    Returns
    -------
    u : array, shape (n,)
        In the unit of measure of u. It starts and ends at the first input of the record. It is faster than the record
        if it would otherwise have more than `MOST_ROWS` rows.
    h : float
        Step (s): that of the record, or an integer fraction of it with `ROWS` rows per period of `up_to`.

    Raises
    ------
    InputError
        `up_to` is not positive.
    """
    if up_to is not None and not 0 < up_to < np.inf:
        raise InputError(f"The 'up_to' of an excitation must be a float in (0, inf). Got {up_to:g} instead.")
    h = data.h if up_to is None else data.h / max(1, int(np.ceil(ROWS * up_to * data.h * (1 - 1e-9))))
    lo, hi = float(data.u.min()), float(data.u.max())
    middle, half = (lo + hi) / 2, (hi - lo) / 2
    start = (float(data.u[0]) - middle) / half
    cycle = 1 / (frequency * h)
    sweep = None if up_to is None else _fast_sweep(frequency * h, up_to * h)
    v = _path(start, cycle, sweep)
    most = MOST_ROWS if sweep is None else MOST_ROWS / 2  # all of them have to be fitted
    while len(v) > most and cycle > LEAST_ROWS:  # never cut off, because it would end far from where it begins
        cycle /= 2
        v = _path(start, cycle, sweep)
    return np.asarray(middle + half * v), h


def _path(start: float, cycle: float, sweep: Array | None) -> Array:
    """Return the path in [-1, 1] from `start` back to it, with `cycle` rows for a full loop."""
    parts = [ramps([start, 1.0, -1.0, 1.0, -1.0, 0.0], _step(cycle, 1.0))]
    for k, speed in enumerate(SPEEDS):
        parts.append(nested_reversals(REVERSALS, seed=k + 1, step=_step(cycle, speed))[1:])
        parts.append(ramps([float(parts[-1][-1]), 0.0], _step(cycle, speed))[1:])
    parts.append(np.zeros(round(REST * sum(map(len, parts)))))
    parts.append(_sweep(cycle) if sweep is None else sweep)
    parts.append(ramps([float(parts[-1][-1]), start], _step(cycle, 1.0))[1:])
    return np.concatenate(parts)


def _step(cycle: float, speed: float) -> float:
    """Return the step of a ramp over a range of 2, `cycle` rows there and back."""
    return 2 / max(cycle / (2 * speed), LEAST_ROWS)


def _sweep(cycle: float) -> Array:
    """Return a sine with exponentially increasing frequency, up to `FASTEST`."""
    first, last = max(1 / cycle, 1e-4), FASTEST
    if first >= last:
        return np.zeros(0)
    return SMALL * _swept(first, last, int(min(20 / first, MOST_ROWS / 4)))


def _fast_sweep(first: float, last: float) -> Array:
    """Return the sweep from the frequency of a loop to another, both per row."""
    first = max(first, last / WIDEST)
    if first >= last:
        return np.zeros(0)
    return FINE * _swept(first, last, round(PERIODS * WIDEST / last))


def _swept(first: float, last: float, n: int) -> Array:
    """Return `n` rows of a sine whose frequency (per row) increases exponentially."""
    rate = np.log(last / first) / n
    return np.asarray(np.sin(2 * np.pi * first * np.expm1(rate * np.arange(n)) / rate))
