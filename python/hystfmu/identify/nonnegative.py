"""Non-negative least squares with free columns, fast for thousands of columns.

min |b - A x - F v| over x >= 0.  F goes first, by an orthogonal basis of its range; what is left is Lawson & Hanson's
problem (1974, ch. 23), solved on a working set of columns: all of them when there are few, else an even selection to
which the columns with the largest positive gradient are added until none is left (pricing, as in the simplex method).
Adjacent plays are nearly equal, so a coarse selection is close already, and memory traffic over all columns, the cost
of the plain method, is paid a few times only.  Orthogonal factors throughout, never A'A.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from hystfmu.core import Array

DIRECT = 1200  # up to so many columns at once
ADDED = 300  # most columns added in a round
OPTIMAL = 1e-13  # largest gradient of a unit column, relative to |b|, that counts as none


def nonnegative(A: Array, b: Array, F: Array) -> tuple[Array, Array]:
    """Weights x >= 0 of the columns of A and free weights v of the columns of F.

    Parameters
    ----------
    A : array, shape (n, p)
    b : array, shape (n,)
    F : array, shape (n, q)
        Columns that depend on each other share their weight (least norm).

    Returns
    -------
    x : array, shape (p,)
        A column that F reproduces, or a zero one, gets weight 0.
    v : array, shape (q,)
    """
    U, s, Vt = np.linalg.svd(F, full_matrices=False)
    keep = s > 1e-12 * s.max(initial=0.0)
    U = U[:, keep]
    length = np.sqrt(np.einsum("ij,ij->j", A, A))
    left = A - U @ (U.T @ A)
    size = np.sqrt(np.einsum("ij,ij->j", left, left))
    dead = size <= 1e-10 * length
    size[dead] = np.inf
    left /= size
    rest = b - U @ (U.T @ b)
    x = _priced(left, rest) / size
    v = Vt[keep].T @ ((U.T @ (b - A @ x)) / s[keep])
    return x, v


def _priced(A: Array, b: Array) -> Array:
    """Non-negative least squares on unit columns, a working set at a time."""
    n = A.shape[1]
    if n <= DIRECT:
        return _direct(A, b)
    working = np.unique(np.linspace(0, n - 1, DIRECT).astype(int))
    x, enough, last = np.zeros(n), OPTIMAL * float(np.linalg.norm(b)), np.inf
    while True:
        x[:] = 0
        x[working] = _direct(A[:, working], b)
        r = b - A @ x
        g = A.T @ r
        g[x > 0] = 0
        misfit = float(np.linalg.norm(r))
        if g.max() <= enough or not misfit < 0.999 * last:
            return x
        last = misfit
        padded = np.concatenate([[-np.inf], g, [-np.inf]])
        peaks = np.flatnonzero((g > enough) & (g >= padded[:-2]) & (g >= padded[2:]))
        working = np.union1d(np.flatnonzero(x > 0), peaks[np.argsort(-g[peaks])[:ADDED]])


def _direct(A: Array, b: Array) -> Array:
    if A.shape[0] > 2 * A.shape[1]:  # the triangle has the same solution and fewer rows
        A, b = _triangle(A, b)
    x, _ = nnls(A, b, maxiter=30 * A.shape[1] + 300)
    return np.asarray(x)


def _triangle(A: Array, b: Array) -> tuple[Array, Array]:
    R: Array = np.linalg.qr(np.column_stack([A, b]), mode="r")  # type: ignore[assignment]
    return R[:, :-1], R[:, -1]
