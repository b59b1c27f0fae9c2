"""Smooth Preisach density with few parameters.

A relay has the thresholds alpha >= beta. Let m = (alpha + beta) / 2 be their mean, d = (alpha - beta) / 2 their
half-difference, and h half of the trained range of the input. The density is a weighted sum of basis functions. Each
basis function is the product of a hat function of d and a quadratic B-spline of m / (h - d). This quotient maps the
triangle of all relays to a rectangle, so that the input excites every basis function. On the line d = 0, separate
B-splines represent the reversible part, which is a monotone function of the input. A density that does not depend on m
is equivalent to a sum of plays.

Outside the trained range, the density is constant and equal to its value at the boundary. The grid extends beyond the
trained range by `MARGIN` times the range on each side.

`RelaySum` provides these basis functions and the input as regressors. The data do not determine the weights of
regressors with little excitation. Therefore a ridge penalty and two smoothness penalties are used. Their strengths are
the middle levels of the kind `preisach`, which chooses the strengths by cross-validation.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from hystfmu.base import Array
from hystfmu.graph import Graph, Node
from hystfmu.identify.estimate.runs import Runs

MARGIN = 0.1
DEGREE = 2
GRID, WIDTHS, MEANS = 40, 16, 8  # number of grid steps, hat functions and B-splines of `RelaySum`
HELD = (1e-3, 3e-2, 3e-2)  # strengths of the ridge, and of the smoothness penalties over the mean and over d


def triangles(n: int) -> Array:
    """Return the Everett functions of a grid with n steps, one column for a density of 1 in a single cell.

    A cell is the region between alpha_k and alpha_k+1 and between beta_l and beta_l+1, with k >= l. A cell with k = l
    is a triangle on the diagonal. The columns are the cells, sorted by k. The rows are the grid nodes (alpha_i, beta_j)
    with i > j, in the order of the parameter `E` of the block. An element is 1 if the triangle of relays that belongs
    to the node contains the cell, otherwise 0.
    """
    up, down = np.tril_indices(n)
    inside = (up[None, :] <= up[:, None]) & (down[None, :] >= down[:, None])
    return np.asarray(inside, dtype=np.float64)


@dataclass(frozen=True)
class SmoothDensity:
    """A basis of p densities for the block ``preisach``, whose grid has n steps from lo to hi.

    `start` is the initial memory. The columns of E (n (n + 1) / 2, p) are the Everett functions of the densities. The
    matrices `along_mean` and `along_width` have p columns. Multiplied by the weights of the densities, `along_mean`
    gives first differences over the mean m, and `along_width` gives second differences over the half-difference d.
    """

    n: int
    lo: float
    hi: float
    start: str
    E: Array
    along_mean: Array
    along_width: Array

    def node(self, name: str, E: Array, offset: float = 0.0) -> Node:
        """Return a block ``preisach`` with the Everett function E (n (n + 1) / 2,)."""
        values: dict[str, Any] = {"lo": self.lo, "hi": self.hi, "E": E, "offset": offset, "start": self.start}
        return Node(name, "preisach", {"n": self.n}, values)

    def columns(self, u: Array) -> Array:
        """Return the outputs (rows, p) of the block for the input u (rows,), one column for each density."""
        zero = Runs(Graph.single(self.node("relays", np.zeros(len(self.E)))))
        return zero.sensitivities(u[:, None], 1.0, [{"relays.E": E} for E in self.E.T], np.arange(len(u)), 1.0)[1]


def smooth_density(u: Array, n: int, widths: int, means: int, start: str) -> SmoothDensity:
    """Return the basis for an input u (rows,), with `widths` hat functions of d and `means` B-splines of the mean.

    The grid has n steps, and `start` is the initial memory.
    """
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
    """Return the values (m, n) of n B-splines on [-1, 1] at the points x (m,); outside this range they are constant.

    The degree is `DEGREE`, or n - 1 if this is smaller.
    """
    degree = min(DEGREE, n - 1)
    inner = np.linspace(-1.0, 1.0, n - degree + 1)
    knots = np.concatenate([np.full(degree, -1.0), inner, np.full(degree, 1.0)])
    return np.asarray(BSpline.design_matrix(np.clip(x, -1.0, 1.0), knots, degree).toarray())


class RelaySum:
    """Regressors of a smooth Preisach density for an input x (n,); the density covers the range of x on `rows`."""

    def __init__(self, x: Array, rows: slice) -> None:
        self._x = x
        self._density = smooth_density(x[rows], GRID, WIDTHS, MEANS, "demagnetised")
        E = self._density.E
        self._everett = np.column_stack([E[:, : MEANS + DEGREE + 1].sum(axis=1), E])

    @cached_property
    def columns(self) -> Array:
        """Outputs of the basis densities, (n, p). The first column is the input itself."""
        return replace(self._density, E=self._everett).columns(self._x)

    @property
    def penalties(self) -> tuple[tuple[float, Array | None], ...]:
        """Penalties of the density for `bent_sum.Problem`. Smoothness penalties do not apply to the input column."""
        smooth = (np.pad(P, ((0, 0), (1, 0))) for P in (self._density.along_mean, self._density.along_width))
        return tuple(zip(HELD, (None, *smooth), strict=True))

    def node(self, name: str, w: Array) -> Node:
        """Return a block ``preisach`` that computes the sum of the regressors with the weights w (p,)."""
        return self._density.node(name, self._everett @ w)
