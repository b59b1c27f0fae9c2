"""The shortest solution x >= 0 of A x = b, where there is one: the dense end of non-negative least squares.

Active-set methods end at a vertex, one column at a time: data that thousands of positive weights reproduce exactly cost
them thousands of steps, and in the last ones the gradient A'r drowns in rounding while r is still 5e-8 of b (columns of
adjacent plays differ in few rows, so A' shrinks what is left).  Here the row space of A is factored once.  The shortest
solution spreads the weights so evenly that only few are negative (29 of 2597), and those are pushed back to 0 inside
the null space of A, which the residual does not notice: least distance programming, Lawson & Hanson 1974, ch. 23.4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.linalg import qr, solve_triangular
from scipy.optimize import nnls

from hystfmu.base.arrays import Array

EXACT = 1e-13  # largest |b - A x| / |b| of a solution; 1e-14 is usual
DEPENDENT = 1e-12  # a row so close to the span of the others, relative to the largest row, depends on them
BLOCK = 64  # rows at a time
ROUNDS = 20  # of pushing back negative weights
MOST_PUSHED = 0.2  # of all columns: with more weights at 0 a working set of columns is the better method


def positive_solution(A: Array, b: Array) -> Array | None:
    """The shortest x >= 0 with A x = b up to rounding, or None if none was found.

    Parameters
    ----------
    A : array, shape (n, p)
        Columns of about equal length.
    b : array, shape (n,)
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
    """Rows turned by an orthogonal matrix without preference, so that the first k of them span the space of all.

    Random signs, cosine transform, random order (Avron, Maymounkov & Toledo 2010).  Samples in their own order repeat
    each other exactly or nearly: taken one after the other they let rounding grow to 1e-10, where real rows begin.
    """
    rng = np.random.default_rng(0)
    signs = rng.choice([-1.0, 1.0], (len(rows), 1))
    mixed = dct(signs * rows, axis=0, norm="ortho")[rng.permutation(len(rows))]
    return mixed[:, :-1], mixed[:, -1]


def row_space(A: Array) -> tuple[Array, Array, NDArray[np.intp]]:
    """Orthonormal Q (p, k), lower triangular L (k, k) and the k rows with A[rows] = L Q'; later rows depend on them.

    Gram-Schmidt in blocks, twice (once loses orthogonality where rows are nearly dependent), and a pivoted QR inside
    each block that tells the rank; a block without a new direction ends it.  LAPACK's pivoted QR of A takes four times
    as long.  A is taken to be mixed.
    """
    n, p = A.shape
    Q, L = np.empty((p, min(n, p)), order="F"), np.zeros((min(n, p), min(n, p)), order="F")
    rows: list[int] = []
    least = DEPENDENT * float(np.sqrt(np.einsum("ij,ij->i", A, A).max(initial=0.0)))
    for start in range(0, n, BLOCK):
        k = len(rows)
        done, block = Q[:, :k], A[start : start + BLOCK].T
        inside = done.T @ block
        left = block - done @ inside
        again = done.T @ left
        left -= done @ again
        q, r, order = qr(left, mode="economic", pivoting=True)
        more = min(int(np.count_nonzero(np.abs(np.diag(r)) > least)), Q.shape[1] - k)
        if more == 0:
            break
        # what is left of a row may be tiny against the row; its direction then has a part inside again
        Q[:, k : k + more], turn = np.linalg.qr(q[:, :more] - done @ (done.T @ q[:, :more]))
        L[k : k + more, :k] = (inside + again)[:, order[:more]].T
        L[k : k + more, k : k + more] = (turn @ r[:more, :more]).T
        rows += (start + order[:more]).tolist()
    k = len(rows)
    return Q[:, :k], L[:k, :k], np.array(rows, dtype=np.intp)


def _pushed(Q: Array, x: Array) -> Array | None:
    """x + d >= 0 with the shortest d orthogonal to Q; a constraint enters when it is found violated."""
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
