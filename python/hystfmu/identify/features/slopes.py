"""Slopes of a Duhem model from the increments of its output over a path: start values for the free run.

Given the slope k of the linear term and the offset c, w = y - k u - c is known at every row, and the coefficients
follow from linear least squares of its increments over the rows, or over pieces of the path if u is noisy.  k and c
minimise the residual (variable projection, Golub & Pereyra 1973).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from hystfmu.base.arrays import Array

EVALUATIONS = 60  # limit on evaluations of residuals and Jacobian
STARTS = (0.0, 0.5, 1.0)  # of k, relative to the slope of the straight line

Rows = NDArray[np.intp]


def basis(u: Array, w: Array, m: int, q: int) -> Array:
    """Return the terms of dw/du at (u, w), each (rows,), for every u^i: 1, w^j, |w| w^(j-1).

    The shape is (rows, (m + 1) (2 q + 1)).
    """
    powers = w[:, None] ** np.arange(q)
    of_w = np.column_stack([np.ones(len(w)), w[:, None] * powers, np.abs(w)[:, None] * powers])
    of_u = u[:, None] ** np.arange(m + 1)
    return np.asarray((of_u[:, :, None] * of_w[:, None, :]).reshape(len(w), -1))


def segments(u: Array, least: float) -> tuple[Rows, Rows]:
    """Return first and last rows of the monotone pieces of a path u (n,), of length `least` or up to the next reversal.

    The increment between two rows is mostly noise, that of a longer piece is not.
    """
    first, last, direction = [0], [], 0.0
    for k in range(1, len(u)):
        s = float(np.sign(u[k] - u[k - 1]))
        if k - 1 > first[-1] and (direction * s < 0 or abs(u[k - 1] - u[first[-1]]) >= least):
            last.append(k - 1)
            first.append(k - 1)
            direction = 0.0
        direction = s or direction
    return np.array(first), np.array([*last, len(u) - 1])


class Slopes:
    """Linear least-squares problem by direction: increments of w over pieces of the path, sums of the terms."""

    def __init__(self, u: Array, y: Array, kept: NDArray[np.bool_], m: int, q: int, least: float) -> None:
        self.u, self.y, self.m, self.q = u, y, m, q
        self.terms = (m + 1) * (2 * q + 1)
        self.first, self.last = segments(u, least)
        way = u[self.last] - u[self.first]
        out = np.concatenate([[0], np.cumsum(~kept)])
        way[out[self.last + 1] > out[self.first]] = 0.0  # no piece with a row whose output does not count
        self.parts = [np.flatnonzero(s * way > 0) for s in (1, -1)]

    def solve(self, k: float, c: float) -> tuple[list[Array], list[Array], Array]:
        """Solve for both directions.

        Returns
        -------
        theta : list of array, shape (p,)
            Coefficients, rising and falling.
        factors : list of array, shape (p, p)
            Factors that make the terms orthonormal.
        left : array
            Residuals of the increments.
        """
        u, w = self.u, self.y - k * self.u - c
        theta, factors, left = [], [], []
        terms = basis((u[:-1] + u[1:]) / 2, (w[:-1] + w[1:]) / 2, self.m, self.q)
        sums = np.add.reduceat(np.diff(u)[:, None] * terms, self.first)
        for pieces in self.parts:
            U, s, Vt = np.linalg.svd(sums[pieces], full_matrices=False)
            factor = Vt.T / np.maximum(s, 1e-10 * s[0])
            dw = w[self.last[pieces]] - w[self.first[pieces]]
            x = U.T @ dw
            x[s <= 1e-10 * s[0]] = 0  # terms that the data do not distinguish share their weight
            theta.append(factor @ x)
            factors.append(factor)
            left.append(dw - U @ x)
        return theta, factors, np.concatenate(left)

    def starts(self, line: float, progress: Callable[[float], None]) -> list[Array]:
        """Return (k, c) of the least residual from several starts; `line` is the slope of y over u."""

        def increments(p: Array) -> Array:
            return self.solve(p[0], p[1])[2]

        found = []
        for i, share in enumerate(STARTS):
            progress(i / len(STARTS))
            found.append(least_squares(increments, [share * line, 0.0], x_scale=0.1, max_nfev=EVALUATIONS).x)
        return found
