"""Preisach model: a non-negative density of relays on the cells of a grid, by least squares, and an offset.

y = c + integral over alpha >= beta of mu(alpha, beta) relay_{alpha, beta}[u].  The output is linear in mu: the columns
of the regression are the outputs of the block `preisach` for one cell at a time.  These are steps between saturations;
columns for the values of the Everett function would cancel each other.  The Everett function is the sum of mu over the
triangle between beta and alpha.  Minor loops differ with their place, unlike those of a sum of plays, but wiping-out
and congruence hold.  Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.options import Option
from hystfmu.identify.solvers.nonnegative import nonnegative

TEXT = "density of relays on a grid, weights >= 0; gives the Everett function"
RECORDS = True
OPTIONS = (
    Option("n", 32, 1, 100, text="steps of the grid over the range of u; n (n + 1) / 2 cells"),
    Option("start", "demagnetised", choices=("demagnetised", "low", "high"), text="memory before the first row"),
)


def triangles(n: int) -> Array:
    """Return the Everett function of one cell at a time: 1 at the nodes whose triangle contains the cell.

    Parameters
    ----------
    n : int
        Steps of the grid.

    Returns
    -------
    array, shape (n (n + 1) / 2, n (n + 1) / 2)
        Rows are nodes (alpha_i, beta_j), i > j, in the order of the block's `E`.  Columns are cells between alpha_k,
        alpha_k+1 and beta_l, beta_l+1, k >= l, row by row of k; for k = l the triangle on the diagonal.
    """
    up, down = np.tril_indices(n)
    inside = (up[None, :] <= up[:, None]) & (down[None, :] >= down[:, None])
    return np.asarray(inside, dtype=np.float64)


def columns(u: Array, n: int, lo: float, hi: float, start: str) -> Array:
    """Return the output of the block for weight 1 on each cell alone, along u (rows,); shape (rows, n (n + 1) / 2)."""
    cells = triangles(n)
    out = np.empty((len(u), cells.shape[1]), order="F")
    for c in range(cells.shape[1]):
        values: dict[str, Any] = {"lo": lo, "hi": hi, "E": cells[:, c], "start": start}
        out[:, c] = Graph.single(Node("relays", "preisach", {"n": n}, values)).run(u)
    return out


def build(data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]) -> tuple[Graph, int]:
    """Build the graph of one ``preisach``; return it with the number of its parameters."""
    rows, n, start = data.counted, options["n"], options["start"]
    u, y = data.u[rows], data.y[rows]
    lo, hi = float(data.u[data.train].min()), float(data.u[data.train].max())
    A = data.along(lambda u: columns(u, n, lo, hi, start), data.train.stop)[rows]
    progress(0.5)
    sign = -1.0 if np.sum((u - u.mean()) * (y - y.mean())) < 0 else 1.0  # -1 if the output falls as u rises
    mu, (offset,) = nonnegative(A, sign * y, np.ones((len(y), 1)))
    values = {"lo": lo, "hi": hi, "E": sign * (triangles(n) @ mu), "offset": sign * float(offset), "start": start}
    return Graph(
        [Node("hysteresis", "preisach", {"n": n}, values)],
        (),
        [Input("u", ("hysteresis.u",), data.unit_u, float(data.u[0]))],
        [Output("y", "hysteresis.y", data.unit_y)],
    ), len(mu) + 1
