"""How fast a reference the loop follows where the device differs from its model.

Behind feed-forward and inverse of the model, the error of a device with slope k and dynamics G' instead of G is

    e = (1 - k G' / G) / (1 + k K G') r
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.design.frequency import response_of
from hystfmu.scenario.loop.held import held
from hystfmu.start.device import COMPUTING, FREQUENCY, GAIN, Device, faster
from hystfmu.start.tuning import Gains, in_series

SLOWER = np.geomspace(1.0, 0.01, 93)  # times the frequency of the record, 5 % from one to the next
RESERVE = 0.9  # of the error that is allowed


def corner_error(found: Device, gains: Gains, f: Array) -> Array:
    """Return the largest error that a sine has at the corners, a step of delay more included.

    Parameters
    ----------
    found : Device
    gains : Gains
    f : array, shape (m,)
        Frequencies of the sine (Hz).

    Returns
    -------
    array, shape (m,)
        RMS error in percent of the stroke, which is twice the amplitude.
    """
    z = np.exp(2j * np.pi * f * found.h)
    K = gains.Kp + gains.Ki * found.h * z / (z - 1)
    late = found.delay + COMPUTING
    G = response_of(held(in_series(found.dynamics), found.h, late), z)[:, 0, 0]
    worst = np.zeros(len(f))
    for times in (1 - FREQUENCY, 1 + FREQUENCY) if found.dynamics else (1.0,):
        dynamics = in_series([faster(n, times) for n in found.dynamics])
        for more in (0, 1):
            differing = response_of(held(dynamics, found.h, late + more), z)[:, 0, 0]
            for k in (1 - GAIN, 1 + GAIN):
                e = np.abs((1 - k * differing / G) / (1 + k * K * differing))
                worst = np.maximum(worst, 100 * e / np.sqrt(8))
    return worst


def fastest(found: Device, gains: Gains, percent: float) -> float:
    """Return the highest frequency, up to that of the record, that the corners follow to an error (Hz).

    Parameters
    ----------
    found : Device
    gains : Gains
    percent : float
        RMS error that is allowed at the corners, in percent of the stroke.

    Returns
    -------
    float
        That of the record if none is slow enough.
    """
    f = found.frequency * SLOWER
    held_ones = np.flatnonzero(corner_error(found, gains, f) <= RESERVE * percent)
    return float(f"{f[held_ones[0]]:.3g}") if len(held_ones) else found.frequency
