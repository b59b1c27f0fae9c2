"""The auxiliary function f of the IPMC paper (eq. 3), as printed and corrected, in plain numpy.

Printed: f(k) = f(u_ex) + |u - u_ex| g(|u - u_ex|), g(x) = 1 - e^-x.  Every branch adds to the last one, whichever way
the input moves: f ratchets upwards for ever and is no function of a hysteresis state.
Corrected: f(k) = f(u_ex) + (u - u_ex) g(|u - u_ex|).  This is the Zhao-Tan operator: models use the block `zhao_tan`,
whose extrema are the dominant ones; here the last extremum counts, as the text says.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array


def auxiliary(u: Array, corrected: bool = True) -> Array:
    """f (n,) along an input (n,), from f = 0 at its first value.

    Parameters
    ----------
    u : array, shape (n,)
        Input, scaled: g is not scale-free.
    corrected : bool
        The sign of u - u_ex kept, or taken away as printed.
    """
    f = np.zeros(len(u))
    extreme, at_extreme, direction = float(u[0]), 0.0, 0.0
    for k in range(1, len(u)):
        s = float(np.sign(u[k] - u[k - 1]))
        if s * direction < 0:
            extreme, at_extreme = float(u[k - 1]), f[k - 1]
        direction = s or direction
        d = u[k] - extreme
        f[k] = at_extreme + (d if corrected else abs(d)) * -np.expm1(-abs(d))
    return f
