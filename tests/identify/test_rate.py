"""Rate dependence: dynamics after plays, recovered from a plant that is solved on a finer grid, for an input that is no
ramp between samples; the rate without memory; the bound of the sliding mode law against its ODE."""

import numpy as np
import plants
import pytest
from foreign.solvers import late, mode
from scipy.integrate import solve_ivp

from hystfmu import Dataset, InputError, signals
from hystfmu.identify import errors, fit
from hystfmu.identify.estimate.dynamics import hysteresis
from hystfmu.inverse import inverse
from hystfmu.model import accuracy
from papers.rate_plant import RATE, actuator, excitation
from papers.statements import yu_alici_2005_smc

H, FINER = 1e-4, 20


def plant(u, seconds, f_n, zeta, delay, held=False):
    """Plays -> G0 -> delay (samples), in 20 exact steps per sample of H; u is a function of time."""
    n = round(seconds / H)
    at = np.arange(n * FINER + 1) // FINER * FINER if held else np.arange(n * FINER + 1)
    x = u(at * H / FINER)
    v = plants.W0 * x + plants.plays(x, plants.R, x[0]) @ plants.W
    out = late(mode(v, f_n, zeta, H / FINER), round(delay * FINER))
    return Dataset.from_signal(u(np.arange(n + 1) * H), out[::FINER], H)


def chirp(t):
    """100 Hz down to 2.5 Hz in 0.6 s, amplitude down to 0: figure 8 of the paper, 100 samples per cycle and more."""
    k = np.log(40) / 0.6
    return (1 - t / 0.6) * np.sin(2 * np.pi * 100 * -np.expm1(-k * t) / k)


def noisy(d, seed):
    return d.with_output(d.y + 5e-4 * np.ptp(d.y) * np.random.default_rng(seed).normal(size=len(d.y)))


@pytest.mark.turn("dynamics of a fit")
@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("f_n", "zeta", "delay"), [pytest.param(230.0, 0.4, 3.35, marks=pytest.mark.stress), (400.0, 0.7, 0.6)]
)
def test_the_dynamics_are_recovered_and_hold_on_other_signals(f_n, zeta, delay):
    d = noisy(plant(chirp, 0.6, f_n, zeta, delay), 1)
    m = fit(d, "g0_prandtl_ishlinskii", N=20)
    assert m.fit["f_n"] == pytest.approx(f_n, rel=0.01)
    assert m.fit["zeta"] == pytest.approx(zeta, rel=0.01)
    assert m.fit["delay"] / H == pytest.approx(delay, abs=0.1)
    tones = plant(lambda t: 0.6 * np.sin(2 * np.pi * 23 * t) + 0.3 * np.sin(2 * np.pi * 83 * t), 0.2, f_n, zeta, delay)
    assert errors(m.predict(tones.u), tones.y, d.span)["rms_percent"] <= 0.06


@pytest.mark.stress
def test_a_converter_that_holds_from_a_row_on_shows_as_one_more_sample():
    d = plant(chirp, 0.6, 300.0, 0.6, 1.25, held=True)
    m = fit(d, "g0_prandtl_ishlinskii", hold="zoh", N=20)
    assert m.fit["delay"] / H == pytest.approx(2.25, abs=0.1)
    assert m.fit["f_n"] == pytest.approx(300, rel=0.01)
    assert m.fit["rms_percent"] < 0.02


def test_without_dynamics_in_the_data_it_is_a_static_model():
    u = signals.training(60, 3)
    d = Dataset.from_signal(u, plants.prandtl_ishlinskii(u), 1e-3)
    m = fit(d, "g0_prandtl_ishlinskii", N=20)
    assert m.fit["rms_percent"] < 0.05
    assert m.fit["delay"] < 0.1e-3


@pytest.mark.turn("dynamics of a fit")
def test_the_static_part_has_the_exact_inverse():
    d = plant(chirp, 0.6, 300.0, 0.6, 2.25)
    m = fit(d, "g0_prandtl_ishlinskii", N=20, w0_min=0.1)
    static = hysteresis(m)
    wanted = 0.8 * d.y
    np.testing.assert_allclose(static.predict(inverse(static).predict(wanted)), wanted, atol=1e-12 * d.span)
    whole = inverse(m).fit
    assert whole["lag"] >= m.fit["delay"] - 0.5 / 20e3
    assert whole["cascade_max_percent"] <= 0.1
    with pytest.raises(InputError, match="prandtl_ishlinskii"):
        hysteresis(static)


# ---- network on the rate -----------------------------------------------------------------------------------------
@pytest.mark.stress
def test_a_rate_is_no_memory():
    """(u, du/dt) -> y is one-to-one on a single tone and nowhere else; the paper says it always is."""
    literal = {"memory": "none", "hidden": 12}
    t = np.arange(2000) / RATE
    tone = np.sin(2 * np.pi * 50 * t)
    one = fit(Dataset.from_signal(tone, actuator(tone), 1 / RATE), "rate_mlp", **literal)
    assert one.fit["rms_percent"] < 2  # the first branch, from rest, is no part of the loop
    u = np.concatenate([excitation("6", 0.3), excitation("8", 0.3)])
    d = Dataset.from_signal(u, actuator(u), 1 / RATE)
    tests = {"nested reversals": signals.nested_reversals(40, 7), "minor loops": signals.minor_loops(3)}
    first, ours = fit(d, "rate_mlp", **literal), fit(d, "rate_mlp", starts=1, iterations=60)
    of_first, of_ours = (accuracy.held_out_table(m, actuator, d.span, tests) for m in (first, ours))
    for name in tests:
        assert of_first[name]["rms_percent"] > 5
        assert of_ours[name]["rms_percent"] < of_first[name]["rms_percent"] / 10


def test_the_excitations_fall_and_rise_as_in_the_figures():
    for figure, frequency_falls, amplitude_falls in (("6", True, False), ("7", False, True), ("8", True, True)):
        u = excitation(figure)
        half_cycles = np.diff(np.flatnonzero(np.diff(np.sign(u)) != 0))
        assert (half_cycles[-1] > 10 * half_cycles[0]) == frequency_falls
        assert (half_cycles[0] > 10 * half_cycles[-1]) == (not frequency_falls)
        assert (np.abs(u[-1000:]).max() < 0.15) == amplitude_falls
        assert 0.85 < np.abs(u).max() <= 1
        assert abs(u[-1]) < 0.05, "the next one begins at 0"


# ---- bound of the sliding mode law -------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("eta", "rho", "eps", "D"), [(5, 1, 0.01, 1), (5, 2, 0.01, 1), (3, 0.2, 0.05, 1), (0.5, 1, 0.3, 0.4)]
)
def test_the_exact_bound_is_where_the_law_comes_to_rest(eta, rho, eps, D):
    law = lambda t, s: -eta * s - rho * s / (np.abs(s) + eps) + D  # noqa: E731
    exact = yu_alici_2005_smc.ultimate(eta, rho, eps, D)
    for start in (0.0, 3.0):
        end = solve_ivp(law, (0, 60), [start], method="LSODA", rtol=1e-10, atol=1e-12).y[0, -1]
        assert end == pytest.approx(exact, rel=1e-6)
    assert yu_alici_2005_smc.simulated(eta, rho, eps, D, seconds=40 / eta) == pytest.approx(exact, rel=1e-3)


def test_the_printed_bound_does_not_follow_from_the_law():
    assert yu_alici_2005_smc.printed(5, 0.01) == 0.0025
    assert yu_alici_2005_smc.ultimate(5, 1, 0.01, 1) == pytest.approx(0.04, rel=1e-12)  # 0.2 + 0.8 = 1
