"""The structured actuator on plants of its class that no default was tuned on: bent, stop-like, butterfly, with creep,
with dynamics.  The seeds of the plants are fixed here; `hystfmu reproduce fresh_plants` draws others."""

import numpy as np
import plants
import pytest
from scipy import signal

from hystfmu import Dataset, InputError, signals
from hystfmu.identify import errors, fit
from hystfmu.inverse import inverse

RNG = np.random.default_rng(11)
R = np.sort(RNG.uniform(0.05, 0.6, 10))
W = RNG.uniform(0.3, 1.7, 10)
STATIC = {"dynamics": "no", "creep": "no"}


def play_sum(u):
    return (3 * u + plants.plays(u, R) @ W) / 8


def bent(u):
    v = play_sum(u)
    return v + 0.2 * v**2 + 0.1 * v**3


def stops(u):
    v = (u[:, None] - plants.plays(u, R)) @ W / W.sum()
    return v + 0.3 * v**3


def butterfly(u):
    return play_sum(u) ** 2


def measured(plant, noise=1e-3, cycles=60):
    u = signals.training(cycles, 5)
    y = plant(u)
    return Dataset.from_signal(u, y + noise * np.ptp(y) * np.random.default_rng(2).normal(size=len(y)), 1e-3)


@pytest.mark.some(1)
@pytest.mark.parametrize(("plant", "said"), [(bent, "plays"), (stops, "stops"), (butterfly, "plays")])
def test_plants_of_its_class(plant, said):
    """S12 and S17 ask for 0.1 %FS on nested reversals and 0.5 %FS of the last two; noise is 0.1 % of the span."""
    m = fit(measured(plant), "actuator", **STATIC)
    assert m.fit["parts"].startswith(f"{said}, static nonlinearity")
    span = np.ptp(plant(signals.training(60, 5)))
    for name, u in signals.held_out(3).items():
        e = errors(m.predict(u), plant(u), span)
        assert e["rms_percent"] <= (0.1 if plant is bent else 0.5), name
    if plant is butterfly:
        with pytest.raises(InputError, match="increasing"):
            inverse(m)
    else:
        assert inverse(m).fit["cascade_max_percent"] <= 1e-8


def crept(u, h):
    """Bent plays, then creep of 5 % and 4 % in first-order lags that this test runs by itself."""
    b, out = bent(u), bent(u)
    for k, T in ((0.05, 0.03), (0.04, 0.5)):
        a = np.exp(-h / T)
        out = out + k * (signal.lfilter([1 - a], [1, -a], b - b[0]) + b[0])
    return out


@pytest.mark.turn("parameters of a kind")
def test_creep_is_found_and_its_inverse_is_exact():
    h = 1e-3
    m = fit(measured(lambda u: crept(u, h)), "actuator", dynamics="no")
    assert "creep" in m.fit["parts"]
    u = 0.8 * signals.nested_reversals(40, 7)
    assert errors(m.predict(u), crept(u, h), 2.0)["rms_percent"] <= 0.1
    found = inverse(m)
    assert found.provenance["inverse"] == "exact"
    assert found.fit["cascade_max_percent"] <= 1e-10


def test_parts_can_be_asked_for():
    m = fit(measured(bent, cycles=20), "actuator", N=10, operator="plays", bend=2, creep="yes", dynamics="no")
    assert m.fit["parts"].startswith("plays, static nonlinearity of degree 2, creep with")
    assert fit(measured(play_sum, cycles=20), "actuator", N=10, operator="plays", **STATIC).fit["parts"] == "plays"


@pytest.mark.turn("parameters of a kind")
@pytest.mark.some(2)
@pytest.mark.parametrize("plant", [bent, stops, butterfly, lambda u: crept(u, 1e-3)])
def test_a_fit_with_the_structure_of_another_has_its_components(plant):
    first = fit(measured(plant, cycles=20), "actuator", dynamics="no")
    again = fit(measured(plant, cycles=20, noise=2e-3), "actuator", **first.fit["structure"])
    assert again.fit["parts"] == first.fit["parts"]
    assert again.fit["rms_percent"] <= 0.25


