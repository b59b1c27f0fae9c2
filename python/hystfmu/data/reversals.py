"""Reversals of a noisy input: estimate of the noise, search of turning points, and resampling that preserves them.

The noise is estimated from differences of the signal (Gasser, Sroka & Jennen-Steinmetz, Biometrika 73 (1986) 625-633;
Hall, Kay & Titterington, Biometrika 77 (1990) 521-528). The k-th difference of a smooth signal decreases with the k-th
power of the step. The k-th difference of white noise has the RMS sigma sqrt(C(2k, k)). Its sign changes in the fraction
arccos(-k / (k + 1)) / pi of the rows. The estimate uses the smallest order k for which the sign changes about as often
as in white noise. The median of the absolute k-th differences gives sigma; the median is robust to kinks. Trap: without
the test of the sign changes, a coarsely sampled sine is taken for noise.

Resampling to a fixed rate uses linear interpolation, which removes a turning point between two new rows. But the memory
of hysteresis consists of extrema. So the new row nearest to a turning point of u gets the measured values of this
point. The time error of this row is at most half a step, at a point where u is stationary. There is no low-pass filter,
so the new rate should be near the rate of the data.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import acos, comb, pi

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.data.columns import check_increasing, row_of, train_rows

ORDERS = range(2, 9)
NEAR = 0.9  # a signal with at least this fraction of the sign changes of white noise is treated as white noise
LEAST = 1e-9  # noise below this fraction of the range is treated as rounding error


def noise(v: Array) -> float:
    """Return an estimate of the RMS value sigma of the white noise in a signal v (n,) with equal time steps.

    Sigma is 0 for a smooth signal, and for a signal that is constant in most rows.
    """
    width = float(np.ptp(v)) if len(v) else 0.0
    for k in ORDERS:
        d = np.diff(v, k)
        if len(d) < 10:
            break
        if np.mean(d[1:] * d[:-1] < 0) >= NEAR * acos(-k / (k + 1)) / pi:
            sigma = float(np.median(np.abs(d))) / 0.6745 / comb(2 * k, k) ** 0.5
            return sigma if sigma > LEAST * width else 0.0
    return 0.0


def turning_points(u: Array, band: float) -> Array:
    """Return the rows (m,) of those extrema of u (n,) after which u moves back by more than `band`.

    A constant part between two ramps in the same direction is not an extremum.
    """
    found: list[int] = []
    top = bottom = direction = 0
    for k, value in enumerate(u.tolist()):
        top = k if value >= u[top] else top
        bottom = k if value <= u[bottom] else bottom
        if direction >= 0 and value < u[top] - band:
            found += [top] if top > 0 else []
            direction, bottom = -1, k
            top = k
        elif direction <= 0 and value > u[bottom] + band:
            found += [bottom] if bottom > 0 else []
            direction, top = 1, k
            bottom = k
    return np.array(found, dtype=int)


def reversals(u: Array) -> Array:
    """Return the rows (m,) of the turning points of a noisy input u (n,).

    After a turning point, u moves back by more than 6 sigma of its noise and by more than 0.1 % of its range.
    """
    return turning_points(u, max(6 * noise(u), 1e-3 * float(np.ptp(u))))


GAP = 4.5  # maximum gap in median steps: three consecutive lost samples are permitted, four are not
LOST = 0.02  # maximum fraction of lost samples for which a record is resampled without request
OFF = 0.3  # maximum deviation of time stamps from the uniform grid, in steps, for which this is done
FASTER = 2.0  # maximum new rate, relative to the mean rate of the data; a higher rate gives rows far from any sample


@dataclass(frozen=True)
class Unevenness:
    """Deviations of time stamps from a uniform grid of `rate` (Hz): jitter and lost samples.

    `rows` is the number of grid points, and `lost` is the number of grid points without a sample. `off` is the largest
    distance of a stamp from its grid point, in steps.
    """

    rate: float
    lost: int
    rows: int
    off: float

    def __str__(self) -> str:
        faults = [f"{self.lost} of {self.rows} samples were lost"] if self.lost else []
        faults += [f"stamps off by up to {100 * self.off:.2g} % of a step"] if self.off > 1e-3 else []
        return f"resampled to {self.rate:.6g} Hz: {', '.join(faults) or 'uneven steps'}"


def unevenness(t: Array) -> Unevenness | None:
    """Return the deviations of times (n,) from a uniform grid; None if the deviations are too large for a correction.

    At most 2 % of the samples and at most three consecutive samples may be missing. The time stamps may deviate by at
    most 0.3 steps.
    """
    steps = np.diff(t)
    median = float(np.median(steps))
    if not median > 0 or steps.min() <= 0:
        return None
    counts = np.rint(steps / median)
    k = np.concatenate(([0.0], np.cumsum(counts)))
    rows = int(k[-1]) + 1
    if counts.min() < 1 or steps.max() > GAP * median or rows - len(t) > LOST * rows:
        return None
    h = float(np.polynomial.polynomial.polyfit(k / k[-1], t - t[0], 1)[1]) / float(k[-1])
    off = t - t[0] - k * h
    far = float(np.abs(off - np.median(off)).max()) / h
    if far > OFF:
        return None
    rates = (float(f"{1 / h:.{digits}g}") for digits in range(3, 18))
    rate = next(r for r in rates if abs(r * h - 1) * k[-1] <= max(far / 4, 1e-6))  # 2000 Hz instead of 2000.00031 Hz
    return Unevenness(rate, rows - len(t), rows, far)


def resample(
    t: Array,
    u: Array,
    y: Array,
    rate: float | None,
    where: str,
    place: Callable[[int], str] | None = None,
    rows: slice = slice(None),
) -> tuple[Array, Array, Array, slice]:
    """Return t (s), u and y with equal time steps, and the slice of new rows that corresponds to `rows`.

    The output y is NaN where it was not measured. By default, the new step is the median step; otherwise `rate` (Hz)
    defines it. The new rows begin at the first time and end at most one step before the last time. The returned slice
    covers the same time span as the slice `rows`. `where` is the name of the data for messages, and `place` returns a
    text that identifies a row.

    Raises
    ------
    InputError
        The times do not increase, a gap is longer than 4.5 median steps, the rate is not positive or exceeds twice the
        mean rate, or fewer than 4 rows remain.
    """
    place = place or partial(row_of, where)
    check_increasing(t, place)
    steps = np.diff(t)
    median, mean = float(np.median(steps)), float(t[-1] - t[0]) / len(steps)
    n = int(np.argmax(steps))
    if steps[n] > GAP * median:
        raise InputError(
            f"{place(n + 1)}: The gap between two samples must be at most {GAP} median steps of {median:.6g} s when "
            f"resampling. Got {steps[n]:.6g} s instead: split the data there."
        )
    rate = 1 / median if rate is None else rate
    if not (np.isfinite(rate) and 0 < rate <= FASTER / mean):
        raise InputError(
            f"{where}: The rate to resample to must be above 0 and at most {FASTER:g} times the {1 / mean:.6g} Hz of "
            f"the data. Got {rate:g} instead."
        )
    grid: Array = t[0] + np.arange(int((t[-1] - t[0]) * rate * (1 + 1e-12)) + 1) / rate
    u_new, y_new = np.interp(grid, t, u), np.interp(grid, t, y)
    turns = reversals(u)
    nearest = np.clip(np.rint((t[turns] - t[0]) * rate).astype(int), 0, len(grid) - 1)
    u_new[nearest], y_new[nearest] = u[turns], y[turns]
    first, end = np.searchsorted(grid, t[rows][[0, -1]] + [-1e-9, 1e-9] * np.diff(grid[:2]))
    return grid, u_new, y_new, train_rows((int(first), int(end)), len(grid), f"{where}, resampled")
