"""Gains at which the Nyquist curve of a loop runs through -1, and where stability is lost there.

Not every such gain is a limit: a loop may stay stable although its curve crosses -1, and a conditionally stable loop
has limits on both sides.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.design.frequency import Complex, roots

LARGEST = 1e6  # factor of the gain (120 dB): beyond it rounding decides where poles lie
SAME = 1e-6  # relative distance of two factors that are one


def crossed(L: Callable[[Array], Complex], angles: Array, values: Complex) -> Array:
    """Return the factors of the gain, shape (k,), at which the curve runs through -1.

    Parameters
    ----------
    L : function
        Response of the open loop at angles omega h.
    angles, values : array, shape (m,)
        Grid up to pi, and the response on it.
    """
    at = np.append(roots(lambda a: L(a).imag, angles, values.imag), np.pi)  # L is real at z = -1, and at z = 1
    real = np.append(L(at).real, _static(L, values[0]))
    factors = -1 / real[real < 0]
    return np.asarray(factors[(factors > 1 / LARGEST) & (factors < LARGEST)])


def _static(L: Callable[[Array], Complex], beside: complex) -> Array:
    """Return L at z = 1, shape (1,), or shape (0,) if there is a pole."""
    with suppress(np.linalg.LinAlgError), np.errstate(all="ignore"):
        found = L(np.zeros(1))
        if abs(found[0] - beside) < 0.5 * abs(beside):
            return np.asarray(found.real)
    return np.zeros(0)


def first_lost(factors: Array, stable: Callable[[float], bool]) -> float:
    """Return the least of some factors above 1 beyond which a loop is unstable; infinite if it never is.

    Parameters
    ----------
    factors : array, shape (k,)
        All factors at which stability may change.
    stable : function
        Whether the loop is stable with a factor.
    """
    found = np.sort(factors)
    found = found[np.diff(found, prepend=0.0) > SAME * found]
    beyond = np.sqrt(found * np.append(found[1:], 4 * found[-1:]))  # between two of them, twice the last one
    return next((float(f) for f, b in zip(found, beyond, strict=True) if not stable(float(b))), float("inf"))
