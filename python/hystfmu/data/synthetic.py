"""Synthetic data of a piezo stack, and of the Bouc-Wen benchmark from nonlinearbenchmark.org.

The piezo stack is computed in numpy with finer steps and without the C core. So a fitted model is compared with an
independent implementation. The benchmark is computed like its published data: Newmark integration at 15 kHz, followed
by the decimation that its authors used for each of the two official test records.

>>> import hystfmu as hy
>>> hy.synthetic.piezo(60, 1000.0)
Dataset('synthetic piezo stack', 12801 rows, step 0.001 s, u in V, y in um)
"""

from itertools import pairwise

import numpy as np

from hystfmu.base import Array, InputError, checked
from hystfmu.data.dataset import Dataset
from hystfmu.data.signals import nested_reversals
from hystfmu.graph import Graph, Node

__all__ = [
    "benchmark_multisine",
    "benchmark_sweep",
    "decimate",
    "displacement",
    "multisine",
    "oscillator",
    "piezo",
    "plays",
    "stack",
    "sweep",
]

# ---- synthetic piezo stack -------------------------------------------------------------------------------------------
WIDTHS = np.linspace(0.1, 1.0, 10)  # full dead-band widths of the ten backlash operators, twice the half-widths
W0 = 3.0  # weight of the linear term, 0.3 of the sum of the ten operators; w0 > 0 makes the plant invertible
BEND = (0.06, -0.03)  # asymmetric static nonlinearity z + 0.06 z^2 - 0.03 z^3
CREEP = ((0.02, 0.05), (0.015, 0.5), (0.01, 5.0))  # gain and time constant (s) of three first-order lags
F_N, ZETA = 500.0, 0.7  # Hz, 1: mechanics of the actuator
VOLTS, STROKE = 100.0, 20.0  # 0..100 V give about 2 x 20 um
FINER = 4


def plays(u: Array, r: Array, z: float = 0.0) -> Array:
    """Return the outputs (rows, n) of plays with half-widths r (n,) and initial output z, for an input u (rows,)."""
    state = np.full(len(r), z)
    out = np.empty((len(u), len(r)))
    for k, value in enumerate(u):
        state = np.maximum(value - r, np.minimum(value + r, state))
        out[k] = state
    return out


def stack(x: Array, h: float) -> Array:
    """Return the displacement (n,) of the piezo stack, about [-1, 1], for an input x (n,) in [-1, 1], from rest.

    The step between rows is h (s). The plant is a series connection of four parts. The first part is the sum of ten
    backlash operators and a linear term. The others are an asymmetric static nonlinearity, creep, and second-order
    mechanics. Each row is computed in four substeps with linearly interpolated input.
    """
    from scipy.signal import lfilter

    n = len(x)
    fine = np.interp(np.arange((n - 1) * FINER + 1) / FINER, np.arange(n), x)
    z = (W0 * fine + plays(fine, WIDTHS / 2).sum(axis=1)) / (W0 + np.sum(1 - WIDTHS / 2))
    z = z + BEND[0] * z**2 + BEND[1] * z**3
    dt = h / FINER
    crept = z.copy()
    for share, T in CREEP:
        a = np.exp(-dt / T)
        crept += share * lfilter([1 - a], [1, -a], z)
    b, a2 = _second_order(dt)
    return np.asarray(lfilter(b, a2, crept)[::FINER])


def displacement(u: Array, h: float) -> Array:
    """Return the displacement (n,) in um of the piezo stack without noise, for a voltage u (n,) in V.

    The step between rows is h (s).
    """
    return STROKE * stack(u / (VOLTS / 2) - 1, h)


def _second_order(dt: float) -> tuple[Array, Array]:
    """Return numerator and denominator in z of the mechanics, for an input that is constant over each step dt (s)."""
    w = 2 * np.pi * F_N
    wd, e = w * np.sqrt(1 - ZETA**2), np.exp(-ZETA * w * dt)
    c, s = np.cos(wd * dt), np.sin(wd * dt) * ZETA * w / wd
    return np.array([0.0, 1 - e * (c + s), e * (e + s - c)]), np.array([1.0, -2 * e * c, e * e])


