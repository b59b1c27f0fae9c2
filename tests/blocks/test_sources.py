"""Reference, disturbance and noise against their formulas, statistics, and their own derivatives by differences."""

from typing import Any

import numpy as np
import pytest
import scipy.signal
import scipy.stats
from numpy.typing import NDArray

from hystfmu import Unit, blocks

Array = NDArray[np.float64]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


REFERENCES: dict[str, dict[str, Any]] = {
    "sine": {"frequency": 3.0, "phase": 0.5},
    "triangle": {"frequency": 3.0, "phase": 0.5},
    "triangle, rounded": {"shape": "triangle", "frequency": 3.0, "phase": 0.5, "turn": 0.3},
    "decaying_sine": {"frequency": 3.0, "decay": 0.8},
    "multisine": {"f": [1.0, 2.5, 7.0], "a": [1.0, 0.5, 0.1], "ph": [0.0, 1.0, 2.0]},
    "steps": {"levels": [1.0, -2.0, 0.5], "T": 0.31},
    "random_reversals": {"m": 12, "frequency": 3.0, "seed": 5},
}


@pytest.mark.parametrize("shape", REFERENCES)
def test_reference_derivatives_and_lead(shape: str) -> None:
    """Derivatives against central differences of the signal itself; the preview against a later sample."""
    h, ahead = 1e-4, 25
    values = {"shape": shape} | REFERENCES[shape]
    made = blocks.Reference(amplitude=1.7, offset=0.3, lead=ahead * h, **values)
    r, r_lead, dr, ddr = made(np.zeros((15_000, 0)), h).T
    assert np.abs(r[ahead:] - r_lead[:-ahead]).max() <= 1e-10 or shape == "steps"
    assert np.mean(np.abs(r[ahead:] - r_lead[:-ahead]) > 1e-10) <= 1e-3  # a discontinuity may fall on either sample
    d1, d2 = (r_lead[2:] - r_lead[:-2]) / (2 * h), (dr[2:] - dr[:-2]) / (2 * h)
    curvature = np.diff(r_lead, 2) / h**2
    size = 1 + np.abs(ddr).max()
    kinks = np.abs(curvature - ddr[1:-1]) > 0.01 * size
    away = np.convolve(kinks, np.ones(7), "same") == 0
    assert away.mean() > 0.99
    assert np.abs(d1 - dr[1:-1])[away].max() <= 1e-4 * (1 + np.abs(dr).max())
    assert np.abs(d2 - ddr[1:-1])[away].max() <= 2e-3 * size


def test_random_reversals_are_nested_random_and_reproducible() -> None:
    m, f, h = 400, 5.0, 1e-3
    made = [blocks.Reference(shape="random_reversals", m=m, frequency=f, seed=s) for s in (1, 1, 2)]
    a, b, c = (x(np.zeros((41_000, 0)), h)[:, 0] for x in made)
    assert a.tobytes() == b.tobytes()
    assert np.abs(a - c).max() > 0.5
    levels = a[:: round(1 / (2 * f * h))][: m + 1]
    assert levels[0] == 0
    moves = np.diff(levels)
    assert (moves[::2] > 0).all()
    assert (moves[1::2] < 0).all()
    assert np.abs(levels).max() < 1
    # each level is uniform between the last one and the bound: its share of the way is uniform on (0, 1)
    bounds = np.where(np.arange(m) % 2, -1, 1)
    share = moves / (bounds - levels[:-1])
    assert scipy.stats.kstest(share, "uniform").pvalue > 0.01
    assert (a[round(m / (2 * f * h)) + 1 :] == levels[-1]).all()  # then it rests


def test_reference_keeps_its_phase_at_late_times() -> None:
    """A sine of 100 Hz after 1e6 s: the only error is that of the time itself (1e-10 s)."""
    t0 = 1e6
    y = blocks.Reference(m=1, frequency=100.0).graph.run(np.zeros((50, 0)), 1e-3, t0)[:, 0]
    t = t0 + np.arange(50) * 1e-3
    assert np.abs(y - np.sin(2 * np.pi * ((100 * t) % 1))).max() <= 1e-6


def test_noise_is_white_and_gaussian() -> None:
    n = 200_000
    w = blocks.Noise(sigma=2.0, seed=42)(np.zeros((n, 0))) / 2.0
    # five standard errors of each estimate
    assert abs(w.mean()) <= 5 / np.sqrt(n)
    assert abs(w.var() - 1) <= 5 * np.sqrt(2 / n)
    assert abs((w**3).mean()) <= 5 * np.sqrt(15 / n)
    assert abs((w**4).mean() - 3) <= 5 * np.sqrt(96 / n)
    assert scipy.stats.kstest(w, "norm").pvalue > 0.001
    spectrum = np.abs(np.fft.rfft(w)) ** 2 / n
    correlation = np.fft.irfft(spectrum)[1:200]
    assert np.abs(correlation).max() <= 5 / np.sqrt(n)
    squares = w**2 - 1  # nor are the magnitudes correlated
    assert abs(np.mean(squares[1:] * squares[:-1])) <= 5 * 2 / np.sqrt(n)


def test_noise_seeds_are_independent_and_reproducible() -> None:
    n = 50_000
    w = [blocks.Noise(seed=s)(np.zeros((n, 0))) for s in (7, 7, 8, 2**31 - 1)]
    assert w[0].tobytes() == w[1].tobytes()
    for other in w[2:]:
        for shift in range(-3, 4):
            assert abs(np.mean(w[0] * np.roll(other, shift))) <= 5 / np.sqrt(n)


def test_noise_advances_once_per_step_whatever_the_step() -> None:
    graph = blocks.Noise(seed=3).graph
    straight = graph.run(np.zeros((20, 0)), 1e-3)
    unit = Unit(graph)
    unit.initialize(5.0)
    values, t = [unit.get("w")], 5.0
    for h in rng().uniform(0.1, 1, 19):
        unit.do_step(t, h)
        t += h
        assert unit.get("w") == unit.get("w")
        values.append(unit.get("w"))
    assert np.array(values).tobytes() == straight.tobytes()
