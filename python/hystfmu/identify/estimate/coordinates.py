"""Coordinates of a search: variables of the solver with bounds and scales, and parameter values at a point."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystfmu.base.arrays import Array

MARGIN = 1e-10  # of a start to its bounds, relative to the room between them or to 1


@dataclass(frozen=True)
class Coordinates:
    """The coordinates of a search.

    Parameters
    ----------
    lo, hi : array, shape (n,)
        Bounds.
    scale : array, shape (n,)
        Scale of each coordinate: steps of this size change the output by similar amounts.
    values : function
        Returns the values of parameters, by ``node.parameter``, at a point (n,); arrays are complete.
    """

    lo: Array
    hi: Array
    scale: Array
    values: Callable[[Array], Mapping[str, ArrayLike]]

    def inside(self, p: Array) -> Array:
        """Return the point moved off its bounds."""
        room = MARGIN * np.minimum(np.maximum(self.hi - self.lo, 0.0), 1.0)
        return np.clip(p, self.lo + room, self.hi - room)

    def at_bounds(self, p: Array) -> NDArray[np.bool_]:
        """Return which coordinates are at a bound, shape (n,) of bool."""
        room = 1e-6 * np.where(np.isfinite(self.hi - self.lo), self.hi - self.lo, 1.0)
        found: NDArray[np.bool_] = (p < self.lo + room) | (p > self.hi - room)
        return found

    def only(self, moved: NDArray[np.bool_], p: Array) -> Coordinates:
        """Return the coordinates `moved` (n,) alone, with the others held at their values in `p` (n,)."""

        def values(q: Array) -> Mapping[str, ArrayLike]:
            return self.values(self.joined(moved, p, q))

        return Coordinates(self.lo[moved], self.hi[moved], self.scale[moved], values)

    @staticmethod
    def joined(moved: NDArray[np.bool_], p: Array, q: Array) -> Array:
        """Return the point `p` (n,) with the coordinates `moved` at `q`."""
        whole = p.copy()
        whole[moved] = q
        return whole
