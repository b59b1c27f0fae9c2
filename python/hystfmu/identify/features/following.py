"""Dependence of a bend on covariates: offset, gain, or every coefficient, linear in each of them.

  b(v, theta) = (1 + g' theta) b(v) + sum_j theta_j b_j(v)

theta are the covariates scaled to [-1, 1]. A covariate acts at one of four levels: none; ``offset``, b_j constant;
``gain``, b_j constant and g_j free; ``bend``, b_j a polynomial of the degree of b. With a gain, the inverse follows
from that of b(v); with a bend it is a root.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from hystfmu.base.arrays import Array

LEVELS = ("none", "offset", "gain", "bend")


@dataclass(frozen=True)
class Following:
    """Covariates, each with its level.

    Parameters
    ----------
    theta : array, shape (n, m)
        Scaled covariates over all rows.
    levels : sequence of str
        Of `LEVELS`, one for each.
    """

    theta: Array
    levels: Sequence[str]

    @property
    def gains(self) -> NDArray[np.intp]:
        """Numbers of the covariates that set the gain."""
        return np.flatnonzero([level == "gain" for level in self.levels])

    def free(self, size: int) -> NDArray[np.bool_]:
        """Return which of the coefficients of b_j are free, shape (m, size)."""
        found = np.zeros((len(self.levels), size), dtype=bool)
        for j, level in enumerate(self.levels):
            found[j, : {"none": 0, "bend": size}.get(level, 1)] = True
        return found

    def factor(self, g: Array) -> Array:
        """Return 1 + g' theta, shape (n,)."""
        return np.asarray(1 + self.theta @ g)

    def columns(self, basis: Array, g: Array) -> Array:
        """Return the columns of a regression on the coefficients of b and the free ones of b_j.

        Parameters
        ----------
        basis : array, shape (n, size)
            Polynomials of v.
        g : array, shape (m,)
            Gains.
        """
        rows, orders = np.nonzero(self.free(basis.shape[1]))
        return np.hstack([basis * self.factor(g)[:, None], self.theta[:, rows] * basis[:, orders]])

    def coefficients(self, found: Array, size: int) -> tuple[Array, Array]:
        """Split the weights of `columns` into those of b (size,) and of b_j (m, size)."""
        free = self.free(size)
        c = np.zeros(free.shape)
        c[free] = found[size:]
        return found[:size], c

    def value(self, v: Array, q: Array, c: Array, g: Array) -> Array:
        """Return b(v, theta), shape (n,), for coefficients q of b and c of b_j."""
        own = self.factor(g) * np.asarray(legendre.legval(v, q), float)
        return np.asarray(own + np.sum(self.theta * np.asarray(legendre.legval(v, c.T), float).T, axis=1))

    def slope(self, v: Array, q: Array, c: Array, g: Array) -> Array:
        """Return the derivative of b(v, theta) by v, shape (n,)."""
        if len(q) == 1:
            return np.zeros(len(v))
        of_q, of_c = (np.asarray(legendre.legder(each, axis=-1), float) for each in (q, c))
        return self.value(v, of_q, of_c, g)

    def started(self, y: Array) -> Array:
        """Return free columns (rows, ...) that stand for offset and gain in a fit without a bend."""
        used = self.theta[:, [level != "none" for level in self.levels]]
        return np.hstack([np.ones((len(y), 1)), used, used * y[:, None]])

    def rows(self, which: NDArray[np.intp]) -> Following:
        """Return some rows."""
        return Following(self.theta[which], self.levels)

    def parameters(self, size: int) -> int:
        """Return the number of free coefficients and gains for polynomials with `size` coefficients."""
        return int(self.free(size).sum()) + len(self.gains)
