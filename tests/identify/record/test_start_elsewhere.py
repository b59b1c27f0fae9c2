"""A signal that begins at another input than the record: the device has moved there, and so has its model."""

from __future__ import annotations

import numpy as np
import pytest

import hystfmu as hy

H, FINE = 1e-3, 20


def bouc_wen(u: np.ndarray, beta: float, gamma: float, n: float) -> np.ndarray:
    """Return 0.4 u + z by midpoint steps of z' = u' - beta |u'| |z|^(n-1) z - gamma u' |z|^n from z = 0."""
    z, out = 0.0, [0.0]

    def rate(z: float, d: float) -> float:
        return d - beta * abs(d) * abs(z) ** (n - 1) * z - gamma * d * abs(z) ** n

    for d in np.diff(u):
        for _ in range(FINE):
            z += rate(z + rate(z, d / FINE) / 2, d / FINE)
        out.append(z)
    return 0.4 * u + np.array(out)


def path(turns: np.ndarray) -> np.ndarray:
    return np.interp(np.arange(40 * (len(turns) - 1) + 1) / 40, np.arange(len(turns)), turns)


@pytest.mark.parametrize("key", ["bouc_wen", "duhem", "g0_bouc_wen"])
def test_a_model_of_bouc_wen_or_duhem_moves_to_the_first_input(key: str) -> None:
    rng = np.random.default_rng(int(np.random.default_rng().integers(2**31)))
    law = {"beta": rng.uniform(0.8, 1.5), "gamma": rng.uniform(0.2, 0.6), "n": 1.0}
    first = rng.uniform(-1, 1)
    u = path(np.r_[first, 1.0, -1.0, rng.uniform(-1, 1, 30)])
    y = bouc_wen(u, **law)
    model = hy.fit(hy.Dataset(H * np.arange(len(u)), 30 * u + 50, y), key)
    to = first - np.sign(first) * rng.uniform(0.5, 0.9)  # far enough for z to move
    other = path(np.r_[to, rng.uniform(-0.9, 0.9, 6)])
    way = np.linspace(first, to, 41)[:-1]
    wanted = bouc_wen(np.r_[way, other], **law)[len(way) :]
    error = np.abs(model.predict(30 * other + 50, H) - wanted)
    assert error.max() <= 5e-3 * np.ptp(y)
