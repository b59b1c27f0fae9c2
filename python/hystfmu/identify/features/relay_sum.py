"""Relays with a smooth density as the columns of a sum: those of `smooth_density`, the input itself before them.

In a sum of so many columns, weights with little excitation would be arbitrary. A ridge and two penalties keep the
density smooth. Their strengths are the middle ones of the kind `preisach`, which chooses them by cross-validation.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.graph import Node
from hystfmu.identify.features.smooth_density import DEGREE, smooth_density

GRID, WIDTHS, MEANS = 40, 16, 8
HELD = (1e-3, 3e-2, 3e-2)  # strengths of the ridge and of the penalties over mean and width of the density


class RelaySum:
    """Columns of relays for an input.

    Parameters
    ----------
    x : array, shape (n,)
        Input.
    rows : slice
        Rows whose range the density covers.
    """

    def __init__(self, x: Array, rows: slice) -> None:
        self._x = x
        self._density = smooth_density(x[rows], GRID, WIDTHS, MEANS, "demagnetised")
        E = self._density.E
        self._everett = np.column_stack([E[:, : MEANS + DEGREE + 1].sum(axis=1), E])

    @cached_property
    def columns(self) -> Array:
        """Outputs along the input, (n, p), the first that of the input itself."""
        return replace(self._density, E=self._everett).columns(self._x)

    @property
    def penalties(self) -> tuple[tuple[float, Array | None], ...]:
        """Regularisation of the density (`bent_sum.Problem`); the weight of the input itself is free."""
        smooth = (np.pad(P, ((0, 0), (1, 0))) for P in (self._density.along_mean, self._density.along_width))
        return tuple(zip(HELD, (None, *smooth), strict=True))

    def node(self, name: str, w: Array) -> Node:
        """Return the block of the sum with weights w (p,)."""
        return self._density.node(name, self._everett @ w)
