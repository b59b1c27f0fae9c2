"""Dead zones and first-order lags of the input as columns of a regression: bends, creep and rate dependence."""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.graph import Graph, Node


def knots(u: Array, n: int) -> Array:
    """Return thresholds (n,) of dead zones, evenly inside the range of u; at 0 a dead zone would be the input."""
    s = u.min() + np.ptp(u) * np.arange(1, n + 1) / (n + 1)
    least = 1e-6 * np.ptp(u)
    return np.where(np.abs(s) < least, least, s)


def dead_zones(u: Array, s: Array) -> Array:
    """Return one-sided dead zones of u (n,), shape (n, m); the sign of a threshold in s (m,) is its side."""
    d = u[:, None] - s
    return np.where(s > 0, np.maximum(d, 0), np.minimum(d, 0))


def lag(u: Array, h: float, T: float) -> Array:
    """Run a first-order lag of u (n,) from its steady state in the C core; step h (s), time constant T (s)."""
    return Graph.single(Node("lag", "creep", {}, {"w": 1.0, "T": T, "start": "steady"})).run(u, h)
