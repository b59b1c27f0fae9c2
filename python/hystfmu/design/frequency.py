"""Frequency response of sampled state spaces on a grid up to half the sampling frequency.

Angles are omega h. Many cases have equal controllers and equal plants. Therefore the responses are cached by content.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.design.delays import StateSpace

Complex = NDArray[np.complex128]
POINTS = 4000  # frequencies, four decades below half the sampling frequency
PER_LINE = 40  # points for each multiple of the frequency of a period memory
HALVINGS = 36  # of a bracket of the grid: to rounding, or close to it
KEPT = 64  # responses
NARROW = 8  # spacings of the grid: half-width of a resonance below which it gets points of its own
INTEGRATOR = 1e-7  # distance from z = 1 of a pole that is one at 1, but for rounding
BELOW, PER_SLOW = 0.05, 300  # of the slowest pole, down to which points are added, and how many
BESIDE = np.sinh(np.linspace(-np.arcsinh(30.0), np.arcsinh(30.0), 61))  # half-widths beside a resonance


@functools.lru_cache(maxsize=8)
def grid(period: int = 0) -> Array:
    """Return angles in (0, pi], shape (m,), fine enough for the harmonics of a memory of `period` steps."""
    angles = np.geomspace(1e-4, 1.0, POINTS) * np.pi
    if period:
        angles = np.union1d(angles, np.linspace(0, np.pi, period * PER_LINE // 2 + 1)[1:])
    angles.setflags(write=False)
    return angles


def beside(poles: Complex, angles: Array) -> Array:
    """Return additional angles around the resonances of poles, shape (k,), where the grid is too coarse.

    Trap: two crossings of abs(L) = 1 on both sides of a lightly damped mode may lie between two points of the grid, and
    their margins would be missed. Poles of creep may lie below the grid; angles down to them are added.
    """
    at, width = np.abs(np.angle(poles)), np.abs(1 - np.abs(poles))
    spacing = np.maximum(at, angles[0]) * (angles[1] / angles[0] - 1)
    narrow = width < NARROW * spacing
    found = (at[narrow, None] + width[narrow, None] * BESIDE).ravel()
    slow = np.abs(1 - poles)
    slow = slow[(slow > INTEGRATOR) & (slow < angles[0])]
    if len(slow):
        found = np.append(found, np.geomspace(BELOW * slow.min(), angles[0], PER_SLOW))
    return np.asarray(np.unique(found[(found > 0) & (found <= np.pi)]))


def response_of(system: StateSpace, z: Complex) -> Complex:
    """Return C (z - A)^-1 B + D.

    Parameters
    ----------
    system : (A, B, C, D), shapes (n, n), (n, q), (p, n), (p, q)
        State space x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k].
    z : array, shape (m,)

    Returns
    -------
    array, shape (m, p, q)
    """
    A, B, C, D = system
    if not len(A):
        return np.repeat(D[None].astype(complex), len(z), 0)
    x = np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, B.astype(complex)[None])
    return np.asarray(C @ x + D)


def on_grid(system: StateSpace, period: int = 0) -> Complex:
    """Return the response on `grid(period)`. Responses of equal systems are computed once."""
    return _on_grid(tuple((m.shape, np.ascontiguousarray(m).tobytes()) for m in system), period)


@functools.lru_cache(maxsize=KEPT)
def _on_grid(content: tuple[tuple[tuple[int, ...], bytes], ...], period: int) -> Complex:
    A, B, C, D = (np.frombuffer(data).reshape(shape) for shape, data in content)
    return response_of((A, B, C, D), np.exp(1j * grid(period)))


def roots(f: Callable[[Array], Array], angles: Array, values: Array) -> Array:
    """Return the angles at which f changes its sign, at most one per interval of a grid, by bisection.

    `values` is f on the grid of `angles`, shape (m,).
    """
    at = np.flatnonzero(values[:-1] * values[1:] < 0)
    low, high, sign = angles[at], angles[at + 1], np.sign(values[at])
    for _ in range(HALVINGS if len(at) else 0):
        middle = (low + high) / 2
        same = np.sign(f(middle)) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray((low + high) / 2)


def least(f: Callable[[Array], Array], angles: Array, values: Array) -> float:
    """Return the smallest value of f.

    The smallest value on a grid is refined by golden-section search between the neighbouring points.
    """
    k = int(np.argmin(values))
    a, b = angles[max(k - 1, 0)], angles[min(k + 1, len(angles) - 1)]
    found = float(values[k])
    for _ in range(3):  # each narrows the bracket 16 times
        inner = np.linspace(a, b, 33)
        here = f(inner)
        j = int(np.argmin(here))
        a, b = inner[max(j - 1, 0)], inner[min(j + 1, 32)]
        found = min(found, float(here[j]))
    return found
