"""Oscillator with a Duhem force of free shape: the fit, what is refused, passive parameters."""

from __future__ import annotations

import numpy as np
import pytest

import hystfmu as hy
from hystfmu import Dataset, InputError
from hystfmu.identify.methods import duhem_oscillator as kind
from hystfmu.identify.methods.duhem_oscillator import Trial, physical

H, N = 1e-3, 800


def forced(rows=1600, c=15.0, seed=6):
    """Record of an oscillator with a Bouc-Wen force under tones of 5 to 55 Hz."""
    t, rng = H / 4 * np.arange(rows), np.random.default_rng(seed)
    u = sum(10 * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in range(5, 60, 5))
    plant = hy.blocks.BoucWenOscillator(m_L=2.0, c_L=c, k_L=3e4, alpha=4e4, beta=900.0, gamma=0.7, delta=-0.3)
    y = plant(u, H / 4)[:, 0]
    return hy.Dataset(t, u, y + 1e-3 * np.ptp(y) * rng.normal(size=rows), unit_u="N", unit_y="m")


@pytest.fixture(scope="module")
def model():
    return hy.fit(forced(), "duhem_oscillator")


def test_a_record_is_followed_to_its_noise_with_as_few_knots_as_it_supports(model):
    assert model.fit["rms_percent"] == pytest.approx(0.1, rel=0.1)
    node = model.graph.node("plant")
    assert model.fit["parameters"] == 3 + node.dims["n"]
    assert node.dims["n"] in (5, 9)
    f = node.value("f")
    assert (f >= f[::-1])[: len(f) // 2].all()  # of two knots the stiffer one counts where the motion turns
    assert model.fit["free"]["plant.m_L"]["value"] == pytest.approx(2.0, rel=0.01)
    assert model.fit["free"]["plant.m_L"]["standard_error"] < 0.01
    assert (model.graph.inputs[0].unit, model.graph.outputs[0].unit) == ("N", "m")


def test_every_stride_th_row_counts(model):
    """Rows between them may hold anything."""
    data = forced()
    y = np.where(np.arange(1600) % 4 == 0, data.y, data.y + 1e-2 * np.ptp(data.y) * np.sin(np.arange(1600)))
    other = hy.fit(data.with_output(y), "duhem_oscillator", stride=4)
    e = (other.predict(data.u) - data.y)[::4]
    assert np.sqrt(np.mean(e**2)) < 0.002 * np.ptp(data.y)


@pytest.fixture
def refused(monkeypatch):
    """The build with a given linear oscillator."""
    rng = np.random.default_rng(1)
    data = Dataset(H * np.arange(N), rng.normal(size=N), 1e-3 * rng.normal(size=N))

    def build(lead, stride=1):
        monkeypatch.setattr(kind, "linear_oscillator", lambda u, y, h: lead)
        kind.build(data, {"stride": stride}, 0, lambda f: None)

    return build


def test_a_soft_oscillator_is_one_too(refused):
    """It is refused for its output, not for its frequency."""
    for lead in ((1e-5, 1e-5, 0.5), (1e-6, 1e-6, 1e-3)):
        with pytest.raises(InputError, match=r"than no output at all"):
            refused(lead)


@pytest.mark.parametrize("lead", [(-1.0, 1.0, 5e4), (1.0, 1.0, -5e4), (1.0, 1.0, (np.pi / H) ** 2)])
def test_an_oscillator_that_the_rows_cannot_hold_is_refused(refused, lead):
    with pytest.raises(InputError, match=r"must have m_L > 0, k > 0 .* pi/h = 3.14e\+03 1/s\. Got m_L = "):
        refused(lead)


def test_a_longer_step_holds_less(refused):
    with pytest.raises(InputError, match=r"pi/h = 1.57e\+03"):
        refused((1.0, 1.0, (0.9 * np.pi / H) ** 2), stride=2)


def test_more_parameters_must_gain_by_the_bayesian_information_criterion():
    def trial(n, cost):
        return Trial(np.zeros(n), 1.0, cost, 100)

    worth = np.exp(-4 * np.log(100) / 100)  # four more: n ln(ratio) must exceed 4 ln n
    assert trial(12, 0.999 * worth).beats(trial(8, 1.0))
    assert not trial(12, 1.001 * worth).beats(trial(8, 1.0))
    one = np.exp(-np.log(100) / 100)
    assert trial(8, 0.999 * one).beats(trial(8, 1.0))
    assert not trial(8, 1.001 * one).beats(trial(8, 1.0))
    assert trial(8, 0.0).beats(trial(8, 1.0))


def test_the_stiffer_of_two_knots_counts_where_the_motion_turns():
    p = physical(np.array([-1.0, 0.5, 1e-4, 0.1, 0.9, 0.3, 0.2, 0.6]))
    assert p.tolist() == [1e-3, 0.5, 1e-3, 0.6, 0.9, 0.3, 0.2, 0.1]
    assert physical(np.array([1.0, 1, 1, -0.5, -0.6]))[3:].tolist() == [1e-3, -0.6]
    assert physical(np.array([1.0, 1, 1, 0.2, 0.3, 0.5, 0.6]))[3:].tolist() == [0.6, 0.5, 0.3, 0.2]
