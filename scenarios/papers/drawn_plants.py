"""Simulated plants with random parameters, in numpy and independent of the C core.

No default of this project was tuned on these plants. Every public function accepts a random generator `rng` and returns
a function that maps an input u (n,) to the output y (n,), from rest. The thresholds of the plays are not on a regular
grid.
"""

from collections.abc import Callable

import numpy as np

from hystfmu.base import Array
from hystfmu.data.synthetic import plays

Response = Callable[[Array], Array]
PLAYS = 10
F_N, ZETA = 500.0, 0.04  # natural frequency (Hz) and damping ratio of the resonance
# weights and time constants (s) of logarithmic creep
LAGS = ((0.012, 0.003), (0.012, 0.03), (0.012, 0.3), (0.012, 3.0))
FINER = 10


def play_sum(rng: np.random.Generator) -> Response:
    """Return a random sum of ten plays and a linear term. Its output is in [-1, 1] for inputs in [-1, 1]."""
    r, w = np.sort(rng.uniform(0.05, 0.6, PLAYS)), rng.uniform(0.3, 1.7, PLAYS)
    largest = 3 + (1 - r) @ w
    return lambda u: np.asarray((3 * u + plays(u, r) @ w) / largest)


def bent(rng: np.random.Generator) -> Response:
    """Return a plant that is a random sum of plays, followed by a static nonlinearity with a slope of at least 0.15."""
    inside, b2, b3 = play_sum(rng), rng.uniform(-0.2, 0.2), rng.uniform(-0.15, 0.15)

    def response(u: Array) -> Array:
        v = inside(u)
        return np.asarray(v + b2 * v**2 + b3 * v**3)

    return response


def stop_like(rng: np.random.Generator) -> Response:
    """Return a plant that is a random sum of ten stop operators, as in friction, followed by a cubic nonlinearity."""
    r, w = np.sort(rng.uniform(0.05, 0.6, PLAYS)), rng.uniform(0.3, 1.7, PLAYS)
    b3 = rng.uniform(0.1, 0.5)

    def response(u: Array) -> Array:
        v = (u[:, None] - plays(u, r)) @ w / w.sum()
        return np.asarray(v + b3 * v**3)

    return response


def butterfly(rng: np.random.Generator) -> Response:
    """Return a plant whose output is the square of a random sum of plays, like the strain of a magnetostrictive rod."""
    inside = play_sum(rng)
    return lambda u: np.asarray(inside(u) ** 2)


def creeping(rng: np.random.Generator, h: float) -> Response:
    """Return a plant as `bent`, followed by logarithmic creep. The sampling step is h (s)."""
    inside = bent(rng)
    return lambda u: _creep(inside(u), h)


def actuator(rng: np.random.Generator, h: float) -> Response:
    """Return a plant as `creeping`, followed by a resonance G0(s).

    The sampling step is h (s). Each step has ten substeps.
    """
    from scipy.signal import cont2discrete, lfilter

    inside = bent(rng)
    w = 2 * np.pi * F_N
    b, a, _ = cont2discrete((np.array([w * w]), np.array([1.0, 2 * ZETA * w, w * w])), h / FINER, "foh")

    def response(u: Array) -> Array:
        n = len(u)
        c = _creep(inside(np.interp(np.arange((n - 1) * FINER + 1) / FINER, np.arange(n), u)), h / FINER)
        return np.asarray(lfilter(b.ravel(), a, c - c[0])[::FINER] + c[0])

    return response


def _creep(v: Array, h: float) -> Array:
    from scipy.signal import lfilter

    out = v.copy()
    for weight, T in LAGS:
        a = np.exp(-h / T)
        out += weight * (lfilter([1 - a], [1, -a], v - v[0]) + v[0])
    return out
