"""Synthetic data: the benchmark generator gives the official records; the piezo stack matches its documentation."""

import numpy as np
import plants
import pytest

from hystfmu import InputError, signals, synthetic


def rms(x):
    return np.sqrt(np.mean(np.square(x)))


@pytest.fixture(scope="module")
def official(measured):
    h5py = pytest.importorskip("h5py")
    path = measured / "boucwen_benchmark" / "test.h5"
    if not path.exists():
        pytest.skip(f"no {path}")
    with h5py.File(path) as f:
        return {k: (np.ravel(f[k]["u"]), np.ravel(f[k]["y"])) for k in ("multisine", "sinesweep")}


def test_official_multisine(official):
    """nonlinearbenchmark.org test record, 6.7e-4 m RMS: to 1e-14 m (rounding of a sum of 1e5 steps)."""
    u, y = official["multisine"]
    assert rms(y) > 6e-4
    assert rms(synthetic.benchmark_multisine(u) - y) < 1e-14


def test_official_sine_sweep(official):
    u, y = official["sinesweep"]
    force = synthetic.sweep(len(u) / synthetic.RATE)
    np.testing.assert_allclose(force[:: synthetic.UPSAMPLING], u, atol=1e-7)
    assert rms(synthetic.benchmark_sweep(force) - y) < 1e-14


def test_multisine_has_the_stated_lines_and_power():
    u = synthetic.multisine(seed=3)
    assert abs(rms(u) - 50) < 1e-9
    spectrum = np.abs(np.fft.rfft(u))
    f = np.arange(len(spectrum)) * 750 / len(u)
    inside = (f >= 5) & (f <= 150)
    assert spectrum[~inside].max() < 1e-9 * spectrum.max()
    np.testing.assert_allclose(spectrum[inside], spectrum[inside][0], rtol=1e-9)


def test_decimation_keeps_the_pass_band_and_its_phase():
    n = np.arange(4000)
    slow, fast = np.sin(2 * np.pi * n / 200), np.sin(2 * np.pi * n / 4.5)
    kept = synthetic.decimate(slow + fast, 5)
    assert len(kept) == 800
    assert np.abs(kept - slow[::5])[50:-50].max() < 5e-3


def test_stack_at_rest_speed_against_its_definition():
    """Far below 500 Hz and without creep's time to act, the mechanics drop out: plays, linear term, bent readout."""
    x = signals.nested_reversals(20, 4, step=0.002)
    z = 3.0 * x + plants.plays(x, np.linspace(0.1, 1, 10) / 2).sum(axis=1)
    z /= 3.0 + np.sum(1 - np.linspace(0.1, 1, 10) / 2)
    static = z + 0.06 * z**2 - 0.03 * z**3
    # steps of 1 s: lags of 0.05 s and 0.5 s follow at once (shares 0.02 and 0.015), the 5 s lag takes its time
    lag = np.zeros(len(x))
    for k in range(1, len(x)):
        lag[k] = lag[k - 1] + (1 - np.exp(-1 / 5)) * (static[k] - lag[k - 1])
    y = synthetic.stack(x, 1.0)
    assert np.abs(y - (1.035 * static + 0.01 * lag)).max() < 2e-3


def test_mechanics_have_the_stated_frequency_and_damping():
    """A small step on the linear range: overshoot exp(-pi zeta / sqrt(1 - zeta^2)) at half the damped period."""
    h = 1e-5
    y = synthetic.stack(np.r_[np.zeros(2), np.full(400, 1e-3)], h)
    z = 1e-3 * 3 / (3 + np.sum(1 - np.linspace(0.1, 1, 10) / 2))
    settled = z + 0.06 * z**2
    peak = int(np.argmax(y[:200]))
    wd = 2 * np.pi * 500 * np.sqrt(1 - 0.7**2)
    assert abs((peak - 1.5) * h - np.pi / wd) < 2 * h
    assert abs(y[peak] / settled - 1 - np.exp(-np.pi * 0.7 / np.sqrt(1 - 0.49))) < 3e-3


@pytest.mark.some(0.5)
def test_piezo_data_is_seeded_and_has_units_noise_and_reversals():
    a, b, other = synthetic.piezo(60), synthetic.piezo(60), synthetic.piezo(60, seed=1)
    assert a.sha256 == b.sha256 != other.sha256
    assert (a.unit_u, a.unit_y, a.h) == ("V", "um", 1e-3)
    assert a.u.min() >= 0
    assert a.u.max() <= 100
    noise = synthetic.piezo(60).y - synthetic.piezo(60, noise=0.0).y
    assert abs(noise.std() / (20 * 1e-3) - 1) < 0.02
    assert np.count_nonzero(np.diff(np.sign(np.diff(a.u)))) >= 60
    with pytest.raises(InputError, match="200 Hz"):
        synthetic.piezo(rate=100)
