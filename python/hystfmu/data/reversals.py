"""Reversals of a noisy input: noise estimate, turning points outside the noise, and resampling that keeps them.

The estimate is difference-based (Gasser, Sroka & Jennen-Steinmetz, Biometrika 73 (1986) 625-633; Hall, Kay &
Titterington, Biometrika 77 (1990) 521-528). The k-th difference of a smooth path decreases with the step to the power
k. The k-th difference of white noise has the RMS sigma sqrt(C(2k, k)), and changes its sign in a share arccos(-k / (k +
1)) / pi of the rows. The first order k with about this share is used. The median of the absolute k-th differences gives
sigma; the median is robust to kinks. Trap: without the sign test, a coarsely sampled sine is taken for noise.

Resampling to a fixed rate is linear. Linear interpolation cuts off a turning point between two new rows, but the memory
of hysteresis consists of extrema. So the new row nearest to a turning point of u has the measured values of this point.
The time error of this row is at most half a step, at a point where u is stationary. There is no low-pass filter: choose
a rate near the rate of the data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import acos, comb, pi

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data.columns import check_increasing, row_of, train_rows

ORDERS = range(2, 9)
NEAR = 0.9  # fraction of the sign changes of white noise that counts as white
LEAST = 1e-9  # relative to the range: smaller values are rounding


def noise(v: Array) -> float:
    """Estimate the RMS sigma of white noise in an evenly sampled path v (n,).

    Sigma is 0 for a smooth path, or one that is held for most rows.
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
    """Return the rows (m,) of the extrema of u (n,) after which u moves back by more than `band`.

    A plateau is not an extremum.
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
    """Return turning points (m,) of u (n,): u moves back by more than 6 sigma, and by more than 0.1 % of its range."""
    return turning_points(u, max(6 * noise(u), 1e-3 * float(np.ptp(u))))


GAP = 4.5  # median steps: three lost samples in a row are bridged, four are not
LOST = 0.02  # share of lost samples up to which a record is resampled without a word of its user
OFF = 0.3  # steps by which its stamps may then be off the even grid
FASTER = 2.0  # times the mean rate of the data: a higher rate would make rows without a measurement near them


@dataclass(frozen=True)
class Unevenness:
    """Times on an even grid of `rate` (Hz), up to jitter and some lost samples.

    `lost` of the `rows` points of the grid have no sample; `off` is the largest distance to the grid (steps).
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
    """Describe times (n,) that become uniform by a small correction; None for other times.

    At most 2 % of the samples may be lost, at most three in a row, and time stamps may deviate by 0.3 steps.
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
    rate = next(r for r in rates if abs(r * h - 1) * k[-1] <= max(far / 4, 1e-6))  # 2000 Hz, not 2000.00031
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
    """Resample t (s), u and y (NaN where none was measured), each (n,), to even steps, and convert row numbers.

    The new `rate` (Hz) is by default one over the median step. The new rows go from the first time to the last time, or
    to at most one step before; the returned slice covers the same time as the slice `rows`. `where` and `place` name
    data and rows for messages.

    Raises
    ------
    InputError
        Times do not increase, a gap is longer than 4.5 median steps, the rate is not positive or is above twice the
        mean rate, or fewer than 4 rows are left.
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
