"""Preisach density with few parameters: smooth in the mean of the two thresholds for each half-difference.

Let m = (alpha + beta) / 2, d = (alpha - beta) / 2, and let h be half the trained range of the input. The density is a
sum of products of a hat function of d and a quadratic B-spline of m / (h - d). This division maps the triangle of all
relays to a rectangle, so that every function is excited. On the line d = 0 a separate row of B-splines gives the
reversible part, a monotone function of the input. A density that does not depend on m is a sum of plays.

Outside the trained range the density has its value at the border. The grid extends beyond the trained range by `MARGIN`
times the range.

`RelaySum` is a sum whose columns are the input and these relays. In a sum of so many columns, weights with little
excitation would be arbitrary. A ridge and two penalties keep the density smooth. Their strengths are the middle levels
of the kind `preisach`, which chooses its strengths by cross-validation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from hystfmu.base.arrays import Array
from hystfmu.graph import Graph, Node

MARGIN = 0.1
DEGREE = 2
GRID, WIDTHS, MEANS = 40, 16, 8  # of `RelaySum`
HELD = (1e-3, 3e-2, 3e-2)  # strengths of the ridge and of the penalties over mean and width of the density


def triangles(n: int) -> Array:
    """Return the Everett function of one cell at a time: 1 at the nodes whose triangle contains the cell, on n steps.

    Rows are nodes (alpha_i, beta_j), i > j, in the order of the block's `E`.  Columns are cells between alpha_k,
    alpha_k+1 and beta_l, beta_l+1, k >= l, row by row of k; for k = l the triangle on the diagonal.
    """
    up, down = np.tril_indices(n)
    inside = (up[None, :] <= up[:, None]) & (down[None, :] >= down[:, None])
    return np.asarray(inside, dtype=np.float64)


@dataclass(frozen=True)
class SmoothDensity:
    """A basis of p densities on the grid of the block ``preisach``, n steps from lo to hi, with its initial memory.

    E (n (n + 1) / 2, p) is the Everett function of every density. `along_mean` (m, p) gives first differences of the
    weights over the mean. `along_width` (m, p) gives second differences over the half-difference.
    """

    n: int
    lo: float
    hi: float
    start: str
    E: Array
    along_mean: Array
    along_width: Array

    def node(self, name: str, E: Array, offset: float = 0.0) -> Node:
        """Return the block with an Everett function (n (n + 1) / 2,)."""
        values: dict[str, Any] = {"lo": self.lo, "hi": self.hi, "E": E, "offset": offset, "start": self.start}
        return Node(name, "preisach", {"n": self.n}, values)

    def columns(self, u: Array) -> Array:
        """Return the output of the block along u (rows,) for each single density of the basis; shape (rows, p)."""
        out = np.empty((len(u), self.E.shape[1]), order="F")
        for i, E in enumerate(self.E.T):
            out[:, i] = Graph.single(self.node("relays", E)).run(u)
        return out


def smooth_density(u: Array, n: int, widths: int, means: int, start: str) -> SmoothDensity:
    """Make the basis for an input u (rows,): `widths` hats of d, `means` B-splines of m, on n steps of the grid."""
    low, high = float(u.min()), float(u.max())
    half, reversible = (high - low) / 2, means + DEGREE + 1
    lo, hi = low - 2 * MARGIN * half, high + 2 * MARGIN * half
    step = (hi - lo) / n
    up, down = np.tril_indices(n)
    m = lo + (up + down + 1) * step / 2 - (low + high) / 2
    d = (up - down) * step / 2
    diagonal = (up == down)[:, None]
    of_mean = splines(m / np.maximum(half - d, step / 2), means)
    of_width = np.maximum(0.0, 1 - np.abs((widths - 1) * np.minimum(d / half, 1.0)[:, None] - np.arange(widths)))
    weights = np.hstack(
        [splines(m / half, reversible) * diagonal, *(of_mean * w[:, None] * ~diagonal for w in of_width.T)]
    )
    p = reversible + widths * means
    mean = np.zeros((reversible - 1 + widths * (means - 1), p))
    mean[: reversible - 1, :reversible] = np.diff(np.eye(reversible), axis=0)
    mean[reversible - 1 :, reversible:] = np.kron(np.eye(widths), np.diff(np.eye(means), axis=0))
    width = np.zeros((max(widths - 2, 0) * means, p))
    width[:, reversible:] = np.kron(np.diff(np.eye(widths), 2, axis=0), np.eye(means))
    return SmoothDensity(n, lo, hi, start, triangles(n) @ weights, mean, width)


def splines(x: Array, n: int) -> Array:
    """Return n B-splines on [-1, 1], of degree `DEGREE` or as many as n allows, at x (m,); constant outside."""
    degree = min(DEGREE, n - 1)
    inner = np.linspace(-1.0, 1.0, n - degree + 1)
    knots = np.concatenate([np.full(degree, -1.0), inner, np.full(degree, 1.0)])
    return np.asarray(BSpline.design_matrix(np.clip(x, -1.0, 1.0), knots, degree).toarray())


class RelaySum:
    """Columns of relays for an input x (n,); the density covers the range of the rows."""

    def __init__(self, x: Array, rows: slice) -> None:
        self._x = x
        self._density = smooth_density(x[rows], GRID, WIDTHS, MEANS, "demagnetised")
        E = self._density.E
        self._everett = np.column_stack([E[:, : MEANS + DEGREE + 1].sum(axis=1), E])

    @cached_property
    def columns(self) -> Array:
        """Outputs along the input, (n, p); the first column is the input itself."""
        return replace(self._density, E=self._everett).columns(self._x)

    @property
    def penalties(self) -> tuple[tuple[float, Array | None], ...]:
        """Regularisation of the density (`bent_sum.Problem`); the weight of the input itself is free."""
        smooth = (np.pad(P, ((0, 0), (1, 0))) for P in (self._density.along_mean, self._density.along_width))
        return tuple(zip(HELD, (None, *smooth), strict=True))

    def node(self, name: str, w: Array) -> Node:
        """Return the block of the sum with weights w (p,)."""
        return self._density.node(name, self._everett @ w)
