"""Bouc-Wen hysteresis before G0 with delay, on a plant of another integrator: Runge-Kutta in z, then an ODE for G0."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from hystfmu import Dataset, InputError
from hystfmu.data import signals
from hystfmu.identify import fit
from hystfmu.identify.estimate.dynamics import Dynamics, hysteresis
from hystfmu.identify.estimate.search import correlation_time, standard_errors
from hystfmu.inverse import inverse
from hystfmu.model.accuracy import errors

H, FINER = 1e-4, 10
A, BETA, GAMMA, N, LINEAR = 1.0, 0.7, 0.4, 1.3, 0.5


def plant(u, f_n, zeta, delay):
    """Output rows for input rows u, a ramp between them: z by Runge-Kutta, G0 in steps of a tenth of H."""
    fine = np.interp(np.arange((len(u) - 1) * FINER + 1) / FINER, np.arange(len(u)), u)
    z, v = 0.0, np.empty(len(fine))
    v[0] = LINEAR * fine[0]
    for k, d in enumerate(np.diff(fine), 1):
        s = np.sign(d)

        def rate(z, s=s):
            return A - abs(z) ** N * (GAMMA + BETA * np.sign(z) * s)

        k1 = rate(z)
        k2 = rate(z + d / 2 * k1)
        k3 = rate(z + d / 2 * k2)
        z += d / 6 * (k1 + 2 * k2 + 2 * k3 + rate(z + d * k3))
        v[k] = LINEAR * fine[k] + z
    w = 2 * np.pi * f_n
    b, a, _ = cont2discrete(([w * w], [1, 2 * zeta * w, w * w]), H / FINER, method="foh")
    y = v[0] + lfilter(np.ravel(b), a, v - v[0])
    late = round(delay / H * FINER)
    return np.concatenate([np.full(late, y[0]), y])[: len(y) : FINER][: len(u)]


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


def test_the_static_part_has_an_implicit_inverse(found):
    static = hysteresis(found)
    assert static.key == "bouc_wen"
    y = 0.5 * np.sin(2 * np.pi * np.arange(400) / 200) * np.linspace(0, 1, 400)
    u = inverse(static, method="implicit").predict(y, H)
    assert static.predict(u, H) == pytest.approx(y, abs=1e-9)
    with pytest.raises(InputError, match="g0_"):
        hysteresis(static)


def test_standard_errors_are_those_of_a_straight_line():
    """Against the textbook formula: sigma / sqrt(sum (x - mean)^2) for the slope."""
    rng = np.random.default_rng(0)
    x, noise = np.linspace(0, 1, 4000), rng.normal(size=4000)
    jacobian = np.column_stack([np.ones_like(x), x])
    residuals = noise - jacobian @ np.linalg.lstsq(jacobian, noise, rcond=None)[0]
    slope = standard_errors(residuals, jacobian, np.array([True, True]))[1]
    assert slope == pytest.approx(1 / np.sqrt(np.sum((x - 0.5) ** 2)), rel=0.2)
    assert standard_errors(residuals, jacobian, np.array([True, False]))[1] == 0
    assert np.isinf(standard_errors(residuals, jacobian * [1, 0], np.array([True, True]))[1])


def test_slow_residuals_count_for_fewer_rows():
    """An autoregression e_k = a e_(k-1) + w_k has the correlation time (1 + a) / (1 - a)."""
    e = lfilter([1.0], [1.0, -0.9], np.random.default_rng(1).normal(size=100_000))
    assert correlation_time(e) == pytest.approx(19, rel=0.15)
    assert correlation_time(np.random.default_rng(2).normal(size=10_000)) == pytest.approx(1, abs=0.2)
