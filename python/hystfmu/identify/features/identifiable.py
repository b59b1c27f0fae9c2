"""Practical identifiability: standard errors of parameters from the Jacobian and the correlation of the residuals.

For residuals e of variance s^2 and integrated correlation time T (in rows), the covariance of the parameters is about
T s^2 (J' J)^-1 (Ljung, System Identification, 2nd ed. 1999, eq. 9.10 to 9.14).  White noise gives T near 1; a model of
the wrong class leaves slowly varying residuals, which increase its standard errors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array


def standard_errors(residuals: Array, jacobian: Array, free: NDArray[np.bool_]) -> Array:
    """Compute the standard errors of the parameters.

    Parameters
    ----------
    residuals : array, shape (m,)
        Residuals of the fit.
    jacobian : array, shape (m, n)
        Derivatives of the residuals by the parameters.
    free : array of bool, shape (n,)
        Whether a parameter is off its bounds.

    Returns
    -------
    array, shape (n,)
        Standard errors; 0 for a parameter at a bound, infinite for one without effect on the residuals.
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
    """Return 1 + 2 times the sum of the autocorrelation up to its first zero, in rows; at least 1."""
    e = residuals - residuals.mean()
    power = float(e @ e)
    if power == 0:
        return 1.0
    n = 1 << (2 * len(e) - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(e, n)) ** 2
    correlation = np.fft.irfft(spectrum, n)[: len(e)] / power
    end = int(np.argmax(correlation <= 0)) or len(correlation)
    return float(1 + 2 * correlation[1:end].sum())
