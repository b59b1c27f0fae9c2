"""Auxiliary function f of the IPMC paper (eq. 3), as printed and corrected, in numpy.

Printed: f(k) = f(u_ex) + |u - u_ex| g(|u - u_ex|), g(x) >= 0 smooth and monotone; the default is 1 - e^-x.
Every branch adds to the last one in either
direction, so f grows without bound and is not a function of a hysteresis state.
Corrected: f(k) = f(u_ex) + (u - u_ex) g(|u - u_ex|).  This is the Zhao-Tan operator.  Models use the block `zhao_tan`
with dominant extrema; here the last extremum counts, as in the text of the paper.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hystfmu.base.arrays import Array


def exponential(x: float) -> float:
    """Return 1 - e^-x."""
    return float(-np.expm1(-x))


def auxiliary(u: Array, corrected: bool = True, g: Callable[[float], float] = exponential) -> Array:
    """Compute f (n,) for an input (n,), from f = 0 at its first value.

    Parameters
    ----------
    u : array, shape (n,)
        Scaled input; g depends on the scale.
    corrected : bool
        Keep the sign of u - u_ex; False drops it, as printed.
    g : function
        Smooth, monotone and not negative for arguments >= 0.
    """
    f = np.zeros(len(u))
    extreme, at_extreme, direction = float(u[0]), 0.0, 0.0
    for k in range(1, len(u)):
        s = float(np.sign(u[k] - u[k - 1]))
        if s * direction < 0:
            extreme, at_extreme = float(u[k - 1]), f[k - 1]
        direction = s or direction
        d = u[k] - extreme
        f[k] = at_extreme + (d if corrected else abs(d)) * g(abs(d))
    return f
