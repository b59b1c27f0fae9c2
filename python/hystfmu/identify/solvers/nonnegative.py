"""Non-negative least squares with free columns, fast for thousands of columns.

It solves min |b - A x - F v| over x >= 0.  An orthogonal basis of the range of F eliminates v; the rest is the problem
of Lawson & Hanson (1974, ch. 23).  Three facts make thousands of plays cheap:

- A play is linear in its half-width between two kinks, so a column half-way between its neighbours is their mean and
  adds nothing to what non-negative weights of the others reach (half of 5000 columns for 2000 samples).
- Adjacent plays are nearly equal, so a coarse selection of columns is already close.  If few of its weights are
  positive, the columns with the largest positive gradient are added until none is left (pricing, as in the simplex
  method).  Memory traffic over all columns, the cost of the plain method, then occurs only a few times.
- If most weights are positive, an exact solution is likely to exist (`positive_solution`).

All factorisations are orthogonal; A'A is never formed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from hystfmu.base.arrays import Array
from hystfmu.identify.solvers.positive_solution import positive_solution

COARSE = 300  # columns in the first selection; up to this number are solved at once
ADDED = 300  # limit on columns added per round
DIRECT = 1200  # limit on columns solved at once if most weights are positive but no exact solution exists
DENSE = 3000  # limit on columns whose row space is factored, which takes 4 n^3 operations
OPTIMAL = 1e-13  # gradient of a unit column, relative to |b|, that counts as 0
GAP = 1e-2  # allowed distance of |r|^2 from its minimum, relative to |r|^2: a small r needs a smaller gradient
MANY = 2**17  # rows
MEAN = 16 * np.finfo(float).eps  # rounding of a column that is a mean of two others, relative to the largest entry


def nonnegative(A: Array, b: Array, F: Array) -> tuple[Array, Array]:
    """Compute weights x >= 0 of the columns of A and free weights v of the columns of F.

    Parameters
    ----------
    A : array, shape (n, p)
        Columns with non-negative weights.
    b : array, shape (n,)
        Right-hand side.
    F : array, shape (n, q)
        Columns with free weights; dependent columns share their weight (least norm).

    Returns
    -------
    x : array, shape (p,)
        Weights of A; 0 for a zero column or one in the range of F.
    v : array, shape (q,)
        Weights of F.
    """
    if len(b) > MANY:  # a triangle has the same solution; further copies of so many rows would not fit
        R = _reduced(A, F, b)
        A, F, b = R[:, : A.shape[1]], R[:, A.shape[1] : -1], R[:, -1]
    U, s, Vt = np.linalg.svd(F, full_matrices=False)
    keep = s > 1e-12 * s.max(initial=0.0)
    U = U[:, keep]
    chosen = _extreme(A)
    left = A[:, chosen]
    length = np.sqrt(np.einsum("ij,ij->j", left, left))
    left -= U @ (U.T @ left)
    size = np.sqrt(np.einsum("ij,ij->j", left, left))
    alive = size > 1e-10 * length
    rest = b - U @ (U.T @ b)
    x = np.zeros(A.shape[1])
    x[chosen[alive]] = _solved(left[:, alive] / size[alive], rest) / size[alive]
    v = Vt[keep].T @ ((U.T @ (b - A @ x)) / s[keep])
    return x, v


def _reduced(A: Array, F: Array, b: Array) -> Array:
    """Return the triangle of the QR factors of [A F b], computed from successive parts of the rows."""
    R = np.zeros((0, A.shape[1] + F.shape[1] + 1))
    for k in range(0, len(b), MANY):
        rows = slice(k, k + MANY)
        R = _factor(np.vstack([R, np.column_stack([A[rows], F[rows], b[rows]])]))
    return R


def _extreme(A: Array) -> NDArray[np.intp]:
    """Return the indices of all columns except those on a straight line between two others, equally spaced."""
    n = A.shape[1]
    if n <= COARSE:
        return np.arange(n)
    enough = MEAN * max(float(A.max()), -float(A.min()))
    bent = np.abs(np.diff(A, 2, axis=1)).max(axis=0) > enough
    ends = np.flatnonzero(np.concatenate([[True], bent, [True]]))
    inner = np.flatnonzero(~bent) + 1
    after = np.searchsorted(ends, inner)
    low, high = ends[after - 1], ends[after]
    t = (inner - low) / (high - low)
    # a curve may look straight between neighbours but not over the whole length
    off = np.abs((1 - t) * A[:, low] + t * A[:, high] - A[:, inner]).max(axis=0) > enough
    return np.union1d(ends, inner[off])


def _solved(A: Array, b: Array) -> Array:
    """Solve non-negative least squares for columns of length 1."""
    n = A.shape[1]
    if n <= COARSE:
        return _direct(A, b)
    working = np.unique(np.linspace(0, n - 1, COARSE).astype(int))
    first = _direct(A[:, working], b)
    if np.count_nonzero(first) > COARSE / 2:
        exact = positive_solution(A, b) if n <= DENSE else None
        if exact is not None:
            return exact
        if n <= DIRECT:
            return _direct(A, b)
    return _priced(A, b, working, first)


def _priced(A: Array, b: Array, working: Array, weights: Array) -> Array:
    """Extend the solution on a working set of columns to all columns."""
    last = np.inf
    while True:
        x = np.zeros(A.shape[1])
        x[working] = weights
        r = b - A @ x
        g = A.T @ r
        g[x > 0] = 0
        misfit = float(np.linalg.norm(r))
        sparse = np.count_nonzero(x) <= COARSE  # otherwise the last digits take minutes
        optimal = g.max() <= OPTIMAL * np.linalg.norm(b) and (not sparse or g.max() * x.sum() <= GAP * misfit**2)
        if optimal or not misfit < (1.0 if sparse else 0.999) * last:
            return x
        last = misfit
        padded = np.concatenate([[-np.inf], g, [-np.inf]])
        peaks = np.flatnonzero((g > 0) & (g >= padded[:-2]) & (g >= padded[2:]))
        working = np.union1d(np.flatnonzero(x > 0), peaks[np.argsort(-g[peaks])[:ADDED]])
        weights = _direct(A[:, working], b)


def _direct(A: Array, b: Array) -> Array:
    if A.shape[0] > 2 * A.shape[1]:  # the triangle of the QR factors has the same solution and fewer rows
        A, b = _triangle(A, b)
    x, _ = nnls(A, b, maxiter=30 * A.shape[1] + 300)
    return np.asarray(x)


def _triangle(A: Array, b: Array) -> tuple[Array, Array]:
    R = _factor(np.column_stack([A, b]))
    return R[:, :-1], R[:, -1]


def _factor(A: Array) -> Array:
    R: Array = np.linalg.qr(A, mode="r")  # type: ignore[assignment]
    return R
