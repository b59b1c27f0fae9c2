"""Oscillator with a Bouc-Wen force: linear estimate, parameters of the block."""

from __future__ import annotations

import numpy as np
import pytest

import hystfmu as hy
from hystfmu import Dataset, InputError
from hystfmu.identify.methods import bouc_wen_oscillator as kind

H, N = 1e-3, 2000
M, C, K = 2.0, 10.0, 5e4


def linear(lines=range(3, 40), m=M, c=C, k=K, noise=0.0):
    """Periodic force and displacement of m y'' + c y' + k y = u on these lines of the spectrum."""
    rng = np.random.default_rng(4)
    U = np.zeros(N // 2 + 1, complex)
    U[list(lines)] = np.exp(2j * np.pi * rng.random(len(lines)))
    s = 2j * np.pi * np.fft.rfftfreq(N, H)
    u, y = np.fft.irfft(N * U), np.fft.irfft(N * U / (m * s**2 + c * s + k))
    return u + 0.5, y + 1e-3 + noise * np.ptp(y) * rng.normal(size=N)


def test_the_linear_oscillator_of_a_spectrum():
    u, y = linear()
    assert kind.linear_oscillator(u, y, H) == pytest.approx((M, C, K), rel=1e-6)
    small = linear()[0] + 0.04 * np.cos(2 * np.pi * 300 * H * np.arange(N))  # lines below a tenth do not count
    assert kind.linear_oscillator(small, y, H) == pytest.approx((M, C, K), rel=1e-6)


@pytest.mark.parametrize("size", [1.0, 1e-7])
def test_its_weights_make_an_output_error(size):
    """Iterated weights 1 / |m s^2 + c s + k| of the last estimate, by other means: a general solver."""
    u, y = linear(noise=0.02)
    u = size * u  # in other units of measure
    U, Y = np.fft.rfft(u - u.mean()), np.fft.rfft(y - y.mean())
    lines = np.abs(U) > 0.1 * np.abs(U).max()
    s, U, Y = 2j * np.pi * np.fft.rfftfreq(N, H)[lines], U[lines], Y[lines]
    weight, x = np.ones(len(s)), np.zeros(3)
    rounds = kind.linear_oscillator.__defaults__[0]
    assert rounds == 10
    for _ in range(rounds):
        a = np.column_stack([s**2, s, s**0]) * (Y * weight)[:, None] * [1, 1e2, 1e4]
        a, b = np.vstack([a.real, a.imag]), np.concatenate([(U * weight).real, (U * weight).imag])
        x = np.linalg.pinv(a, rcond=1e-12) @ b * [1, 1e2, 1e4]
        weight = 1 / np.abs(np.column_stack([s**2, s, s**0]) @ x)
    assert kind.linear_oscillator(u, y, H) == pytest.approx(tuple(x), rel=1e-6)


def forced(rows=1500, m=2.0, c=15.0, k=3e4, beta=900.0, nu=1.0):
    """Record of a Bouc-Wen oscillator under tones of 5 to 60 Hz."""
    t, rng = H / 4 * np.arange(rows), np.random.default_rng(6)
    u = sum(10 * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in range(5, 60, 5))
    plant = hy.blocks.BoucWenOscillator(m_L=m, c_L=c, k_L=k, alpha=4e4, beta=beta, gamma=0.7, delta=-0.3, nu=nu)
    return hy.Dataset(t, u, plant(u, H / 4)[:, 0], unit_u="N", unit_y="m")


def test_the_parameters_of_the_plant_are_found_with_their_bounds():
    data = forced()
    model = hy.fit(data, "bouc_wen_oscillator")
    node, found = model.graph.node("plant"), model.fit["free"]
    want = {"m_L": 2.0, "c_L": 15.0, "k_L": 3e4, "alpha": 4e4}
    assert {k: node.value(k)[0] for k in want} == pytest.approx(want, rel=1e-3)
    products = node.value("beta")[0] * np.array([node.value("gamma")[0], node.value("delta")[0]])
    assert products == pytest.approx([630.0, -270.0], rel=1e-2)
    assert abs(node.value("gamma")[0]) + abs(node.value("delta")[0]) == pytest.approx(1.0, abs=1e-12)
    assert model.fit["parameters"] == 6
    assert set(found) == {f"plant.{k}" for k in (*want, "beta", "gamma", "delta")}
    assert (model.graph.inputs[0].unit, model.graph.inputs[0].start) == ("N", data.u[0])
    assert model.graph.outputs[0].unit == "m"


def test_the_sharpness_is_that_of_the_option():
    model = hy.fit(forced(beta=20.0, nu=2.0), "bouc_wen_oscillator", nu=2.0)
    assert model.graph.node("plant").value("nu")[0] == 2.0
    assert model.fit["rms_percent"] < 1e-3


def test_every_stride_th_training_row_counts():
    """Rows between them may hold anything."""
    data, rng = forced(), np.random.default_rng(1)
    y = data.y.copy()
    y[np.arange(len(y)) % 5 > 0] += 1e-6 * rng.normal(size=np.count_nonzero(np.arange(len(y)) % 5))
    model = hy.fit(data.with_output(y), "bouc_wen_oscillator", stride=5)
    assert np.abs(model.predict(data.u) - data.y)[::5].max() < 1e-4 * np.ptp(data.y)


@pytest.mark.parametrize(("m", "k", "words"), [(-M, K, "Got m_L = -2, k = 50000"), (M, -K, "Got m_L = 2, k = -50000")])
def test_a_mass_or_stiffness_below_0_is_refused(m, k, words):
    u, y = linear(m=m, k=k)
    with pytest.raises(InputError, match=r"must have m_L > 0 and k > 0\. " + words):
        hy.fit(Dataset.from_signal(u, y, H), "bouc_wen_oscillator")
