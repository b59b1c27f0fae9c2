"""Non-negative least squares with free columns, fast for thousands of columns.

min |b - A x - F v| over x >= 0.  F goes first, by an orthogonal basis of its range; what is left is Lawson & Hanson's
problem (1974, ch. 23).  Three facts make thousands of plays cheap:

- a play is linear in its half-width between two kinks, so a column half-way between its neighbours is their mean, and
  adds nothing to what non-negative weights of the others reach (half of 5000 columns for 2000 samples);
- adjacent plays are nearly equal, so a coarse selection of columns is close already.  Where few of its weights are
  positive, the columns with the largest positive gradient are added until none is left (pricing, as in the simplex
  method): memory traffic over all columns, the cost of the plain method, is paid a few times only;
- where most are positive, weights that reproduce the data exactly are likely to exist (`positive_solution`).

Orthogonal factors throughout, never A'A.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from hystfmu.base.arrays import Array
from hystfmu.identify.solvers.positive_solution import positive_solution

COARSE = 300  # columns in the first selection; up to so many are solved at once
ADDED = 300  # most columns added in a round
DIRECT = 1200  # up to so many at once, too, if most weights of the first selection are positive but none fits exactly
DENSE = 3000  # most columns whose row space is factored, which takes 4 n^3 operations
OPTIMAL = 1e-13  # largest gradient of a unit column, relative to |b|, that counts as none
GAP = 1e-2  # how far |r|^2 may be from its least, relative to |r|^2: a small r needs a smaller gradient yet
MEAN = 16 * np.finfo(float).eps  # rounding of a column that is a mean of two others, relative to the largest entry


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


def _extreme(A: Array) -> NDArray[np.intp]:
    """Indices of all columns but those on a straight line between two others, in equal steps from neighbours."""
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
    # a curve may pass for straight between neighbours, never over the whole length
    off = np.abs((1 - t) * A[:, low] + t * A[:, high] - A[:, inner]).max(axis=0) > enough
    return np.union1d(ends, inner[off])


def _solved(A: Array, b: Array) -> Array:
    """Non-negative least squares on unit columns."""
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
    """From the solution on a working set of columns to that on all."""
    last = np.inf
    while True:
        x = np.zeros(A.shape[1])
        x[working] = weights
        r = b - A @ x
        g = A.T @ r
        g[x > 0] = 0
        misfit = float(np.linalg.norm(r))
        sparse = np.count_nonzero(x) <= COARSE  # with more, the last digits cost minutes
        optimal = g.max() <= OPTIMAL * np.linalg.norm(b) and (not sparse or g.max() * x.sum() <= GAP * misfit**2)
        if optimal or not misfit < (1.0 if sparse else 0.999) * last:
            return x
        last = misfit
        padded = np.concatenate([[-np.inf], g, [-np.inf]])
        peaks = np.flatnonzero((g > 0) & (g >= padded[:-2]) & (g >= padded[2:]))
        working = np.union1d(np.flatnonzero(x > 0), peaks[np.argsort(-g[peaks])[:ADDED]])
        weights = _direct(A[:, working], b)


def _direct(A: Array, b: Array) -> Array:
    if A.shape[0] > 2 * A.shape[1]:  # the triangle has the same solution and fewer rows
        A, b = _triangle(A, b)
    x, _ = nnls(A, b, maxiter=30 * A.shape[1] + 300)
    return np.asarray(x)


def _triangle(A: Array, b: Array) -> tuple[Array, Array]:
    R: Array = np.linalg.qr(np.column_stack([A, b]), mode="r")  # type: ignore[assignment]
    return R[:, :-1], R[:, -1]
