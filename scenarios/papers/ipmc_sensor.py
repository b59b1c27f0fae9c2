"""Synthetic IPMC sensor: voltage (mV) of a strip for its bending displacement (mm), at 1000 Hz.

The sensor has the hysteresis, rate dependence and drift that fig. 1 of the IPMC paper shows. It is written in numpy.
Step and integration method differ from those of the C core, so that the models are tested with an independent
implementation.
"""

from itertools import pairwise

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.data.dataset import Dataset
from hystfmu.data.signals import decaying_sine, nested_reversals, ramps
from hystfmu.data.synthetic import plays

RATE = 1000.0  # sampling rate (Hz), as in the paper
STROKE, VOLTAGE = 5.0, 1.0  # scale of the normalised displacement (mm) and voltage (mV)
# half-widths of the plays, which are not on a regular grid
RADII = np.array([0.031, 0.072, 0.118, 0.151, 0.209, 0.247, 0.301, 0.366, 0.423, 0.487])
WEIGHTS = np.array([1.12, 0.87, 1.31, 0.94, 1.06, 0.78, 1.23, 0.69, 1.02, 0.91])
W0 = 3.0  # weight of the linear term
BEND = 0.04  # coefficient of the asymmetric static nonlinearity z + 0.04 z^2
LAG = 0.004  # time constant of the lag of the cations (s), which makes the loop rate-dependent
DRIFT = ((-0.010, 0.3), (-0.008, 3.0))  # weights and time constants (s) of the drift due to back-diffusion of water
FINER = 5  # number of integration steps in a sample


def sensor(x: Array, rate: float = RATE) -> Array:
    """Return the voltage (n,), about in [-1, 1], for a displacement x (n,) in [-1, 1] at `rate` (Hz), from rest.

    The hysteresis z = (w0 x + sum w_i p_{r_i}[x]) / c is a sum of plays p. It is followed by the static nonlinearity q
    = z + 0.04 z^2, the lag T v' = q - v, and the drift y = v + sum s_l d_l with T_l d_l' = v - d_l. Between two
    samples, x is linear, and the equations are integrated by five steps of the trapezoidal rule.
    """
    n = len(x)
    fine = np.interp(np.arange((n - 1) * FINER + 1) / FINER, np.arange(n), x)
    z = (W0 * fine + plays(fine, RADII) @ WEIGHTS) / (W0 + np.sum(WEIGHTS * (1 - RADII)))
    dt = 1 / (rate * FINER)
    v = _lag(z + BEND * z**2, LAG, dt)
    y = v + sum(share * _lag(v, T, dt) for share, T in DRIFT)
    return np.asarray(y[::FINER])


def _lag(q: Array, T: float, dt: float) -> Array:
    """Return the solution v of T v' = q - v from v = 0, by the trapezoidal rule with step dt."""
    from scipy.signal import lfilter

    a = dt / (2 * T)
    v, _ = lfilter([a, a], [1 + a, a - 1], q, zi=np.array([-a * q[0] / (1 + a)]))
    return np.asarray(v)


def excitation(reversals: int = 120, frequencies: tuple[float, ...] = (1.0, 2.0, 5.0), seed: int = 0) -> Array:
    """Return a displacement (n,) in [-1, 1] at 1000 Hz: one decaying sine per frequency, then random reversals.

    Parameters
    ----------
    reversals : int
        Number of nested reversals, connected by half cosines. Each half cosine takes half a period of a random
        frequency in `frequencies`.
    frequencies : tuple of float
        Frequencies (Hz). Rate dependence is visible only with several frequencies.
    seed : int
        Seed of the reversals and of their frequencies.
    """
    rng = np.random.default_rng(seed)
    parts = [decaying_sine(6, 0.15, round(RATE / f))[:-1] for f in frequencies]
    path = nested_reversals(reversals, seed, step=2.0)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(path))) != 0) + 1
    for a, b in pairwise([0.0, 1.0, -1.0, *path[turns]]):
        half = round(RATE / rng.choice(frequencies) / 2)
        parts.append(a + (b - a) * (0.5 - 0.5 * np.cos(np.pi * np.arange(1, half + 1) / half)))
    return np.concatenate([*parts, ramps([float(path[turns][-1]), 0.0])[1:]])


def ipmc(
    reversals: int = 120,
    frequencies: tuple[float, ...] = (1.0, 2.0, 5.0),
    noise: float = 1e-3,
    rest: float = 0.0,
    seed: int = 0,
) -> Dataset:
    """Return a record of the synthetic sensor for the displacement that `excitation` computes, at 1000 Hz.

    Parameters
    ----------
    reversals, frequencies, seed
        Arguments of `excitation`. The noise has the same seed.
    noise : float
        RMS noise (mV).
    rest : float
        Time at rest before the motion (s).

    Returns
    -------
    Dataset
        Time t (s), displacement u (mm) and voltage y (mV).

    Raises
    ------
    InputError
        A frequency is outside (0, 50] Hz. At 50 Hz there are 20 samples per cycle.
    """
    if not frequencies or not all(0 < f <= 50 for f in frequencies):
        raise InputError(f"The frequencies must be in (0, 50] Hz. Got {frequencies} instead.")
    x = np.concatenate([np.zeros(round(rest * RATE)), excitation(reversals, frequencies, seed)])
    y = sensor(x) + noise / VOLTAGE * np.random.default_rng(seed).normal(size=len(x))
    t = np.arange(len(x)) / RATE
    return Dataset(t, STROKE * x, VOLTAGE * y, "synthetic IPMC sensor", unit_u="mm", unit_y="mV")
