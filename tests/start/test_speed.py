"""How fast a reference may be: the error at the corners against a simulation sample by sample."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from hystfmu.graph import Node
from hystfmu.start.device import FREQUENCY, GAIN
from hystfmu.start.speed import RESERVE, corner_error, fastest
from hystfmu.start.tuning import Gains

H, GAINS = 1e-3, Gains(0.05, 30.0, 5.0)


def device(f_n: float, zeta: float) -> Any:
    w = 2 * np.pi * f_n
    node = Node("g0", "transfer_function", {"nb": 0, "na": 2}, {"b": [w * w], "a": [1.0, 2 * zeta * w, w * w]})
    return SimpleNamespace(dynamics=(node,), delay=1, h=H, frequency=20.0)


def propagator(f_n: float, zeta: float) -> tuple[np.ndarray, np.ndarray]:
    w = 2 * np.pi * f_n
    M = expm(np.array([[0, 1, 0], [-w * w, -2 * zeta * w, w * w], [0, 0, 0]]) * H)
    return M[:2, :2], M[:2, 2]


def simulated(f: float, f_n: float, zeta: float, k: float, times: float, late: int) -> float:
    """Return the RMS error in percent of the stroke 2 behind the exact inverse of the nominal dynamics."""
    z = np.exp(2j * np.pi * f * H)
    A, b = propagator(f_n, zeta)
    nominal = np.linalg.solve(z * np.eye(2) - A, b)[0] / z**2  # computing, and the delay of the device
    n = round(40 / f / H)
    r = np.sin(2 * np.pi * f * H * np.arange(n))
    ahead = np.imag(np.exp(2j * np.pi * f * H * np.arange(n)) / nominal)
    A, b = propagator(times * f_n, zeta)
    x, sent, integral, e = np.zeros(2), [0.0] * (2 + late), 0.0, np.zeros(n)
    for i in range(n):
        e[i] = r[i] - k * x[0]
        integral += H * e[i]
        sent.append(ahead[i] + GAINS.Kp * e[i] + GAINS.Ki * integral)
        x = A @ x + b * sent.pop(0)
    return float(100 * np.sqrt(np.mean(e[n // 2 :] ** 2)) / 2)


def test_the_error_at_the_corners_is_that_of_a_simulation() -> None:
    rng = np.random.default_rng()
    f_n, zeta, f = float(rng.uniform(60, 200)), float(rng.uniform(0.3, 0.9)), float(rng.uniform(3, 12))
    corners = [(k, t, late) for k in (1 - GAIN, 1 + GAIN) for t in (1 - FREQUENCY, 1 + FREQUENCY) for late in (0, 1)]
    worst = max(simulated(f, f_n, zeta, *corner) for corner in corners)
    assert corner_error(device(f_n, zeta), GAINS, np.array([f]))[0] == pytest.approx(worst, rel=0.02), (f_n, zeta, f)


def test_the_record_is_as_fast_as_its_references_unless_the_corners_forbid() -> None:
    found = device(100.0, 0.5)
    f = fastest(found, GAINS, 5.0)
    assert f < found.frequency
    assert corner_error(found, GAINS, np.array([f, 1.06 * f])) == pytest.approx(5.0 * RESERVE, rel=0.1)
    found.frequency = 0.5 * f
    assert fastest(found, GAINS, 5.0) == found.frequency
