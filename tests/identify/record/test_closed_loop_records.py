"""Closed-loop records are warned about; open-loop records of many kinds are not."""

import numpy as np
import plants
import pytest

from hystfmu import Dataset, fit, synthetic
from hystfmu.data.signals import decaying_sine, training
from hystfmu.identify.excitation.timing import feedback


def noisy(u, plant=plants.prandtl_ishlinskii, noise=1e-3, seed=0):
    y = plant(u)
    return Dataset.from_signal(u, y + noise * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y)), 1e-3)


def tracked(seed, noise, Kp, Ki):
    """A sum of plays that follows a reference under feedback of its noisy output."""
    r, rng = 0.8 * training(40, seed, 0.03), np.random.default_rng(seed)
    width, z, total, u = np.linspace(0.05, 0.8, 10), np.zeros(10), 0.0, 0.0
    rows = []
    for wanted in r:
        z = np.minimum(np.maximum(z, u - width), u + width)
        y = 0.6 * u + 0.05 * z.sum() + noise * rng.normal()
        rows.append((u, y))
        total += Ki * (wanted - y)
        u = wanted + Kp * (wanted - y) + total
    return Dataset.from_signal(*np.array(rows).T, 1e-3)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(("noise", "Kp", "Ki"), [(2e-3, 0.3, 0.1), (5e-3, 0.0, 0.1), (1e-3, 0.5, 0.3)])
def test_feedback_is_seen(seed, noise, Kp, Ki):
    assert len(feedback(tracked(seed, noise, Kp, Ki))) == 1


def test_a_fit_reports_it():
    warned = fit(tracked(1, 5e-3, 0.3, 0.1), "prandtl_ishlinskii").fit["warnings"]
    assert sum("closed-loop" in w for w in warned) == 1


def walk(seed):
    return np.cumsum(np.random.default_rng(seed).normal(size=4000)) / 60


OPEN = {
    "nested reversals": lambda seed: noisy(training(40, seed, 0.03), seed=seed),
    "decaying sine": lambda seed: noisy(decaying_sine(20, 0.1), seed=seed),
    "walk": lambda seed: noisy(walk(seed), seed=seed),
    "white input": lambda seed: noisy(np.random.default_rng(seed).normal(size=2000), seed=seed),
    "Bouc-Wen": lambda seed: noisy(walk(seed)[:1500], plants.bouc_wen, seed=seed),
    "asymmetric": lambda seed: noisy(training(40, seed, 0.03), plants.asymmetric, seed=seed),
    "noise of the sensor of the input": lambda seed: noisy(
        training(40, seed, 0.03) + 1e-3 * np.random.default_rng(seed + 9).normal(size=len(training(40, seed, 0.03)))
    ),
    "16 levels": lambda seed: noisy(walk(seed), lambda u: np.round(8 * plants.prandtl_ishlinskii(u)) / 8, seed=seed),
    "piezo": lambda seed: synthetic.piezo(60, 1000.0, seed=seed),
    "open loop, late sensor": lambda seed: noisy(
        walk(seed), lambda u: np.roll(plants.prandtl_ishlinskii(u), 3), seed=seed
    ),
}


@pytest.mark.parametrize("name", OPEN)
@pytest.mark.parametrize("seed", [1, 2])
def test_open_loop_records_are_not_warned_about(name, seed):
    assert feedback(OPEN[name](seed)) == []
