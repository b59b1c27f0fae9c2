"""Response of a mode with a delay, 1/(1 + 2 zeta s/omega_n + s^2/omega_n^2) e^(-s tau), at the rows of a record.

Between two rows the input is a ramp (``foh``), constant at the new value (``zoh``), or band-limited below half of the
sampling rate (``smooth``). For ramps and constant values, the response is computed exactly by a digital filter with
four coefficients in the numerator and the two poles of the mode. The filter is also exact for a delay that is not a
whole number of steps: the state at a row is propagated over the remaining part of the step.

A smooth input is corrected and then treated as ramps. Linear interpolation multiplies the spectrum by sinc^2 (f h). The
factor 1 + D/12 + D^2/90 + ... with D = 2 - 2 cos(2 pi f h) compensates for this (the series of arcsin^2). For example,
interpolation without this correction reduces the amplitude of a chirp with seven rows per period by 6 %.
"""

import numpy as np
from scipy.linalg import expm

from hystfmu.base import Array
from hystfmu.graph.recursion import Recursion

HOLDS = ("foh", "smooth", "zoh")
SERIES = (1 / 3150, 1 / 560, 1 / 90, 1 / 12)  # coefficients 2/(n^2 C(2n, n)) for n = 5, 4, 3, 2


def prepared(v: Array, hold: str) -> Array:
    """Return the input v (n,) with the correction described above if `hold` is ``smooth``, otherwise unchanged."""
    if hold != "smooth" or len(v) < 3:
        return v
    total = np.zeros_like(v)
    for factor in SERIES:
        total = _second(factor * v + total)
    return v + total


def _second(v: Array) -> Array:
    """Return the negative second difference of v (n,); it is 0 in the first and the last row."""
    out = np.zeros_like(v)
    out[1:-1] = 2 * v[1:-1] - v[:-2] - v[2:]
    return out


def behind_mode(v: Array, f_n: float, zeta: float, delay: float, h: float, hold: str) -> Array:
    """Return the response of a mode and a delay to a signal v (n,) that was processed by `prepared`.

    f_n is in Hz, `delay` and h are in s. Before the first row, the mode is at rest at the first value of v.
    """
    w = 2 * np.pi * f_n * h  # time in steps
    a = np.array([[0.0, 1.0], [-w * w, -2 * zeta * w]])
    whole, rest = _parts(delay / h)
    step, part = _propagate(a, w * w, 1.0), _propagate(a, w * w, rest)
    poles = np.array([1.0, -np.trace(step[0]), np.linalg.det(step[0])])
    # response to a pulse at row 0 with this interpolation; `x` is the state at the rows
    x, taps = np.zeros(2), np.zeros(4)
    u = np.array([0.0, 1.0, 0.0, 0.0, 0.0])
    for k in range(4):
        v0, v1 = u[k], u[k + 1] if hold != "zoh" else u[k]
        taps[k] = (part[0] @ x + part[1] * v0 + part[2] * (v1 - v0))[0]
        x = step[0] @ x + step[1] * v0 + step[2] * (v1 - v0)
    driven = np.convolve(v - v[0], np.convolve(taps, poles)[:4])[: len(v)]
    return np.asarray(_shift(_behind_poles(driven, poles), whole) + v[0])


def _behind_poles(w: Array, a: Array) -> Array:
    """Return y (n,) with y_k = w_k - a_1 y_(k-1) - a_2 y_(k-2), from rest; a (3,) begins with 1."""
    step, first = np.array([-a[1:], [1.0, 0.0]]), np.array([1.0, 0.0])
    # not scipy.signal.lfilter: the import of scipy.signal takes longer than many fits
    return Recursion(step, np.zeros(2), first, first, first, 0.0).run(w[:, None])[:, 0]


def free_decay(n: int, f_n: float, zeta: float, h: float) -> Array:
    """Return the free decay (n,) of a mode that begins at row 0.

    Every free decay of the mode is a linear combination of this decay and the same decay one row later.
    """
    w = 2 * np.pi * f_n * h
    step = expm(np.array([[0.0, 1.0], [-w * w, -2 * zeta * w]]))
    pulse = np.zeros(n)
    pulse[0] = 1.0
    return _behind_poles(pulse, np.array([1.0, -np.trace(step), np.linalg.det(step)]))


def behind_delay(v: Array, delay: float, h: float, hold: str) -> Array:
    """Return the response of a delay (s) without a mode to a signal v (n,) that was processed by `prepared`."""
    whole, rest = _parts(delay / h)
    x = v - v[0]
    before = np.concatenate([[0.0], x[:-1]])
    # with a constant input between rows and fast modes, the sensor measures the response to the previous value
    moved = before if hold == "zoh" else rest * x + (1 - rest) * before
    return np.asarray(_shift(moved, whole) + v[0])


def _parts(steps: float) -> tuple[int, float]:
    """Split a delay into whole steps and a remainder; return the whole steps and 1 minus the remainder, in (0, 1]."""
    whole = int(np.floor(steps))
    return whole, 1.0 - (steps - whole)


def _shift(x: Array, whole: int) -> Array:
    if whole == 0:
        return x
    if whole > 0:
        return np.concatenate([np.zeros(min(whole, len(x))), x[:-whole]])
    return np.concatenate([x[-whole:], np.repeat(x[-1:], min(-whole, len(x)))])


def _propagate(a: Array, b: float, t: float) -> tuple[Array, Array, Array]:
    """Return three parts of the state after `t` steps: from the initial state, from the input 1, and from a ramp.

    The state equation is dx/dt = a x + (0, b) v, with the time in steps. The ramp v = t increases by 1 per step.
    """
    m = np.zeros((4, 4))
    m[:2, :2], m[1, 2], m[2, 3] = a, b, 1.0
    e = expm(m * t)
    return e[:2, :2], e[:2, 2], e[:2, 3]
