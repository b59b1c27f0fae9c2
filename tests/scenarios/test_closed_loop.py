"""A closed loop written out in NumPy and SciPy, independent of graph, blocks and master, agrees to rounding."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.signal
from engines import ready

from hystfmu.scenario import simulate


def test_plays_g0_and_pid_in_numpy(loop: Any, write: Any) -> None:
    trace = simulate(ready(write(loop)))
    h, n = 1e-4, 300
    omega = 2 * np.pi * 500
    A, B, C, D = scipy.signal.tf2ss([omega**2], [1, 1.4 * omega, omega**2])
    Ad, Bd, *_ = scipy.signal.cont2discrete((A, B, C, D), h, "zoh")
    r, w = np.array([0.1, 0.2, 0.3]), np.array([0.3, 0.2, 0.1])
    z, x, integral, u = np.zeros(3), np.zeros(2), 0.0, 0.0
    e_last, expected = 0.0, [0.0]
    u = 0.125  # at the start: no error, no derivative
    for k in range(1, n + 1):
        # the plant moves on under the command of the last sample, then the controller sees its new output
        z = np.clip(z, u - r, u + r)
        x = Ad @ x + Bd[:, 0] * (0.3 * u + w @ z)
        y = (C @ x)[0]
        e = np.sin(2 * np.pi * 50 * k * h) - y
        integral += e * h
        u = 0.125 + 1.0 * e + 2000.0 * integral + 2e-4 * (e - e_last) / h
        e_last = e
        expected.append(y)
    gap = np.abs(trace["plant.y"] - np.array(expected)).max()
    assert gap < 1e-12, gap
    assert np.ptp(expected) > 1
