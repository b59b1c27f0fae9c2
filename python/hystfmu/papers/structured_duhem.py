"""Oscillator with a Duhem force of free shape, fitted to force and displacement, without the Bouc-Wen equation.

  m y'' + c y' + k y + z = u,   dz/dy = f(s z), s = sgn(y'),

f is piecewise linear on equal knots and the same for both directions of motion (odd symmetry of the loop).  The
leapfrog rule integrates y, the explicit midpoint rule z, both of second order, for many parameter sets at once: one
pass gives the residuals and the finite differences of their Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.identify.methods.bouc_wen_oscillator import linear_oscillator
from hystfmu.identify.solvers.levenberg_marquardt import minimise

KNOTS = 5
STEP = 1e-4  # finite-difference step of a parameter scaled to about 1


@dataclass(frozen=True)
class DuhemOscillator:
    """Mass, damping, stiffness, and f at equal knots over [-z_max, z_max]; f is constant beyond them."""

    m: float
    c: float
    k: float
    f: Array
    z_max: float

    def run(self, u: Array, h: float) -> Array:
        """Return the displacement (n,) for a force u (n,), rows `h` seconds apart, from rest."""
        m, c, k, z_max = self.m, self.c, self.k, self.z_max
        f, last, width = self.f.tolist(), KNOTS - 1, 2 * self.z_max / (KNOTS - 1)
        damped, gain = 1 - 0.5 * h * c / m, 1 / (1 + 0.5 * h * c / m)
        y = v = z = 0.0
        out = np.empty(len(u))

        def slope(x: float) -> float:
            place = min(max((x + z_max) / width, 0.0), last - 1e-9)
            i = int(place)
            return float(f[i] + (place - i) * (f[i + 1] - f[i]))

        for n, force in enumerate(u.tolist()):
            out[n] = y
            v = (damped * v + h / m * (force - k * y - z)) * gain
            dy, s = h * v, 1.0 if v > 0 else -1.0
            z += dy * slope(s * (z + 0.5 * dy * slope(s * z)))
            y += dy
        return out


def run_many(p: Array, u: Array, h: float, z_max: float) -> Array:
    """Run `DuhemOscillator.run` for parameter sets p (sets, 3 + KNOTS) in parallel; shape (len(u), sets)."""
    m, c, k, f = p[:, 0], p[:, 1], p[:, 2], np.ascontiguousarray(p[:, 3:])
    sets, width = len(p), 2 * z_max / (KNOTS - 1)
    at, rise = f[:, :-1].ravel(), np.diff(f, axis=1).ravel()
    row = (KNOTS - 1) * np.arange(sets)
    damped, gain = (1 - 0.5 * h * c / m) / (1 + 0.5 * h * c / m), h / m / (1 + 0.5 * h * c / m)
    y, v, z = np.zeros(sets), np.zeros(sets), np.zeros(sets)
    out = np.empty((len(u), sets))

    def slope(x: Array) -> Array:
        place = np.fmin(np.fmax((x + z_max) / width, 0.0), KNOTS - 1 - 1e-9)  # a NaN goes to 0
        i = place.astype(np.intp)
        place -= i
        i += row
        return np.asarray(at[i] + place * rise[i])

    for n, force in enumerate(u.tolist()):
        out[n] = y
        v = damped * v + gain * (force - k * y - z)
        dy, s = h * v, np.where(v > 0, 1.0, -1.0)
        z = z + dy * slope(s * (z + 0.5 * dy * slope(s * z)))
        y = y + dy
    return out


def fit_duhem(
    u: Array,
    y: Array,
    h: float,
    first: int,
    stride: int,
    iterations: tuple[int, int],
    progress: Callable[[float], None],
) -> DuhemOscillator:
    """Fit by output error with Levenberg-Marquardt.

    Parameters
    ----------
    u : array, shape (n,)
        Force from rest.
    y : array, shape (m,)
        Measured displacement at the rows first, first + stride, ...
    h : float
        Time between rows of u (s).
    first, stride : int
        Rows of u that belong to y.
    iterations : (int, int)
        Iterations on the first quarter of the rows, and on all of them.
    progress : function
        Called with the fraction done.
    """
    rows = first + stride * np.arange(len(y))
    m, c, k = linear_oscillator(u[rows], y, h * stride)
    z_max = 1.1 * k * float(np.abs(y).max())  # z is a part of the spring force, but keeps it after reversals
    scale = np.concatenate([[m, max(c, 0.01 * np.sqrt(m * k)), k], np.full(KNOTS, k)])
    start = np.concatenate([[1.0, 1.0, 0.5], np.linspace(0.8, 0.2, KNOTS)])
    size = float(np.sqrt(np.mean(y**2)))
    steps = np.vstack([np.zeros(len(start)), STEP * np.eye(len(start))])

    def function(p: Array, count: int) -> tuple[Array, Array]:
        sets = (p + steps) * scale
        sets[:, :3] = np.maximum(sets[:, :3], 1e-3 * scale[:3])
        taken = rows[:count]
        with np.errstate(all="ignore"):  # a trial may diverge; its error is limited
            e = (run_many(sets, u[: taken[-1] + 1], h, z_max)[taken] - y[:count, None]) / size
        e = np.clip(np.nan_to_num(e, nan=1e3), -1e3, 1e3)
        return e[:, 0], (e[:, 1:] - e[:, :1]) / STEP

    def report(done: float, share: float, fraction: float) -> None:
        progress(done + share * fraction)

    p, _ = minimise(start, partial(function, count=len(y) // 4), iterations[0], 1e-7, partial(report, 0.0, 0.4))
    p, _ = minimise(p, partial(function, count=len(y)), iterations[1], 1e-7, partial(report, 0.4, 0.6))
    p = p * scale
    return DuhemOscillator(float(p[0]), float(p[1]), float(p[2]), p[3:], z_max)
