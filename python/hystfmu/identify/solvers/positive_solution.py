"""Minimum-norm solution x >= 0 of A x = b, if one exists: the dense case of non-negative least squares.

Active-set methods add one column per step.  If thousands of positive weights reproduce the data exactly, they take
thousands of steps, and in the last ones the gradient A'r is lost in rounding while r is still 5e-8 of b (columns of
adjacent plays differ in few rows, so A' shrinks r).  Here the row space of A is factored once.  The minimum-norm
solution spreads the weights so evenly that only few are negative (29 of 2597).  Those are set to 0 by a correction in
the null space of A, which leaves the residual unchanged: least-distance programming, Lawson & Hanson 1974, ch. 23.4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.linalg import qr, solve_triangular
from scipy.optimize import nnls

from hystfmu.base.arrays import Array

EXACT = 1e-13  # largest |b - A x| / |b| of an exact solution; 1e-14 is usual
DEPENDENT = 1e-12  # distance of a dependent row from the span of the others, relative to the largest row
CHUNK = 64  # rows per chunk
ROUNDS = 20  # limit on rounds that set negative weights to 0
MOST_PUSHED = 0.2  # of all columns: with more weights at 0, a working set of columns is faster


def positive_solution(A: Array, b: Array) -> Array | None:
    """Find the minimum-norm x >= 0 with A x = b up to rounding.

    Parameters
    ----------
    A : array, shape (n, p)
        Columns of about equal length.
    b : array, shape (n,)
        Right-hand side.

    Returns
    -------
    array, shape (p,), or None
        None if no solution was found.
    """
    A, b = _mixed(np.column_stack([A, b]))
    Q, L, rows = row_space(A)
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


def row_space(A: Array) -> tuple[Array, Array, NDArray[np.intp]]:
    """Factor the row space of a mixed matrix A (n, p): A[rows] = L Q'.

    It applies Gram-Schmidt by chunks of rows, twice, because once loses orthogonality if rows are nearly dependent.  A
    pivoted QR inside each chunk gives the rank; a chunk without a new direction ends the loop.  LAPACK's pivoted QR of
    A takes four times as long.

    Returns
    -------
    Q : array, shape (p, k)
        Orthonormal basis of the row space.
    L : array, shape (k, k)
        Lower triangle.
    rows : array of int, shape (k,)
        Independent rows of A; all others depend on them.
    """
    n, p = A.shape
    Q, L = np.empty((p, min(n, p)), order="F"), np.zeros((min(n, p), min(n, p)), order="F")
    rows: list[int] = []
    least = DEPENDENT * float(np.sqrt(np.einsum("ij,ij->i", A, A).max(initial=0.0)))
    for start in range(0, n, CHUNK):
        k = len(rows)
        done, chunk = Q[:, :k], A[start : start + CHUNK].T
        inside = done.T @ chunk
        left = chunk - done @ inside
        again = done.T @ left
        left -= done @ again
        q, r, order = qr(left, mode="economic", pivoting=True)
        more = min(int(np.count_nonzero(np.abs(np.diag(r)) > least)), Q.shape[1] - k)
        if more == 0:
            break
        # the remainder of a row may be tiny; its direction then has a component inside the span again
        Q[:, k : k + more], turn = np.linalg.qr(q[:, :more] - done @ (done.T @ q[:, :more]))
        L[k : k + more, :k] = (inside + again)[:, order[:more]].T
        L[k : k + more, k : k + more] = (turn @ r[:more, :more]).T
        rows += (start + order[:more]).tolist()
    k = len(rows)
    return Q[:, :k], L[:k, :k], np.array(rows, dtype=np.intp)


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
