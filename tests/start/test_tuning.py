"""Gains of the loop: stable at the corners by an independent simulation, and no larger integral gain is."""

from __future__ import annotations

import numpy as np
import pytest
from hystfmu.start.tuning import MS_DB, SLOPES, Gains, tune
from scipy.linalg import expm

from hystfmu.base.errors import InputError
from hystfmu.graph import Node
from hystfmu.scenario.loop.held import held
from hystfmu.start.device import faster


def node(f_n: float, zeta: float, gain: float = 1.0) -> Node:
    w = 2 * np.pi * f_n
    return Node("g0", "transfer_function", {"nb": 0, "na": 2}, {"b": [gain * w * w], "a": [1.0, 2 * zeta * w, w * w]})


def grows(f_n: float, zeta: float, h: float, late: int, slope: float, gains: Gains) -> bool:
    """Simulate the loop from a step of the reference, sample by sample, and compare two stretches of its error."""
    w = 2 * np.pi * f_n
    M = expm(np.array([[0, 1, 0], [-w * w, -2 * zeta * w, w * w], [0, 0, 0]]) * h) if f_n else None
    x, sent, integral, errors = np.zeros(2), [0.0] * (late + 1), 0.0, []
    for _ in range(6000):
        held = sent.pop(0)
        if M is None:
            y = slope * held
        else:
            x = M[:2, :2] @ x + M[:2, 2] * held
            y = slope * x[0]
        e = 1.0 - y
        integral += h * e
        sent.append(gains.Kp * e + gains.Ki * integral)
        errors.append(e)
        if abs(e) > 1e6:
            return True
    return bool(np.abs(errors[-1000:]).max() > np.abs(errors[1000:2000]).max() + 1e-12)


def sensitivity_db(f_n: float, zeta: float, h: float, late: int, gains: Gains) -> float:
    z = np.exp(1j * np.geomspace(1e-4, 1, 20000) * np.pi)
    if f_n:
        w = 2 * np.pi * f_n
        M = expm(np.array([[0, 1, 0], [-w * w, -2 * zeta * w, w * w], [0, 0, 0]]) * h)
        det = (z - M[0, 0]) * (z - M[1, 1]) - M[0, 1] * M[1, 0]
        G = ((z - M[1, 1]) * M[0, 2] + M[0, 1] * M[1, 2]) / det
    else:
        G = 1 / z
    L = (gains.Kp + gains.Ki * h * z / (z - 1)) * G * z**-late
    return float(-20 * np.log10(np.abs(1 + L).min()))


SEED = np.random.default_rng().integers(2**31)
DRAWS = ["static", "damped", "stage", "drawn"]


@pytest.mark.parametrize("plant", DRAWS)
def test_stable_at_the_corners_and_not_too_slow(plant: str) -> None:
    rng = np.random.default_rng(SEED)
    drawn = float(rng.uniform(30, 2000)), float(rng.uniform(0.05, 1.2))
    f_n, zeta = {"static": (0.0, 0.0), "damped": (300.0, 0.7), "stage": (180.0, 0.02), "drawn": drawn}[plant]
    h, late = 1e-3, 1
    dynamics = [[node(f_n, zeta, 3.0)]] if f_n else [[]]
    dynamics += [[faster(dynamics[0][0], f)] for f in (0.8, 1.2)] if f_n else []
    gains = tune(dynamics, h, late)
    assert gains.Ms_db == pytest.approx(sensitivity_db(f_n, zeta, h, late, gains), abs=0.02), SEED
    assert gains.Ms_db <= MS_DB + 0.1, SEED
    for f in (0.8, 1.0, 1.2) if f_n else (1.0,):
        for slope in SLOPES:
            for more in (0, 1):
                assert not grows(f * f_n, zeta, h, late + more, slope, gains), (SEED, f, slope, more)
    more = Gains(gains.Kp, 1.4 * gains.Ki, 0.0)
    unstable = any(
        grows(f * f_n, zeta, h, late + 1, slope, more) for f in ((0.8, 1.0, 1.2) if f_n else (1.0,)) for slope in SLOPES
    )
    assert unstable or sensitivity_db(f_n, zeta, h, late, more) > MS_DB, SEED


@pytest.mark.parametrize(("delay", "first"), [(0.0, 1), (1.0, 2), (0.5, 1), (2.0, 3)])
def test_a_plant_without_dynamics_answers_the_held_command(delay: float, first: int) -> None:
    """Impulse response: what comes within a step is there at its end."""
    A, B, C, D = held((np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.full((1, 1), 3.0)), 1e-3, delay)
    x, y = np.zeros((len(A), 1)), []
    for k in range(6):
        u = np.full((1, 1), float(k == 0))
        y.append(float((C @ x + D @ u)[0, 0]))
        x = A @ x + B @ u
    assert y == [3.0 if k == first else 0.0 for k in range(6)]


def test_dynamics_that_differ_too_much_are_refused() -> None:
    unstable = Node("g0", "transfer_function", {"nb": 0, "na": 1}, {"b": [1.0], "a": [1.0, -2000.0]})
    with pytest.raises(InputError, match="must be stable at all corners"):
        tune([[unstable]], 1e-3, 1)


def test_rounding_leaves_the_peak_within_its_bound() -> None:
    """Some of these draws have their integral gain limited by the peak; digits rounded up would exceed it."""
    rng = np.random.default_rng()
    for _ in range(12):
        h, f = 10 ** rng.uniform(-5, -1), 10 ** rng.uniform(-1.5, -0.7)
        gains = tune([[node(f / h, zeta := rng.uniform(0.3, 1.0))]], h, 2.0)
        assert gains.Ms_db <= MS_DB
        assert sensitivity_db(f / h, zeta, h, 2, gains) <= MS_DB + 1e-3


@pytest.mark.parametrize("part", [0.1, 0.25, 0.4, 0.6, 0.75, 0.9])
def test_a_fast_mode_is_stable_for_delays_between_half_steps(part: float) -> None:
    """Of 0.76 of half the sampling frequency: with 0, 1/2 and 1 step alone its loop grew by 3 % a step between them."""
    wh, zeta = 2.3863, 0.0656
    w = np.array([wh * s for s in (1.0, 0.8, 1.2)])
    gains = tune([[node(float(x / (2 * np.pi)), zeta)] for x in w], 1.0, 1.0)
    for x in w:
        M = [expm(np.array([[0, 1, 0], [-x * x, -2 * zeta * x, x * x], [0, 0, 0]]) * t) for t in (part, 1 - part)]
        A = M[1][:2, :2] @ M[0][:2, :2]
        before, now = M[1][:2, :2] @ M[0][:2, 2], M[1][:2, 2]
        for slope in np.linspace(*SLOPES, 9):
            # states: mode, commands of the last two steps, integral; one step for computing, then a part of one
            I = np.array([-slope, 0, 0, 0, 1.0])  # noqa: E741
            u = gains.Ki * I + gains.Kp * np.array([-slope, 0, 0, 0, 0])
            mode = np.column_stack([A, now, before, np.zeros(2)])
            closed = np.vstack([mode, u, [0, 0, 1, 0, 0], I])
            assert np.abs(np.linalg.eigvals(closed)).max() < 1
