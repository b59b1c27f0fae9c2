"""How well a fit knows its parameters: standard errors from the Jacobian and the correlation of the residuals.

For residuals e of variance s^2 and integrated correlation time T (in rows) the covariance of the parameters is about
T s^2 (J' J)^-1 (Ljung, System Identification, 2nd ed. 1999, eq. 9.10 to 9.14).  Noise alone gives T near 1; a model of
the wrong class leaves residuals that are slow, and its standard errors grow with them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array


def standard_errors(residuals: Array, jacobian: Array, free: NDArray[np.bool_]) -> Array:
    """Standard errors of the parameters.

    Parameters
    ----------
    residuals : array, shape (rows,)
    jacobian : array, shape (rows, n)
        Of the residuals by the parameters.
    free : array of bool, shape (n,)
        Parameters that are not held at a bound.

    Returns
    -------
    array, shape (n,)
        0 for a parameter at a bound, infinite for one that has no influence on the residuals.
    """
    found = np.zeros(jacobian.shape[1])
    j = jacobian[:, free]
    size = np.linalg.norm(j, axis=0)
    if not size.all():
        found[free] = np.where(size > 0, 0.0, np.inf)
        return found
    s, v = np.linalg.svd(j / size, full_matrices=False)[1:]
    variance = float(residuals @ residuals) / max(len(residuals) - len(size), 1) * correlation_time(residuals)
    found[free] = np.sqrt(variance * np.sum((v / np.maximum(s, 1e-12)[:, None]) ** 2, axis=0)) / size
    return found


def correlation_time(residuals: Array) -> float:
    """1 + 2 times the sum of the correlation up to its first zero, in rows; at least 1."""
    e = residuals - residuals.mean()
    power = float(e @ e)
    if power == 0:
        return 1.0
    n = 1 << (2 * len(e) - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(e, n)) ** 2
    correlation = np.fft.irfft(spectrum, n)[: len(e)] / power
    end = int(np.argmax(correlation <= 0)) or len(correlation)
    return float(1 + 2 * correlation[1:end].sum())
