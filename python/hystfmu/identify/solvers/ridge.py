"""Linear least squares with a ridge penalty."""

import numpy as np
from scipy.linalg import solve_triangular

from hystfmu.base import Array

CHUNK = 2000  # number of rows per QR factorisation, which fit into the cache


def least_squares(phi: Array, y: Array, ridge: float) -> tuple[Array, float]:
    """Return theta (n,) that minimises |y - phi theta|^2 + rows ridge^2 |theta|^2, and the RMS of y - phi theta.

    The solution equals that of recursive least squares with P(0) = I / (rows ridge^2).
    """
    rows, n = phi.shape
    r: Array = np.sqrt(rows) * ridge * np.eye(n, n + 1)
    for i in range(0, rows, CHUNK):
        chunk = np.column_stack([phi[i : i + CHUNK], y[i : i + CHUNK]])
        r = np.asarray(np.linalg.qr(np.vstack([r, chunk]), mode="r"))
    theta = np.asarray(solve_triangular(r[:n, :n], r[:n, n]))
    return theta, float(np.sqrt(np.mean((y - phi @ theta) ** 2)))
