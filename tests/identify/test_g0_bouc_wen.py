"""Bouc-Wen hysteresis before G0 with delay, on a plant of another integrator: Runge-Kutta in z, then an ODE for G0."""

import numpy as np
import pytest
from foreign.solvers import FINER, bouc_wen, fine, late, mode

from hystfmu import Dataset, InputError, signals
from hystfmu.identify import fit
from hystfmu.identify.estimate.dynamics import Dynamics, hysteresis
from hystfmu.inverse import inverse
from hystfmu.model import errors

H = 1e-4
BETA, GAMMA, N, LINEAR = 0.7, 0.4, 1.3, 0.5


def plant(u, f_n, zeta, delay):
    """Output rows for input rows u, a ramp between them: z by Runge-Kutta, G0 on a finer grid."""
    x = fine(u)
    v = LINEAR * x + bouc_wen(x, BETA, GAMMA, N)
    return late(mode(v, f_n, zeta, H / FINER), delay / H * FINER)[::FINER]


def multisine(seconds, f_max, seed):
    """Sixty tones from 1 Hz to f_max, in [-1, 1]."""
    t = np.arange(round(seconds / H) + 1) * H
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, 60)
    u = sum(f**-0.25 * np.sin(2 * np.pi * f * t + p) for f, p in zip(np.geomspace(1, f_max, 60), phases, strict=True))
    return u / np.abs(u).max()


def record(u, *dynamics, seed=1):
    y = plant(u, *dynamics)
    noise = 1e-3 * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y))
    return Dataset.from_signal(u, y + noise, H)


def moved_on(at_rest, u):
    """Output of the device of a record, which rested at its first input and moves on to that of other signals."""
    before = np.concatenate([np.linspace(at_rest, u[0], 200), np.full(200, u[0])])
    return plant(np.concatenate([before, u]), 500.0, 0.7, 0.0)[len(before) :]


@pytest.fixture(scope="module")
def found():
    return fit(record(multisine(1.0, 500, 3), 500.0, 0.7, 0.0), "g0_bouc_wen")


@pytest.mark.turn("dynamics of a fit", name="g0")
def test_hysteresis_and_dynamics_are_recovered_and_hold_on_other_signals(found):
    assert found.fit["f_n"] == pytest.approx(500, rel=0.005)
    assert found.fit["zeta"] == pytest.approx(0.7, rel=0.03)
    assert found.fit["delay"] == 0, "no delay in the plant: the data do not support one"
    assert found.fit["parameters"] == 9
    assert "warnings" not in found.fit
    t = np.arange(2001) * H
    tones = 0.6 * np.sin(2 * np.pi * 23 * t) + 0.3 * np.sin(2 * np.pi * 83 * t)
    for u in (tones, signals.nested_reversals(40, 9)):
        y = moved_on(multisine(1.0, 500, 3)[0], u)
        assert errors(found.predict(u, H), y, np.ptp(y))["rms_percent"] <= 0.1


@pytest.mark.stress
@pytest.mark.parametrize("seed", range(10))
def test_any_phases_and_noise_give_the_dynamics(seed):
    u = multisine(1.0, 500, 100 + seed)
    m = fit(record(u, 500.0, 0.7, 0.0, seed=200 + seed), "g0_bouc_wen")
    assert m.fit["f_n"] == pytest.approx(500, rel=0.005)
    assert m.fit["zeta"] == pytest.approx(0.7, rel=0.03)
    y = moved_on(u[0], held := signals.nested_reversals(40, seed))
    assert errors(m.predict(held, H), y, np.ptp(y))["rms_percent"] <= 0.1


def test_without_a_delay_none_is_found_or_warned_of():
    """delay_max = 0: a difference quotient steps below 0, which is no delay."""
    assert Dynamics.at([0.0, 0.0, -1e-5], H).delay == 0
    m = fit(record(multisine(0.15, 500, 6), 500.0, 0.7, 0.0), "g0_prandtl_ishlinskii", N=4, delay_max=0.0)
    assert m.fit["delay"] == 0
    assert not any("delay 0" in w for w in m.fit["warnings"])
    assert [n.name for n in m.graph.nodes if n.type == "delay"] == []


@pytest.mark.stress
def test_a_lightly_damped_plant_with_delay():
    m = fit(record(multisine(0.6, 400, 4), 230.0, 0.15, 3.3 * H), "g0_bouc_wen")
    assert m.fit["f_n"] == pytest.approx(230, rel=0.005)
    assert m.fit["zeta"] == pytest.approx(0.15, rel=0.03)
    assert m.fit["delay"] == pytest.approx(3.3 * H, abs=0.1 * H)


def test_one_slow_sine_does_not_tell_the_dynamics():
    t = np.arange(6001) * H
    m = fit(record(np.exp(-3 * t) * np.sin(2 * np.pi * 10 * t), 500.0, 0.7, 0.0), "g0_bouc_wen")
    assert any("f_n" in w for w in m.fit["warnings"])
    assert any("zeta" in w for w in m.fit["warnings"])


def test_a_model_of_the_wrong_class_does_not_claim_to_know_the_dynamics():
    m = fit(record(multisine(0.4, 500, 5), 500.0, 0.7, 0.0), "g0_prandtl_ishlinskii", N=10)
    assert m.fit["f_n"] != pytest.approx(500, rel=0.05)
    assert any("f_n" in w for w in m.fit["warnings"])


@pytest.mark.turn("dynamics of a fit", name="g0")
def test_the_static_part_has_an_implicit_inverse(found):
    static = hysteresis(found)
    assert static.key == "bouc_wen"
    y = 0.5 * np.sin(2 * np.pi * np.arange(400) / 200) * np.linspace(0, 1, 400)
    u = inverse(static, method="implicit").predict(y, H)
    assert static.predict(u, H) == pytest.approx(y, abs=1e-9)
    with pytest.raises(InputError, match="g0_"):
        hysteresis(static)
