"""Curves of diagrams as SVG path data, thinned to the resolution of a screen."""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array


def path(x: Array, y: Array) -> str:
    """Return a curve as SVG path data in relative steps of a tenth of a point.

    Decimals would need three times the size.
    """
    points = np.column_stack([x, y])
    tenths = np.round(10 * points).astype(int)
    steps = np.diff(tenths, axis=0)
    steps = steps[np.any(steps != 0, axis=1)]
    return f"M{tenths[0, 0]} {tenths[0, 1]}l" + " ".join(f"{a} {b}" for a, b in steps.tolist() or [[0, 0]])


def dots(x: Array, y: Array) -> str:
    """Return points as SVG path data: closed subpaths without length. Round line ends make them visible."""
    tenths = np.round(10 * np.column_stack([x, y])).astype(int)
    steps = np.diff(tenths, axis=0, prepend=0).tolist()
    return f"M{steps[0][0]} {steps[0][1]}z" + "".join(f"m{a} {b}z" for a, b in steps[1:])


def thin(x: Array, y: Array, points: int, envelope: bool = False) -> tuple[Array, Array]:
    """Return at most `points` rows of a curve, evenly spaced.

    With `envelope`, return the lowest and the highest row of every piece of the curve.
    """
    n = len(x)
    if n <= points:
        return x, y
    if not envelope:
        picked = np.unique(np.linspace(0, n - 1, points).round().astype(int))
        return x[picked], y[picked]
    extremes = []  # ripple and peaks stay visible
    for piece in np.array_split(np.arange(n), points // 2):
        extremes += sorted((piece[y[piece].argmin()], piece[y[piece].argmax()]))
    picked = np.array(extremes)
    return x[picked], y[picked]