@checked
def piezo(reversals: int = 100, rate: float = 1000.0, noise: float = 1e-3, seed: int = 0) -> Dataset:
    """Return a record of voltage and displacement of the synthetic piezo stack.

    The input is a full loop, followed by random nested reversals, five per second.

    Parameters
    ----------
    reversals : int
        Number of random reversals. A good model needs at least 60.
    rate : float
        Sampling rate (Hz), at least 200.
    noise : float
        RMS value of the sensor noise, as a fraction of half the stroke.
    seed : int
        Seed of the reversals and of the noise.

    Returns
    -------
    Dataset
        Record with t (s), u (V) and y (um).

    Raises
    ------
    InputError
        The rate is below 200 Hz.
    """
    if not (np.isfinite(rate) and rate >= 200):
        raise InputError(f"The rate must be at least 200 Hz. Got {rate} instead.")
    levels = [0.0, 1.0, -1.0, 1.0, -1.0, *_levels(reversals, seed)]
    per_ramp = round(rate / 5)
    blend = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, per_ramp + 1) / per_ramp)
    x = np.concatenate([[levels[0]], *[a + (b - a) * blend for a, b in pairwise(levels)]])
    u = VOLTS / 2 * (1 + x)
    y = displacement(u, 1 / rate) + STROKE * noise * np.random.default_rng(seed).normal(size=len(x))
    return Dataset(np.arange(len(x)) / rate, u, y, "synthetic piezo stack", unit_u="V", unit_y="um")


def _levels(count: int, seed: int) -> list[float]:
    """Return `count` extrema of a signal of random nested reversals, without its start value."""
    path = nested_reversals(count, seed, step=1.0)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(path))) != 0) + 1
    return [*path[turns].tolist(), float(path[-1])]


# ---- Bouc-Wen benchmark ----------------------------------------------------------------------------------------------
RATE, UPSAMPLING = 750, 20  # sampling rate (Hz), and Newmark steps per sample, which gives 15 kHz
DECIMATE_MULTISINE, DECIMATE_SWEEP = (2, 2, 5), (20,)


@checked
def multisine(n: int = 8192, f_lo: float = 5.0, f_hi: float = 150.0, rms: float = 50.0, seed: int = 0) -> Array:
    """Return one period (n,) of the random-phase multisine force (N) of the benchmark, sampled at 750 Hz.

    The signal contains the frequencies from `f_lo` to `f_hi` (Hz) with equal amplitudes. Its RMS value is `rms` (N).
    The number `seed` defines the phases.
    """
    f = np.arange(n // 2 + 1) * RATE / n
    spectrum = np.zeros(len(f), complex)
    lines = (f >= f_lo) & (f <= f_hi)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(seed).uniform(size=int(lines.sum())))
    u = np.fft.irfft(spectrum, n)
    return np.asarray(u * rms / np.sqrt(np.mean(u**2)))


@checked
def sweep(seconds: float = 204.0) -> Array:
    """Return the sine sweep 40 sin(2 pi (18 t + t^2/12)) (N) of the benchmark, shape (n,), sampled at 15 kHz.

    The sweep lasts `seconds` (s).
    """
    t = np.arange(round(seconds * RATE) * UPSAMPLING) / (RATE * UPSAMPLING)
    return np.asarray(40 * np.sin(2 * np.pi * (18 * t + t**2 / 12)))


@checked
def benchmark_multisine(u: Array, periods: int = 2) -> Array:
    """Return the displacement (n,) in m for one period of the force u (n,) in N, sampled at 750 Hz.

    The benchmark is simulated for `periods` periods of the force, and the last period is returned.
    """
    n = len(u)
    fine = np.fft.irfft(np.fft.rfft(u), n * UPSAMPLING) * UPSAMPLING
    # one extra period: the filters extrapolate at the end of the record, so this part is not returned
    y = oscillator(np.tile(fine, periods + 1))
    for factor in DECIMATE_MULTISINE:
        y = decimate(y, factor)
    return y[(periods - 1) * n : periods * n]


@checked
def benchmark_sweep(u: Array) -> Array:
    """Return the displacement (m) of the benchmark, sampled at 750 Hz, for a force u (N) at 15 kHz, from rest."""
    y = oscillator(u)
    for factor in DECIMATE_SWEEP:
        y = decimate(y, factor)
    return y


@checked
def oscillator(u: Array) -> Array:
    """Return the displacement (n,) in m of the oscillator of the benchmark, for a force u (n,) in N at 15 kHz.

    The C block `bouc_wen_oscillator` computes the displacement.
    """
    plant = Graph.single(Node("plant", "bouc_wen_oscillator"))
    return np.asarray(plant.run(u, 1 / (RATE * UPSAMPLING))[:, 0])


@checked
def decimate(y: Array, factor: int, order: int = 30) -> Array:
    """Return every factor-th row of the low-pass filtered signal y, like ``decimate(y, factor, 'fir')`` of MATLAB.

    The filter is a linear-phase FIR filter of the given `order` with a Hamming window. Its cut-off frequency is the new
    Nyquist frequency. The signal is extended by point reflection at its ends, and the delay of order / 2 rows is
    removed.
    """
    k = np.arange(order + 1) - order / 2
    b = np.sinc(k / factor) * np.hamming(order + 1)
    b /= b.sum()
    before = 2 * y[0] - y[order:0:-1]
    after = 2 * y[-1] - y[-2 : -order - 2 : -1]
    filtered = np.convolve(np.concatenate([before, y, after]), b)
    delay = order + order // 2
    return np.asarray(filtered[delay : delay + len(y) : factor])
