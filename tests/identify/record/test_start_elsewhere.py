"""A signal that begins at another input than the record: the device has moved there, and so has its model."""

import numpy as np
import pytest
from foreign.solvers import FINER, bouc_wen, fine

import hystfmu as hy

H = 1e-3


def device(u: np.ndarray, **law: float) -> np.ndarray:
    return 0.4 * u + bouc_wen(fine(u), **law)[::FINER]


def path(turns: np.ndarray) -> np.ndarray:
    return np.interp(np.arange(40 * (len(turns) - 1) + 1) / 40, np.arange(len(turns)), turns)


@pytest.mark.parametrize("key", ["bouc_wen", "duhem", "g0_bouc_wen"])
def test_a_model_of_bouc_wen_or_duhem_moves_to_the_first_input(key: str) -> None:
    rng = np.random.default_rng(int(np.random.default_rng().integers(2**31)))
    law = {"beta": rng.uniform(0.8, 1.5), "gamma": rng.uniform(0.2, 0.6), "n": 1.0}
    first = rng.uniform(-1, 1)
    u = path(np.r_[first, 1.0, -1.0, rng.uniform(-1, 1, 30)])
    y = device(u, **law)
    model = hy.fit(hy.Dataset(H * np.arange(len(u)), 30 * u + 50, y), key)
    to = first - np.sign(first) * rng.uniform(0.5, 0.9)  # far enough for z to move
    other = path(np.r_[to, rng.uniform(-0.9, 0.9, 6)])
    way = np.linspace(first, to, 41)[:-1]
    wanted = device(np.r_[way, other], **law)[len(way) :]
    error = np.abs(model.predict(30 * other + 50, H) - wanted)
    assert error.max() <= 5e-3 * np.ptp(y)
