"""Rate-dependent actuator in numpy, independent of the C core, and inputs of figs. 6 to 8 of Yu & Alici 2005.

The actuator is a series connection: plays with a linear term, linear dynamics G0(s), and a delay. Each sampling
interval is divided into sixteen steps. Within an interval the input is linear, and G0 is integrated by the trapezoidal
rule. Integration method, step and thresholds differ from those of every model.
"""

import numpy as np

from hystfmu.base import Array
from hystfmu.data.synthetic import plays

RATE = 10e3  # sampling rate (Hz)
F_N, ZETA, DELAY = 500.0, 0.7, 2.375e-4  # natural frequency (Hz), damping ratio, and delay (s) of 2.375 samples
W0 = 3.0
R = np.array([0.058, 0.096, 0.163, 0.187, 0.251, 0.312, 0.338, 0.402, 0.447, 0.489])
W = np.array([1.04, 0.83, 1.31, 0.66, 1.12, 0.94, 1.42, 0.71, 1.23, 0.88])
FINER = 16

FIGURES = ("6", "7", "8")
F_SLOW, F_FAST = 2.0, 100.0  # Hz


def actuator(u: Array) -> Array:
    """Return the displacement (n,), about in [-1, 1], for an input u (n,) in [-1, 1] at 10 kHz, from rest."""
    from scipy.signal import bilinear, lfilter

    n = len(u)
    fine = np.interp(np.arange((n - 1) * FINER + 1) / FINER, np.arange(n), u)
    v = (W0 * fine + plays(fine, R, float(u[0])) @ W) / (W0 + W.sum())
    w = 2 * np.pi * F_N
    b, a = bilinear([w * w], [1.0, 2 * ZETA * w, w * w], RATE * FINER)
    y = v[0] + lfilter(b, a, v - v[0])
    late = round(DELAY * RATE * FINER)
    return np.concatenate([np.full(late, v[0]), y])[: len(v) : FINER]


def excitation(figure: str, seconds: float = 1.0, rate: float = RATE) -> Array:
    """Return the input of one figure of the paper: a sine in [-1, 1] whose frequency sweeps between 2 and 100 Hz.

    Parameters
    ----------
    figure : {"6", "7", "8"}
        Number of the figure. In fig. 6, the amplitude is constant and the frequency decreases. In fig. 7, the frequency
        increases and the amplitude decreases. In fig. 8, both decrease. A decreasing amplitude ends at 0. The paper
        prints no frequencies. The number of cycles is an integer, so that signals can be joined without a jump.
    seconds : float
        Duration (s).
    rate : float
        Sampling rate (Hz).
    """
    t = np.arange(round(seconds * rate)) / rate
    first, last = (F_SLOW, F_FAST) if figure == "7" else (F_FAST, F_SLOW)
    k = np.log(last / first) / seconds
    cycles = first * np.expm1(k * t) / k
    end = (last - first) / k
    amplitude = np.ones_like(t) if figure == "6" else 1 - t / seconds
    return np.asarray(amplitude * np.sin(2 * np.pi * cycles * max(round(end), 1) / end))
