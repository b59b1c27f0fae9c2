"""Non-negative least squares with free columns, fast for thousands of columns.

This module solves min |b - A x - F v| over x >= 0. An orthogonal basis of the range of F eliminates v. The remaining
problem is the problem of Lawson & Hanson (1974, ch. 23). Three facts reduce the cost for thousands of plays:

- A play is linear in its half-width between two kinks. So a column half-way between its neighbours is often their mean,
and non-negative weights of the neighbours can replace it (half of 5000 columns for 2000 samples).
- Adjacent plays are nearly equal, so a coarse selection of columns is already close.  If few of its weights are
  positive, the columns with the largest positive gradient are added until none is left (pricing, as in the simplex
  method).  Memory traffic over all columns, the cost of the plain method, then occurs only a few times.
- If most weights are positive, an exact solution is likely to exist.  Active-set methods would add one column per step:
  thousands of positive weights take thousands of steps, and in the last ones the gradient A'r is lost in rounding while
  r is still 5e-8 of b (columns of adjacent plays differ in few rows, so A' shrinks r).  `positive_solution` factors the
  row space of A once.  The minimum-norm solution spreads the weights so evenly that only few are negative (29 of 2597).
  Those are set to 0 by a correction in the null space of A, which leaves the residual unchanged: least-distance
  programming, Lawson & Hanson 1974, ch. 23.4.

All factorisations are orthogonal; A'A is never formed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.linalg import qr, solve_triangular
from scipy.optimize import nnls

from hystfmu.base.arrays import Array

COARSE = 300  # columns in the first selection; up to this number are solved at once
ADDED = 300  # limit on columns added per round
DIRECT = 1200  # limit on columns solved at once if most weights are positive but no exact solution exists
DENSE = 3000  # limit on columns whose row space is factored, which takes 4 n^3 operations
OPTIMAL = 1e-13  # gradient of a unit column, relative to |b|, that counts as 0
GAP = 1e-2  # allowed distance of |r|^2 from its minimum, relative to |r|^2: a small r needs a smaller gradient
LEAST_SIZE = 0.1  # of the largest column: a column that the rows hardly excite is not scaled up further
MANY = 2**17  # rows
MEAN = 16 * np.finfo(float).eps  # rounding of a column that is a mean of two others, relative to the largest entry
EXACT = 1e-13  # largest |b - A x| / |b| of an exact solution; 1e-14 is usual
DEPENDENT = 1e-12  # distance of a dependent row from the span of the others, relative to the largest row
ROUNDS = 20  # limit on rounds that set negative weights to 0
MOST_PUSHED = 0.2  # of all columns: with more weights at 0, a working set of columns is faster


def nonnegative(A: Array, b: Array, F: Array) -> tuple[Array, Array]:
    """Compute weights x (p,) >= 0 of the columns of A (n, p) and free weights v (q,) of those of F (n, q), for b (n,).

    A zero column of A, or a column in the range of F, has weight 0. Dependent columns of F share a weight (least norm).
    """
    if len(b) > MANY:  # a triangle has the same solution; further copies of so many rows would not fit
        R = _triangle(A, F, b)
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


def _triangle(*columns: Array) -> Array:
    """Return the triangle of the QR factors of arrays (n, ..) side by side, computed from successive parts of rows."""
    R: Array = np.zeros((0, np.column_stack([c[:1] for c in columns]).shape[1]))
    for k in range(0, len(columns[0]), MANY):
        part = np.column_stack([c[k : k + MANY] for c in columns])
        R = np.linalg.qr(np.vstack([R, part]), mode="r")  # type: ignore[assignment]
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
        R = _triangle(A, b)
        A, b = R[:, :-1], R[:, -1]
    x, _ = nnls(A, b, maxiter=30 * A.shape[1] + 300)
    return np.asarray(x)


def positive_solution(A: Array, b: Array) -> Array | None:
    """Find the minimum-norm x (p,) >= 0 with A x = b up to rounding; None if it is not found.

    The columns must have about equal length.
    """
    A, b = _mixed(np.column_stack([A, b]))
    Q, L = row_space(A)
    rows = slice(0, len(L))
    x = Q @ solve_triangular(L, b[rows], lower=True)
    x += Q @ solve_triangular(L, (b - A @ x)[rows], lower=True)
    limit = EXACT * float(np.linalg.norm(b))
    if np.linalg.norm(b - A @ x) > limit:
        return None
    pushed = _pushed(Q, x)
    return pushed if pushed is not None and np.linalg.norm(b - A @ pushed) <= limit else None


def _mixed(rows: Array) -> tuple[Array, Array]:
    """Mix the rows by a random orthogonal matrix, so that the first k of them span the space of all.

    The mixing is random signs, cosine transform, random order (Avron, Maymounkov & Toledo 2010). Trap: consecutive
    samples are nearly equal; without mixing, rounding errors grow to 1e-10, the size of real rows.
    """
    rng = np.random.default_rng(0)
    signs = rng.choice([-1.0, 1.0], (len(rows), 1))
    mixed = dct(signs * rows, axis=0, norm="ortho")[rng.permutation(len(rows))]
    return mixed[:, :-1], mixed[:, -1]


def row_space(A: Array) -> tuple[Array, Array]:
    """Factor the row space of a mixed matrix A (n, p): the first k rows are L Q', and the others depend on them.

    Q (p, k) is orthonormal, and L (k, k) is a lower triangle. Mixed rows need no pivots: the first row that depends on
    those before it tells the rank k. LAPACK's pivoted QR takes four times as long.
    """
    Q, R = qr(A.T, mode="economic", check_finite=False)
    least = DEPENDENT * float(np.sqrt(np.einsum("ij,ij->i", A, A).max(initial=0.0)))
    small = np.abs(np.diag(R)) <= least
    k = int(np.argmax(small)) if small.any() else len(small)
    return np.asarray(Q[:, :k]), np.asarray(R[:k, :k].T)


def _pushed(Q: Array, x: Array) -> Array | None:
    """Return x + d >= 0 with the shortest d orthogonal to Q; a constraint is added when it is violated."""
    tiny = 1e-15 * float(np.abs(x).max(initial=0.0))
    bound, y = np.array([], dtype=int), x
    for _ in range(ROUNDS):
        violated = np.setdiff1d(np.flatnonzero(y < -tiny), bound)
        if len(violated) == 0:
            return np.maximum(y, 0.0)
        bound = np.union1d(bound, violated)
        if len(bound) > MOST_PUSHED * len(x):
            return None
        free = -(Q @ Q[bound].T)
        free[bound, np.arange(len(bound))] += 1.0
        free -= Q @ (Q.T @ free)  # unit vectors of the bound weights, projected into the null space
        height = float(np.linalg.norm(x[bound]))
        E = np.vstack([free, -x[bound] / height])
        triangle = np.linalg.qr(np.column_stack([E, np.eye(len(E), 1, -len(E) + 1)]))[1]
        multipliers, _ = nnls(triangle[:, :-1], triangle[:, -1], maxiter=30 * len(bound) + 300)
        r = E @ multipliers
        r[-1] -= 1.0
        if r[-1] > -1e-10:  # no point of the null space meets these constraints
            return None
        y = x - height * r[:-1] / r[-1]
    return None