@pytest.mark.stress
def test_s14_the_whole_actuator_from_one_record():
    """Plays, bend, creep of four decades and G0 at 500 Hz from 3 s of a multisine: 0.1 %FS on five other signals."""
    seed = int(np.random.SeedSequence().entropy % 2**32)
    h = 1e-4
    u = multisine(3, seed)
    y = whole(u)
    noisy = y + 1e-3 * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y))
    m = fit(Dataset.from_signal(u, noisy, h), "actuator")
    assert m.fit["f_n"] == pytest.approx(500, rel=1e-3), seed
    assert m.fit["zeta"] == pytest.approx(0.04, rel=0.02), seed
    t = np.arange(6000) * h
    rise = np.minimum(1, t / 0.02)
    others = {
        "multisine": multisine(2, seed + 1),
        "10 Hz": 0.8 * np.sin(20 * np.pi * t) * rise,
        "100 Hz triangle": 0.7 * signal.sawtooth(200 * np.pi * t + np.pi / 2, 0.5) * rise,
        "stairs": signal.lfilter(np.ones(40) / 40, [1], np.repeat([0, 0.3, 0.8, 0.5, -0.2, -0.7, 0.1, 0.6], 2000)),
        "1 Hz": 0.9 * np.sin(2 * np.pi * np.arange(20_000) * h),
    }
    for name, v in others.items():
        assert errors(m.predict(v, h), whole(v), np.ptp(y))["rms_percent"] <= 0.1, (name, seed)


def multisine(seconds, seed, h=1e-4, highest=300.0):
    n, rng = round(seconds / h), np.random.default_rng(seed)
    f = np.arange(n // 2 + 1) / seconds
    X = np.zeros(len(f), complex)
    lines = (f > 0) & (f <= highest)
    X[lines] = np.exp(2j * np.pi * rng.random(lines.sum())) / np.sqrt(f[lines])
    u = np.fft.irfft(X, n)
    return u / np.abs(u).max() * np.minimum(1, np.arange(n) / 200)


def whole(u, h=1e-4, finer=10):
    """Integrated in ten steps a row, the input a ramp between rows."""
    x = np.interp(np.arange((len(u) - 1) * finer + 1) / finer, np.arange(len(u)), u)
    v = play_sum(x)
    v = v + 0.06 * v**2
    c = v.copy()
    for T in (0.003, 0.03, 0.3, 3.0):
        a = np.exp(-h / finer / T)
        c += 0.012 * (signal.lfilter([1 - a], [1, -a], v - v[0]) + v[0])
    w = 2 * np.pi * 500
    b, a, _ = signal.cont2discrete(([w * w], [1, 0.08 * w, w * w]), h / finer, "foh")
    return signal.lfilter(b.ravel(), a, c - c[0])[::finer] + c[0]


@pytest.mark.stress
def test_a_second_mode_that_the_record_shows_stands_beside_the_first() -> None:
    """One mode alone leaves the other in the residuals, wherever the sweep excites it."""
    h, modes = 5e-4, ((200.0, 0.05, 0.92), (520.0, 0.02, 0.08))
    t = np.arange(2000) * h
    sweep = 0.05 * np.sin(2 * np.pi * (5 * t + 645 / (2 * t[-1]) * t**2))
    u = np.concatenate([signals.training(40, 5), sweep])
    v, fine = bent(u), 20
    held = np.repeat(v, fine)  # a converter holds each value
    w = [(2 * np.pi * f, zeta, share) for f, zeta, share in modes]
    times = np.arange(len(held)) * h / fine
    y = sum(signal.lsim(([k * p * p], [1, 2 * zeta * p, p * p]), held, times, interp=False)[1] for p, zeta, k in w)
    y = np.asarray(y)[::fine] + 2e-4 * np.random.default_rng(3).normal(size=len(v))
    m = fit(Dataset.from_signal(u, y, h), "actuator", creep="no", hold="zoh")
    (further,) = m.fit["modes"]
    assert (m.fit["f_n"], m.fit["zeta"]) == pytest.approx(modes[0][:2], rel=0.02)
    assert further == pytest.approx(modes[1], rel=0.05)
    assert "2 modes" in m.fit["parts"]
    assert m.fit["rms_percent"] < 0.06
