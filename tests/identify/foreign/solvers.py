"""Solvers of the foreign devices: Runge-Kutta, exact linear filters, relays, on a grid finer than the rows."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.signal import cont2discrete, lfilter

FINER = 8  # steps of a solver between two rows


def fine(u: np.ndarray) -> np.ndarray:
    """Input (n,) on the grid of the solvers, a ramp between rows."""
    return np.interp(np.arange((len(u) - 1) * FINER + 1) / FINER, np.arange(len(u)), u)


def along(u: np.ndarray, slope: Callable[[float, float, float], float], z: float = 0.0) -> np.ndarray:
    """State of dz = slope(z, u, s) du with s = sgn(du), by Runge-Kutta of fourth order along every ramp of u."""
    out = np.empty(len(u))
    out[0] = z
    for k, (a, b) in enumerate(pairwise(u.tolist()), 1):
        d, s = b - a, 1.0 if b > a else -1.0
        if d != 0:
            k1 = slope(z, a, s)
            k2 = slope(z + d / 2 * k1, a + d / 2, s)
            k3 = slope(z + d / 2 * k2, a + d / 2, s)
            z += d / 6 * (k1 + 2 * k2 + 2 * k3 + slope(z + d * k3, b, s))
        out[k] = z
    return out


def bouc_wen(u: np.ndarray, beta: float, gamma: float, n: float) -> np.ndarray:
    """State of dz/du = 1 - |z|^n (gamma + beta sgn(z du)) from 0, a ramp between points."""
    return along(u, lambda z, u, s: 1 - abs(z) ** n * (gamma + beta * np.sign(z) * s))


def in_time(u: np.ndarray, h: float, rate: Callable[..., tuple[float, float]]) -> np.ndarray:
    """States (n, 2) of (x', y') = rate(x, y, u, u') from 0, h (s) between points of the input; Runge-Kutta."""
    out, x, y = np.zeros((len(u), 2)), 0.0, 0.0
    for k, (a, b) in enumerate(pairwise(u.tolist()), 1):
        v, m = (b - a) / h, (a + b) / 2
        p1, q1 = rate(x, y, a, v)
        p2, q2 = rate(x + h / 2 * p1, y + h / 2 * q1, m, v)
        p3, q3 = rate(x + h / 2 * p2, y + h / 2 * q2, m, v)
        p4, q4 = rate(x + h * p3, y + h * q3, b, v)
        x += h / 6 * (p1 + 2 * p2 + 2 * p3 + p4)
        y += h / 6 * (q1 + 2 * q2 + 2 * q3 + q4)
        out[k] = x, y
    return out


def filtered(v: np.ndarray, b: list[float], a: list[float], h: float) -> np.ndarray:
    """Output of b(s) / a(s), at rest before, exact for a ramp between points."""
    num, den, _ = cont2discrete((b, a), h, method="foh")
    return b[-1] / a[-1] * v[0] + lfilter(np.ravel(num), den, v - v[0])


def mode(v: np.ndarray, f: float, zeta: float, h: float) -> np.ndarray:
    """Output of w^2 / (s^2 + 2 zeta w s + w^2), w = 2 pi f."""
    w = 2 * np.pi * f
    return filtered(v, [w * w], [1.0, 2 * zeta * w, w * w], h)


def lag(v: np.ndarray, T: float, h: float) -> np.ndarray:
    """Output of 1 / (T s + 1)."""
    return filtered(v, [1.0], [T, 1.0], h)


def late(y: np.ndarray, rows: float) -> np.ndarray:
    """The same some rows later."""
    at = np.arange(len(y)) - rows
    return np.interp(at, np.arange(len(y)), y)


def relays(u: np.ndarray, density: Callable[[np.ndarray, np.ndarray], np.ndarray], n: int = 60) -> np.ndarray:
    """Preisach sum of relays on a grid of n thresholds over [-1.1, 1.1], demagnetised, in [-1, 1].

    Relays have a finite slope of a cell, so that the output is continuous.
    """
    level = np.linspace(-1.1, 1.1, n)
    beta, alpha = (grid.ravel() for grid in np.meshgrid(level, level))
    kept = alpha >= beta
    alpha, beta = alpha[kept], beta[kept]
    weight, cell = density(alpha, beta), 2.2 / (n - 1)
    state = np.where(alpha + beta > 0, -1.0, 1.0)
    out = np.empty(len(u))
    for k, value in enumerate(u):
        up = np.clip(2 * (value - alpha) / cell - 1, -1, 1)
        down = np.clip(2 * (value - beta) / cell + 1, -1, 1)
        state = np.clip(state, up, down)
        out[k] = weight @ state
    return out / weight.sum()
