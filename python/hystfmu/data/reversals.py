"""Reversals of a noisy input: noise estimate, and turning points outside the noise.

The estimate is difference-based (Gasser, Sroka & Jennen-Steinmetz, Biometrika 73 (1986) 625-633; Hall, Kay &
Titterington, Biometrika 77 (1990) 521-528). The k-th difference of a smooth path decreases with the step to the power
k. The k-th difference of white noise has the RMS sigma sqrt(C(2k, k)), and changes its sign in a share arccos(-k / (k +
1)) / pi of the rows. The first order k with about this share is used. The median of the absolute k-th differences gives
sigma; the median is robust to kinks. Trap: without the sign test, a coarsely sampled sine is taken for noise.
"""

from __future__ import annotations

from math import acos, comb, pi

import numpy as np

from hystfmu.base.arrays import Array

ORDERS = range(2, 9)
NEAR = 0.9  # fraction of the sign changes of white noise that counts as white
LEAST = 1e-9  # relative to the range: smaller values are rounding


def noise(v: Array) -> float:
    """Estimate the RMS sigma of white noise in a sampled path.

    Parameters
    ----------
    v : array, shape (n,)
        Evenly sampled path.

    Returns
    -------
    float
        Sigma in the unit of measure of v; 0 for a smooth path, or one that is held for most rows.
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
