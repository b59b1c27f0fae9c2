"""Synthetic IPMC sensor, generated on demand: displacement of a bent strip in mm, its voltage in mV, 1000 Hz.

Hysteresis, rate dependence and drift as figure 1 of the IPMC paper shows them.  Written in numpy, apart from the C core
and with finer steps and another integrator, so that a model identified with the core is held against something else.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data.dataset import Dataset
from hystfmu.data.signals import decaying_sine, nested_reversals, ramps
from hystfmu.data.synthetic import plays

RATE = 1000.0  # Hz, as in the paper
STROKE, VOLTAGE = 5.0, 1.0  # mm and mV that 1 stands for
RADII = np.array([0.031, 0.072, 0.118, 0.151, 0.209, 0.247, 0.301, 0.366, 0.423, 0.487])  # half-widths, on no grid
WEIGHTS = np.array([1.12, 0.87, 1.31, 0.94, 1.06, 0.78, 1.23, 0.69, 1.02, 0.91])
W0 = 3.0  # weight of the linear term
BEND = 0.04  # asymmetric readout: z + 0.04 z^2
LAG = 0.004  # s: the cations follow the displacement; this makes the loop depend on the rate
DRIFT = ((-0.010, 0.3), (-0.008, 3.0))  # share and time constant (s): water flows back and the voltage relaxes
FINER = 5  # steps inside a sample


def sensor(x: Array, rate: float = RATE) -> Array:
    """Voltage (n,), about [-1, 1], for a displacement x (n,) in [-1, 1] at `rate` Hz, from rest.

    z = (w0 x + sum w_i p_{r_i}[x]) / c with p a play, then q = z + 0.04 z^2, then the lag T v' = q - v, and the drift
    y = v + sum s_l d_l, T_l d_l' = v - d_l.  Between samples x runs linearly; five steps inside a sample, trapezoidal
    rule.
    """
    n = len(x)
    fine = np.interp(np.arange((n - 1) * FINER + 1) / FINER, np.arange(n), x)
    z = (W0 * fine + plays(fine, RADII) @ WEIGHTS) / (W0 + np.sum(WEIGHTS * (1 - RADII)))
    dt = 1 / (rate * FINER)
    v = _lag(z + BEND * z**2, LAG, dt)
    y = v + sum(share * _lag(v, T, dt) for share, T in DRIFT)
    return np.asarray(y[::FINER])


def _lag(q: Array, T: float, dt: float) -> Array:
    """T v' = q - v from v = 0 by the trapezoidal rule."""
    from scipy.signal import lfilter

    a = dt / (2 * T)
    v, _ = lfilter([a, a], [1 + a, a - 1], q, zi=np.array([-a * q[0] / (1 + a)]))
    return np.asarray(v)


def excitation(reversals: int = 120, frequencies: tuple[float, ...] = (1.0, 2.0, 5.0), seed: int = 0) -> Array:
    """Displacement (n,) in [-1, 1] at 1000 Hz: a decaying sine at every frequency, then random nested reversals.

    Parameters
    ----------
    reversals : int
        Their half cosines take half a period of a frequency drawn from `frequencies`.
    frequencies : tuple of float
        In Hz; rate dependence shows at several of them only.
    seed : int
        Of the reversals and their frequencies.
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
    """Displacement and voltage of the synthetic sensor under `excitation`, at 1000 Hz.

    Parameters
    ----------
    reversals, frequencies, seed
        Of the excitation; the noise has the same seed.
    noise : float
        RMS noise in mV.
    rest : float
        Seconds at rest before the motion.

    Returns
    -------
    Dataset
        t (s), u (mm), y (mV).

    Raises
    ------
    InputError
        A frequency outside (0, 50] Hz, 20 samples in a cycle.
    """
    if not frequencies or not all(0 < f <= 50 for f in frequencies):
        raise InputError(f"the frequencies must lie in (0, 50] Hz; got {frequencies}")
    x = np.concatenate([np.zeros(round(rest * RATE)), excitation(reversals, frequencies, seed)])
    y = sensor(x) + noise / VOLTAGE * np.random.default_rng(seed).normal(size=len(x))
    t = np.arange(len(x)) / RATE
    return Dataset(t, STROKE * x, VOLTAGE * y, "synthetic IPMC sensor", unit_u="mm", unit_y="mV")
