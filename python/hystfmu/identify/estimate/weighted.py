"""Weighted sum of signals before linear dynamics: the weights are fitted for each trial of the dynamics.

The derivatives of the residuals with respect to the dynamics are those of Kaufman (see `objective`): they need one
filtered signal per parameter, the weighted sum.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.identify.estimate.dynamics import Beside, Dynamics
from hystfmu.identify.estimate.search import Differences

RATED = 1500  # minimum number of rows on which start points are compared; more rows are thinned evenly
DEPENDENT = 1e-10  # relative singular value of normalised columns below which a combination counts as dependent


class Weighted:
    """Signals before the dynamics, whose weighted sum after the dynamics approximates the output on some rows.

    `columns` (n, m) contains the signals. `fit` returns the weights (m,) of the filtered signals (rows, m) for an
    output (rows,), and the weights that a small change of the dynamics also changes, as a mask (m,).
    """

    def __init__(
        self,
        columns: Array,
        data: Dataset,
        rows: NDArray[np.intp],
        hold: str,
        fit: Callable[[Array, Array], tuple[Array, NDArray[np.bool_]]],
    ) -> None:
        self.columns, self.data, self.rows, self.hold, self.fit = columns, data, rows, hold, fit
        self._last: tuple[Dynamics | None, Array, Array, Array] = None, columns, columns, columns

    def thinned(self) -> Weighted:
        """Return the problem on at least `RATED` rows, if there are as many."""
        rows = self.rows[:: max(1, len(self.rows) // RATED)]
        return Weighted(self.columns, self.data, rows, self.hold, self.fit)

    def project(self, g: Dynamics) -> tuple[Array, Array, Array]:
        """Return the residuals (rows,) for the dynamics g, the weights (m,), and the columns of weights that change."""
        if self._last[0] != g:
            seen, y = g.filter(self.columns, self.data.h, self.hold, self.rows), self.data.y[self.rows]
            weights, moves = self.fit(seen, y)
            self._last = g, seen @ weights - y, weights, seen[:, moves]
        return self._last[1:]

    def differences(self, beside: Beside, limits: tuple[Array, Array]) -> Differences:
        """Return the residuals, relative to the span of y, as a function of the point of a search between `limits`."""
        h, size = self.data.h, self.data.span * np.sqrt(len(self.rows))

        def held(p: Array) -> tuple[Callable[[Array], Array], Array]:
            _, weights, moving = self.project(Dynamics.at(p, h, beside))
            total = (self.columns @ weights)[:, None]
            U, s, _ = np.linalg.svd(moving / np.maximum(np.linalg.norm(moving, axis=0), 1e-300), full_matrices=False)

            def run(q: Array) -> Array:
                return np.asarray(Dynamics.at(q, h, beside).filter(total, h, self.hold, self.rows)[:, 0] / size)

            return run, np.asarray(U[:, s > DEPENDENT * s.max(initial=0.0)])

        def residuals(p: Array) -> Array:
            return np.asarray(self.project(Dynamics.at(p, h, beside))[0] / size)

        return Differences(residuals, np.ones(len(limits[0])), limits, held=held)
