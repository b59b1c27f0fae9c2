"""Linear least squares with a ridge penalty, for all rows together or recursively as in the IPMC paper, section 5."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node, Value

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


def recursive(phi: Array, y: Array, ridge: float, dead_zone: float | None = None) -> Array:
    """Return the weights (n,) after one pass of recursive least squares over phi (rows, n), starting from 0.

    Without a dead zone, the weights equal the result of `least_squares`. The matrix phi contains the regressors, y
    (rows,) contains the wanted outputs, and `ridge` is the ridge penalty. With a dead zone, a row whose error is
    smaller than the dead zone does not change the weights. If the dead zone is smaller than the error of the best
    weights, the recursion adapts to noise and can diverge. If it diverges, an InputError is raised.
    """
    values: dict[str, Value] = {"eta": 1 / (len(y) * ridge**2), "mu": 1.0, "form": "plain"}
    if dead_zone is not None:
        values |= {"form": "corrected", "r": dead_zone}
    learner = Graph.single(Node("learner", "recursive_least_squares", {"n": phi.shape[1]}, values))
    found = learner.run(np.column_stack([phi, y]), 1.0)
    e, learned = y - found[:, 0], found[:, -1]
    still = np.diff(learned, prepend=0.0) <= 0  # the count of updates restarts at 0 after an update that is not finite
    lost = still if dead_zone is None else still & (np.abs(e) > dead_zone)
    if lost.any():
        reason = "" if dead_zone is None else f": the dead zone {dead_zone:g} is below the achievable error"
        raise InputError(f"Recursive least squares must converge. It diverged at sample {np.argmax(lost) + 1}{reason}.")
    return np.asarray(found[-1, 1:-1])
