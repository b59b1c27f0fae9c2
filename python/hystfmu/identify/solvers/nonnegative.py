"""Non-negative least squares with free columns, fast for thousands of columns.

This module minimises |b - A x - F v| over x >= 0 and free v. An orthogonal basis of the range of F eliminates v. The
remaining problem is the problem of Lawson & Hanson (1974, ch. 23). For thousands of plays, three methods reduce the
cost:

- Omitted columns. The output of a play is a piecewise linear function of its half-width. Therefore a column is often
  the mean of its two neighbours, so that weights of the neighbours can replace its weight. For example, half of 5000
  columns are omitted for 2000 samples.
- Pricing, as in the simplex method. Columns of adjacent plays are nearly equal, so the solution for a coarse selection
  of columns is already close to the solution. If only a few of its weights are positive, the columns with the largest
  positive gradients are added until no gradient is positive. The products with all columns, which dominate the cost of
  the standard method, are then needed only a few times.
- Exact solution. If most weights are positive, an x >= 0 with A x = b usually exists. An active-set method would add
  one column per step and would need thousands of steps. In the last steps, rounding errors would hide the gradient A'r
  while |r| is still 5e-8 |b|. `positive_solution` instead factors the row space of A once. In the minimum-norm solution
  only a few weights are negative (29 of 2597 in an example). A correction in the null space of A, which does not change
  the residual, sets them to 0 (least-distance programming, Lawson & Hanson 1974, ch. 23.4).

All factorisations are orthogonal; the matrix A'A is never computed.
"""

import numpy as np
from scipy.fft import dct
from scipy.linalg import qr, solve_triangular
from scipy.optimize import nnls

from hystfmu.base import Array, Indices

COARSE = 300  # number of columns in the first selection; problems with at most this number are solved directly
ADDED = 300  # maximum number of columns that are added per round
DIRECT = 1200  # problems with at most this number of columns are solved directly if there is no exact solution
DENSE = 3000  # maximum number of columns whose row space is factored, which takes 4 n^3 operations
OPTIMAL = 1e-13  # gradient of a unit column, relative to |b|, that counts as 0
GAP = 1e-2  # permitted distance of |r|^2 from its minimum, relative to |r|^2; it matters if r is small
LEAST_SIZE = 0.1  # smallest norm by which a column is divided, relative to the largest norm
MANY = 2**17  # maximum number of rows that are processed together
MEAN = 16 * np.finfo(float).eps  # rounding error of the mean of two columns, relative to the largest entry
EXACT = 1e-13  # largest |b - A x| / |b| of an exact solution; the usual value is 1e-14
DEPENDENT = 1e-12  # distance of a dependent row from the span of the other rows, relative to the largest row
ROUNDS = 20  # maximum number of rounds that set negative weights to 0
MOST_PUSHED = 0.2  # share of weights at 0 above which pricing is faster than the exact solution


def nonnegative(A: Array, b: Array, F: Array) -> tuple[Array, Array]:
    """Return x (p,) >= 0 and v (q,) that minimise |b - A x - F v|, for A (n, p), F (n, q) and b (n,).

    A zero column of A, or a column in the range of F, has the weight 0. For linearly dependent columns of F, v has the
    smallest norm.
    """
    if len(b) > MANY:  # the triangular QR factor has the same solution and needs less memory
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
    """Return the triangular QR factor of a matrix with the given columns, computed from blocks of its rows."""
    R: Array = np.zeros((0, np.column_stack([c[:1] for c in columns]).shape[1]))
    for k in range(0, len(columns[0]), MANY):
        part = np.column_stack([c[k : k + MANY] for c in columns])
        R = np.linalg.qr(np.vstack([R, part]), mode="r")  # type: ignore[assignment]
    return R


def _extreme(A: Array) -> Indices:
    """Return the indices of all columns that linear interpolation between two other columns does not reproduce."""
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
    # a slightly curved sequence is straight between neighbours, but not over its whole length
    off = np.abs((1 - t) * A[:, low] + t * A[:, high] - A[:, inner]).max(axis=0) > enough
    return np.union1d(ends, inner[off])


