"""Oscillators with a Bouc-Wen or a Duhem force: linear estimate, the fit, what is refused, passive parameters."""

import numpy as np
import plants
import pytest

import hystfmu as hy
from hystfmu import Dataset, InputError
from hystfmu.identify.methods import bouc_wen_oscillator as kind
from hystfmu.identify.methods import duhem_oscillator as duhem
from hystfmu.identify.methods.duhem_oscillator import Trial, physical

H = 1e-3
N = 2000
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
    for _ in range(10):
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


@pytest.mark.stress  # on other signals: ../test_duhem_oscillator.py
def test_a_plant_of_another_integrator():
    h, true = 5e-4, {"m_L": 2.0, "c_L": 15.0, "k_L": 3e4, "alpha": 4e4}
    spectrum = np.zeros(2001, complex)
    spectrum[10:120] = np.exp(2j * np.pi * np.random.default_rng(2).uniform(size=110))
    u = np.fft.irfft(spectrum, 4000)
    u *= 60 / u.std()
    model = hy.fit(Dataset.from_signal(u, plants.bouc_wen_oscillator(u, h, *true.values()), h), "bouc_wen_oscillator")
    assert model.fit["rms_percent"] < 0.02  # two integrators, 60 rows per period
    node = model.graph.node("plant")
    assert {k: node.value(k)[0] for k in true} == pytest.approx(true, rel=0.02)
    products = node.value("beta")[0] * np.array([node.value("gamma")[0], node.value("delta")[0]])
    assert products == pytest.approx([900.0, -400.0], rel=0.05)


@pytest.mark.turn("parameters of a kind")
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


# ---- Duhem force -----------------------------------------------------------------------------------------------------
ROWS = 800


def noisy_record(rows=1600, c=15.0, seed=6):
    """Record of an oscillator with a Bouc-Wen force under tones of 5 to 55 Hz."""
    t, rng = H / 4 * np.arange(rows), np.random.default_rng(seed)
    u = sum(10 * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in range(5, 60, 5))
    plant = hy.blocks.BoucWenOscillator(m_L=2.0, c_L=c, k_L=3e4, alpha=4e4, beta=900.0, gamma=0.7, delta=-0.3)
    y = plant(u, H / 4)[:, 0]
    return hy.Dataset(t, u, y + 1e-3 * np.ptp(y) * rng.normal(size=rows), unit_u="N", unit_y="m")


@pytest.fixture(scope="module")
def model():
    return hy.fit(noisy_record(), "duhem_oscillator")


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
    data = noisy_record()
    y = np.where(np.arange(1600) % 4 == 0, data.y, data.y + 1e-2 * np.ptp(data.y) * np.sin(np.arange(1600)))
    other = hy.fit(data.with_output(y), "duhem_oscillator", stride=4)
    e = (other.predict(data.u) - data.y)[::4]
    assert np.sqrt(np.mean(e**2)) < 0.002 * np.ptp(data.y)


@pytest.fixture
def refused(monkeypatch):
    """The build with a given linear oscillator."""
    rng = np.random.default_rng(1)
    data = Dataset(H * np.arange(ROWS), rng.normal(size=ROWS), 1e-3 * rng.normal(size=ROWS))

    def build(lead, stride=1):
        monkeypatch.setattr(duhem, "linear_oscillator", lambda u, y, h: lead)
        duhem.build(data, {"stride": stride}, 0, lambda f: None)

    return build


def test_a_soft_oscillator_is_one_too(refused):
    """It is refused for its output, not for its frequency."""
    for lead in ((1e-5, 1e-5, 0.5), (1e-6, 1e-6, 1e-3)):
        with pytest.raises(InputError, match=r"below that of the output 0"):
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
