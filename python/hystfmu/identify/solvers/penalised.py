"""Least squares with non-negative and free weights under quadratic penalties, their strengths by cross-validation.

It minimises |y - c - A x - F v|^2 + s_0^2 |scaled (x, v)|^2 + sum_i s_i^2 |P_i x|^2 over x >= 0, v and c. The rows are
reduced to the triangles of their QR factors, one for each chunk of consecutive rows, so that other strengths or chunks
need no further pass over the rows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.identify.solvers.nonnegative import nonnegative

FOLDS = 10
LEAST_SIZE = 0.1  # of the largest column: a column that the rows hardly excite is not scaled up further

Strengths = tuple[float, ...]


class Penalised:
    """A regression problem.

    Parameters
    ----------
    bounded, free : array, shape (n, p) and (n, q)
        Columns A with non-negative weights, and F with free weights.
    y : array, shape (n,)
        Target.
    penalties : sequence of array, shape (m, p)
        Matrices P_i, for columns of median size.
    """

    def __init__(self, bounded: Array, free: Array, y: Array, penalties: Sequence[Array]) -> None:
        columns = np.column_stack([bounded, free])
        self.n, self.m = bounded.shape[1], columns.shape[1]
        self.middle, self.mean = columns.mean(axis=0), float(y.mean())
        columns = columns - self.middle
        size = np.linalg.norm(columns, axis=0)
        size[: self.n] = np.maximum(size[: self.n], LEAST_SIZE * size[: self.n].max())
        size[size == 0] = 1.0
        self.size = size
        typical = float(np.median(size[: self.n]))
        wide = [np.hstack([p / size[: self.n] * typical, np.zeros((len(p), self.m - self.n))]) for p in penalties]
        self._penalties = [np.eye(self.m), *wide]
        self._rows = np.column_stack([columns / size, np.ones(len(y)), y - self.mean])
        self._chunks = np.array_split(self._rows, min(FOLDS, len(y) // 2))
        parts = [_triangle(chunk) for chunk in self._chunks]
        self._whole = _triangle(np.vstack(parts))
        self._without = [_triangle(np.vstack(parts[:i] + parts[i + 1 :])) for i in range(len(parts))]

    def solve(self, strengths: Strengths) -> tuple[Array, Array, float]:
        """Return x (p,), v (q,) and c for these strengths, first that of the ridge on all scaled weights."""
        z = self._solved(self._whole, strengths)
        w = z[:-1] / self.size
        return w[: self.n], w[self.n :], float(self.mean + z[-1] - self.middle @ w)

    def error(self, strengths: Strengths) -> float:
        """Return the RMS error over `FOLDS` chunks of consecutive rows, each predicted from the others."""
        squares = [
            float(np.sum((chunk[:, :-1] @ self._solved(triangle, strengths) - chunk[:, -1]) ** 2))
            for chunk, triangle in zip(self._chunks, self._without, strict=True)
        ]
        return float(np.sqrt(np.sum(squares) / len(self._rows)))

    def _solved(self, triangle: Array, strengths: Strengths) -> Array:
        """Return the scaled weights and the constant."""
        held = np.vstack([s * p for s, p in zip(strengths, self._penalties, strict=True)])
        A = np.vstack([triangle[:, : self.m], held])
        rest = np.zeros(len(held))
        free = np.column_stack([A[:, self.n :], np.concatenate([triangle[:, self.m], rest])])
        x, v = nonnegative(A[:, : self.n], np.concatenate([triangle[:, -1], rest]), free)
        return np.concatenate([x, v])


def _triangle(rows: Array) -> Array:
    return np.asarray(np.linalg.qr(rows, mode="r"))


def best_strengths(
    problem: Penalised, levels: Sequence[Strengths], progress: Callable[[float], None]
) -> tuple[Strengths, float]:
    """Choose the strengths with the least error of cross-validation, one after the other until none changes.

    Parameters
    ----------
    problem : Penalised
        Regression problem.
    levels : sequence of tuple
        Levels of each strength to try, from weak to strong; the search starts in the middle.
    progress : function
        Called with the fraction done, 0..1.

    Returns
    -------
    strengths : tuple of float
        One of its levels for each.
    error : float
        Error of cross-validation.
    """
    at = [len(some) // 2 for some in levels]
    known: dict[tuple[int, ...], float] = {}

    def error(place: list[int]) -> float:
        key = tuple(place)
        if key not in known:
            known[key] = problem.error(tuple(some[i] for some, i in zip(levels, place, strict=True)))
            progress(min(1.0, len(known) / (3 * sum(map(len, levels)))))
        return known[key]

    while True:
        before = list(at)
        for axis, some in enumerate(levels):
            places = [[*at[:axis], i, *at[axis + 1 :]] for i in range(len(some))]
            at = min(places, key=error)
        if at == before:
            return tuple(some[i] for some, i in zip(levels, at, strict=True)), error(at)
