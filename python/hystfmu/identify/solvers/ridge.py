"""Least squares with a ridge: of all rows at once, or row by row as in the IPMC paper, section 5."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node, Value

CHUNK = 2000  # rows per QR, which fit the cache


def least_squares(phi: Array, y: Array, ridge: float) -> tuple[Array, float]:
    """Minimise |y - phi theta|^2 + rows ridge^2 |theta|^2 by QR; return theta (n,) and the RMS of y - phi theta.

    The ridge equals that of recursive least squares with P(0) = I / (rows ridge^2).
    """
    rows, n = phi.shape
    r: Array = np.sqrt(rows) * ridge * np.eye(n, n + 1)
    for i in range(0, rows, CHUNK):
        chunk = np.column_stack([phi[i : i + CHUNK], y[i : i + CHUNK]])
        r = np.asarray(np.linalg.qr(np.vstack([r, chunk]), mode="r"))
    theta = np.asarray(solve_triangular(r[:n, :n], r[:n, n]))
    return theta, float(np.sqrt(np.mean((y - phi @ theta) ** 2)))


def recursive(phi: Array, y: Array, ridge: float, dead_zone: float | None = None) -> Array:
    """Return the weights (n,) after one pass over the rows of phi (rows, n), from 0, by `recursive_least_squares`.

    Without a dead zone they are those of `least_squares`. With it, a row with a smaller error changes nothing. A dead
    zone that is smaller than the error of the best weights lets the recursion follow noise; if it diverges, an
    InputError is raised.
    """
    values: dict[str, Value] = {"eta": 1 / (len(y) * ridge**2), "mu": 1.0, "form": "plain"}
    if dead_zone is not None:
        values |= {"form": "corrected", "r": dead_zone}
    learner = Graph.single(Node("learner", "recursive_least_squares", {"n": phi.shape[1]}, values))
    found = learner.run(np.column_stack([phi, y]), 1.0)
    e, learned = y - found[:, 0], found[:, -1]
    still = np.diff(learned, prepend=0.0) <= 0  # an update that is not finite starts the count anew
    lost = still if dead_zone is None else still & (np.abs(e) > dead_zone)
    if lost.any():
        reason = "" if dead_zone is None else f": the dead zone {dead_zone:g} is below the achievable error"
        raise InputError(f"Recursive least squares must converge. It diverged at sample {np.argmax(lost) + 1}{reason}.")
    return np.asarray(found[-1, 1:-1])
