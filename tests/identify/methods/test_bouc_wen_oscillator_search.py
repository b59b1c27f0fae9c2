"""Oscillator with a Bouc-Wen force: linear estimate, parameters of the block, starts and limits."""

from __future__ import annotations

import numpy as np
import pytest
from searches import Spy

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


@pytest.fixture
def built(monkeypatch):
    def build(costs, options=None, data=None, **words):
        spy, told = Spy(iter(costs), **words), []
        monkeypatch.setattr(kind, "least_squares", spy)
        u, y = linear()
        data = Dataset(H * np.arange(N), u, y, unit_u="N", unit_y="m") if data is None else data
        return (*kind.build(data, {"nu": 1.0, "stride": 1, **(options or {})}, 0, told.append), spy, told, data)

    return build


SHAPES = [(0.3, 0.5, -0.5), (0.3, 0.5, 0.5), (0.7, 0.5, -0.5), (0.7, 0.5, 0.5)]
BOUND = [3.0, 6.0, 6.0, 6.0, 50.0, 50.0]


@pytest.mark.parametrize("nu", [1.0, 2.0])
def test_four_loop_shapes_and_the_best_to_the_end(built, nu):
    graph, parameters, found, spy, told, data = built([0.5, 0.4, 0.1, 0.3, 0.1], {"nu": nu}, step=0.01)
    starts = [[0, 0, np.log(1 - a), np.log(a), g / a**nu, d / a**nu] for a, g, d in SHAPES]
    assert [c.x0 for c in spy.calls[:4]] == [pytest.approx(s) for s in starts]
    assert spy.calls[4].x0 == pytest.approx(np.array(starts[2]) + 0.01)
    assert [c.words["max_nfev"] for c in spy.calls] == [8] * 4 + [60]
    assert (spy.calls[4].words["ftol"], spy.calls[4].words["xtol"]) == (1e-12, 1e-12)
    for call in spy.calls:
        assert call.bounds[1].tolist() == BOUND
        assert call.bounds[0].tolist() == [-b for b in BOUND]
        assert call.words["x_scale"].tolist() == [0.1, 0.3, 0.1, 0.1, 0.5, 0.5]
    assert told == pytest.approx([0, 0.15, 0.3, 0.45, 0.6])
    p = spy.calls[4].x0 + 0.01
    size = np.sqrt(np.mean(data.y**2))
    shape = p[4:] * K / (K * size) ** nu
    want = {
        "m_L": M * np.exp(p[0]), "c_L": C * np.exp(p[1]), "k_L": K * np.exp(p[2]), "alpha": K * np.exp(p[3]),
        "beta": np.abs(shape).sum(), "gamma": shape[0] / np.abs(shape).sum(), "delta": shape[1] / np.abs(shape).sum(),
        "nu": nu,
    }  # fmt: skip
    node = graph.node("plant")
    assert {k: node.value(k)[0] for k in want} == pytest.approx(want, rel=1e-5)
    assert parameters == 6
    names = ["ln m_L", "ln c_L", "ln k_L", "ln alpha", "gamma", "delta"]
    assert found["bounded"] == {name: pytest.approx((v, -b, b)) for name, v, b in zip(names, p, BOUND, strict=True)}
    run = graph.run(data.u, H).reshape(-1)
    assert spy.calls[4].fun(p) == pytest.approx((run - data.y) / size / np.sqrt(N))
    assert (graph.inputs[0].unit, graph.inputs[0].start, graph.outputs[0].unit) == ("N", data.u[0], "m")


def test_errors_are_finite_and_limited(built):
    *_, spy, _, _ = built([1.0] * 5)
    wild = spy.calls[0].fun(np.array([-3.0, -6.0, 6.0, 6.0, -50.0, -50.0]))
    assert np.isfinite(wild).all()
    assert np.abs(wild).max() <= 1e3
    still = spy.calls[0].fun(np.array([0, 0, 0, 0, 0.0, 0.0]))  # no shape: beta is 1
    assert np.isfinite(still).all()


def test_every_stride_th_training_row_counts(built):
    u, y = linear()
    data = Dataset.from_signal(u, y, H, "stride", slice(100, 1900))
    *_, spy, _, _ = built([1.0] * 5, {"stride": 7}, data)
    assert len(spy.calls[0].fun(spy.calls[0].x0)) == len(range(100, 1900, 7))


def test_a_small_damping_is_raised_to_half_a_percent(built):
    u, y = linear(c=1e-3)
    graph, *_ = built([1.0] * 5, data=Dataset.from_signal(u, y, H))
    assert graph.node("plant").value("c_L")[0] == pytest.approx(0.01 * np.sqrt(M * K), rel=1e-3)


@pytest.mark.parametrize(("m", "k", "words"), [(-M, K, "Got m_L = -2, k = 50000"), (M, -K, "Got m_L = 2, k = -50000")])
def test_a_mass_or_stiffness_below_0_is_refused(built, m, k, words):
    u, y = linear(m=m, k=k)
    with pytest.raises(InputError, match=r"must have m_L > 0 and k > 0\. " + words):
        built([1.0], data=Dataset.from_signal(u, y, H))
