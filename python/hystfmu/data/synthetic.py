"""Built-in data, generated on demand: a synthetic piezo stack, and the Bouc-Wen benchmark of nonlinearbenchmark.org.

The stack is written in numpy, apart from the C core and with finer steps, so that a model identified with the core is
held against something else.  The benchmark follows its authors: Newmark at 15 kHz, then the decimation that was used
for each of the two official test records.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
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
WIDTHS = np.linspace(0.1, 1.0, 10)  # full dead-band widths of the ten backlash operators; half-widths are half of it
W0 = 3.0  # weight of the linear term, 0.3 of the ten operators: w0 > 0, so that the plant has an inverse
BEND = (0.06, -0.03)  # asymmetric readout: z + 0.06 z^2 - 0.03 z^3
CREEP = ((0.02, 0.05), (0.015, 0.5), (0.01, 5.0))  # share and time constant (s) of three lags
F_N, ZETA = 500.0, 0.7  # Hz: the actuator's mechanics
VOLTS, STROKE = 100.0, 20.0  # 0..100 V give about 2 x 20 um
FINER = 4


def plays(u: Array, r: Array, z: float = 0.0) -> Array:
    """Plays of half-widths r (n,) along an input u (rows,) from rest at z, row by row in numpy: shape (rows, n)."""
    state = np.full(len(r), z)
    out = np.empty((len(u), len(r)))
    for k, value in enumerate(u):
        state = np.maximum(value - r, np.minimum(value + r, state))
        out[k] = state
    return out


def stack(x: Array, h: float) -> Array:
    """Displacement (about [-1, 1]) of the piezo stack for an input x (n,) in [-1, 1], h seconds apart, from rest.

    Ten backlash operators and a linear term -> asymmetric readout -> creep -> second-order mechanics; four steps inside
    every h, between which the input runs linearly.
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
    """Displacement (um) of the piezo stack for a voltage u (n,) in V at steps of h seconds, without sensor noise."""
    return STROKE * stack(u / (VOLTS / 2) - 1, h)


def _second_order(dt: float) -> tuple[Array, Array]:
    """G0 for an input held over dt: numerator and denominator in z (closed form of the damped oscillation)."""
    w = 2 * np.pi * F_N
    wd, e = w * np.sqrt(1 - ZETA**2), np.exp(-ZETA * w * dt)
    c, s = np.cos(wd * dt), np.sin(wd * dt) * ZETA * w / wd
    return np.array([0.0, 1 - e * (c + s), e * (e + s - c)]), np.array([1.0, -2 * e * c, e * e])


def piezo(reversals: int = 100, rate: float = 1000.0, noise: float = 1e-3, seed: int = 0) -> Dataset:
    """The built-in data: voltage and displacement of the synthetic stack.

    A full loop, then random nested reversals, five of them a second.

    Parameters
    ----------
    reversals : int
        Number of random reversals; at least 60 identify well.
    rate : float
        Sample rate in Hz, at least 200.
    noise : float
        RMS noise of the sensor as a fraction of the stroke's half.
    seed : int
        Of the reversals and the noise.

    Returns
    -------
    Dataset
        t (s), u (V), y (um).

    Raises
    ------
    InputError
        A rate below 200 Hz.
    """
    if not (np.isfinite(rate) and rate >= 200):
        raise InputError(f"the rate must be at least 200 Hz; got {rate}")
    levels = [0.0, 1.0, -1.0, 1.0, -1.0, *_levels(reversals, seed)]
    per_ramp = round(rate / 5)
    blend = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, per_ramp + 1) / per_ramp)
    x = np.concatenate([[levels[0]], *[a + (b - a) * blend for a, b in pairwise(levels)]])
    u = VOLTS / 2 * (1 + x)
    y = displacement(u, 1 / rate) + STROKE * noise * np.random.default_rng(seed).normal(size=len(x))
    return Dataset(np.arange(len(x)) / rate, u, y, "synthetic piezo stack", unit_u="V", unit_y="um")


def _levels(count: int, seed: int) -> list[float]:
    """The extremes of a path of random nested reversals, without its start."""
    path = nested_reversals(count, seed, step=1.0)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(path))) != 0) + 1
    return [*path[turns].tolist(), float(path[-1])]


# ---- Bouc-Wen benchmark ----------------------------------------------------------------------------------------------
RATE, UPSAMPLING = 750, 20  # Hz, and steps of Newmark's method in one sample: 15 kHz
DECIMATE_MULTISINE, DECIMATE_SWEEP = (2, 2, 5), (20,)


def multisine(n: int = 8192, f_lo: float = 5.0, f_hi: float = 150.0, rms: float = 50.0, seed: int = 0) -> Array:
    """One period (n,) of the benchmark's random-phase multisine at 750 Hz, all its lines equally strong (N).

    The lines lie from `f_lo` to `f_hi` (Hz), the whole has the root mean square `rms` (N), the phases come from `seed`.
    """
    f = np.arange(n // 2 + 1) * RATE / n
    spectrum = np.zeros(len(f), complex)
    lines = (f >= f_lo) & (f <= f_hi)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(seed).uniform(size=int(lines.sum())))
    u = np.fft.irfft(spectrum, n)
    return np.asarray(u * rms / np.sqrt(np.mean(u**2)))


def sweep(seconds: float = 204.0) -> Array:
    """The force 40 sin(2 pi (18 t + t^2/12)) of the benchmark's sine sweep, `seconds` long, at 15 kHz (N)."""
    t = np.arange(round(seconds * RATE) * UPSAMPLING) / (RATE * UPSAMPLING)
    return np.asarray(40 * np.sin(2 * np.pi * (18 * t + t**2 / 12)))


def benchmark_multisine(u: Array, periods: int = 2) -> Array:
    """Displacement (m) over the last of `periods` periods of a force u (n,) in N at 750 Hz, periodic."""
    n = len(u)
    fine = np.fft.irfft(np.fft.rfft(u), n * UPSAMPLING) * UPSAMPLING
    # one period more keeps the end of the filters' record, where they guess, out of what is returned
    y = oscillator(np.tile(fine, periods + 1))
    for factor in DECIMATE_MULTISINE:
        y = decimate(y, factor)
    return y[(periods - 1) * n : periods * n]


def benchmark_sweep(u: Array) -> Array:
    """Displacement (m) at 750 Hz for a force u in N at 15 kHz, from rest."""
    y = oscillator(u)
    for factor in DECIMATE_SWEEP:
        y = decimate(y, factor)
    return y


def oscillator(u: Array) -> Array:
    """Displacement (m) of the benchmark's oscillator for a force u (n,) at 15 kHz (N), from rest: the C block."""
    plant = Graph.single(Node("plant", "bouc_wen_oscillator"))
    return np.asarray(plant.run(u, 1 / (RATE * UPSAMPLING))[:, 0])


def decimate(y: Array, factor: int, order: int = 30) -> Array:
    """Low-pass by a linear-phase FIR filter (Hamming window, cut-off at the new Nyquist rate) and keep every factor-th.

    As MATLAB's ``decimate(y, factor, 'fir')``: the record is extended by point reflection at its ends, and the delay of
    the filter, half its `order`, is taken out.
    """
    k = np.arange(order + 1) - order / 2
    b = np.sinc(k / factor) * np.hamming(order + 1)
    b /= b.sum()
    before = 2 * y[0] - y[order:0:-1]
    after = 2 * y[-1] - y[-2 : -order - 2 : -1]
    filtered = np.convolve(np.concatenate([before, y, after]), b)
    delay = order + order // 2
    return np.asarray(filtered[delay : delay + len(y) : factor])