def _solved(A: Array, b: Array) -> Array:
    """Return the x >= 0 that minimises |b - A x|; the columns of A must have the norm 1."""
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
    """Return the x >= 0 that minimises |b - A x|, by pricing; start from `weights` of the columns `working`."""
    last = np.inf
    while True:
        x = np.zeros(A.shape[1])
        x[working] = weights
        r = b - A @ x
        g = A.T @ r
        g[x > 0] = 0
        misfit = float(np.linalg.norm(r))
        sparse = np.count_nonzero(x) <= COARSE  # with more positive weights, an accurate solution would take minutes
        optimal = g.max() <= OPTIMAL * np.linalg.norm(b) and (not sparse or g.max() * x.sum() <= GAP * misfit**2)
        if optimal or not misfit < (1.0 if sparse else 0.999) * last:
            return x
        last = misfit
        padded = np.concatenate([[-np.inf], g, [-np.inf]])
        peaks = np.flatnonzero((g > 0) & (g >= padded[:-2]) & (g >= padded[2:]))
        working = np.union1d(np.flatnonzero(x > 0), peaks[np.argsort(-g[peaks])[:ADDED]])
        weights = _direct(A[:, working], b)


def _direct(A: Array, b: Array) -> Array:
    if A.shape[1] == 0:  # nnls of SciPy 1.17 then frees its memory twice
        return np.zeros(0)
    if A.shape[0] > 2 * A.shape[1]:  # the triangular QR factor has the same solution and fewer rows
        R = _triangle(A, b)
        A, b = R[:, :-1], R[:, -1]
    x, _ = nnls(A, b, maxiter=30 * A.shape[1] + 300)
    return np.asarray(x)


def positive_solution(A: Array, b: Array) -> Array | None:
    """Return x (p,) >= 0 with A x = b up to rounding errors, near the minimum-norm solution; None if it is not found.

    The columns of A must have about equal norms.
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
    """Multiply `rows` by a random orthogonal matrix, so that the first k new rows span the space of all rows.

    The matrix applies random signs, a cosine transform and a random permutation (Avron, Maymounkov & Toledo 2010). The
    last column of the result, the right-hand side b, is returned separately. Trap: consecutive samples are nearly
    equal. Without this mixing, rounding errors grow to 1e-10, so that dependent rows look like independent rows.
    """
    rng = np.random.default_rng(0)
    signs = rng.choice([-1.0, 1.0], (len(rows), 1))
    mixed = dct(signs * rows, axis=0, norm="ortho")[rng.permutation(len(rows))]
    return mixed[:, :-1], mixed[:, -1]


def row_space(A: Array) -> tuple[Array, Array]:
    """Return Q (p, k) and L (k, k) for a mixed matrix A (n, p) of rank k, whose first k rows are L Q'.

    Q has orthonormal columns, and L is a lower triangular matrix. The other rows depend linearly on the first k rows.
    Mixed rows need no pivoting: the index of the first dependent row is the rank. The pivoted QR factorisation of
    LAPACK takes four times as long.
    """
    Q, R = qr(A.T, mode="economic", check_finite=False)
    least = DEPENDENT * float(np.sqrt(np.einsum("ij,ij->i", A, A).max(initial=0.0)))
    small = np.abs(np.diag(R)) <= least
    k = int(np.argmax(small)) if small.any() else len(small)
    return np.asarray(Q[:, :k]), np.asarray(R[:k, :k].T)


def _pushed(Q: Array, x: Array) -> Array | None:
    """Return x + d >= 0 with the shortest d that is orthogonal to the columns of Q, or None if no d is found.

    In each round, only the constraints that are violated are added.
    """
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
        d = least_distance(free, -x[bound] / height)
        if d is None:
            return None
        y = x + height * d
    return None


def least_distance(G: Array, least: Array) -> Array | None:
    """Return the shortest z (n,) with G' z >= `least` (m,) for G (n, m); None if there is no such z.

    The dual problem is a non-negative least-squares problem (Lawson & Hanson 1974, ch. 23.4).
    """
    E = np.vstack([G, least])
    r = E @ _direct(E, np.eye(1, len(E), len(E) - 1)[0])
    r[-1] -= 1.0
    return None if r[-1] > -1e-10 else -r[:-1] / r[-1]
