"""Crossings of the branches of an operator, and differences of the hysteresis outputs at these crossings.

Lemma 1 and theorems 1 and 2 of Zhao & Tan 2008, and the theorem of the IPMC paper, state that input and operator value
together determine the output of the hysteresis. This is false if two branches cross that share no extremum, and if the
outputs differ at the crossing.
"""

from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from hystfmu.base import Array

LEAST = 1e-4  # a smaller gap, relative to the range of h, is an error of the straight lines between samples
END = 0.02  # excluded ends of the common range; neighbours meet at their extremum, which is not a crossing


@dataclass(frozen=True)
class Branch:
    """Samples between two extrema of the input, sorted by increasing input.

    `x` is the input, `h` the operator value, and `y` the hysteresis output, each of shape (n,). `number` counts the
    branches in time, and `rising` states whether the input increases.
    """

    number: int
    rising: bool
    x: Array
    h: Array
    y: Array


@dataclass(frozen=True)
class Crossings:
    """Crossings of branches: their numbers, and the largest difference of the outputs.

    Parameters
    ----------
    neighbours, others : int
        Number of crossings of branches that share an extremum, and of all other branches.
    difference : float
        Largest difference of the two outputs at a crossing, in the unit of measure of y.
    """

    neighbours: int
    others: int
    difference: float


def branches(x: Array, h: Array, y: Array) -> list[Branch]:
    """Return the branches of a signal: input x, operator value h and output y (n,), split at the extrema of x."""
    turns = np.flatnonzero(np.diff(np.sign(np.diff(x))) != 0) + 1
    ends = [0, *turns.tolist(), len(x) - 1]
    found = []
    for number, (a, b) in enumerate(pairwise(ends)):
        rising = bool(x[b] > x[a])
        rows = slice(a, b + 1)
        found.append(Branch(number, rising, *(v[rows][:: 1 if rising else -1] for v in (x, h, y))))
    return found


def crossings(x: Array, h: Array, y: Array) -> Crossings:
    """Count the crossings of all pairs of branches in the plane of x and h, and compare the outputs y at each crossing.

    x, h and y have shape (n,). Between samples, the branches are linear.
    """
    counts, difference = [0, 0], 0.0
    for a, b in combinations(branches(x, h, y), 2):
        lo, hi = max(a.x[0], b.x[0]), min(a.x[-1], b.x[-1])
        margin = END * (hi - lo)
        if hi - lo <= END:
            continue
        at = np.linspace(lo + margin, hi - margin, 400)
        gap = np.interp(at, a.x, a.h) - np.interp(at, b.x, b.h)
        seen = np.abs(gap) > LEAST * np.ptp(h)
        at, gap = at[seen], gap[seen]
        for k in np.flatnonzero(gap[1:] * gap[:-1] < 0):
            where = at[k] + (at[k + 1] - at[k]) * gap[k] / (gap[k] - gap[k + 1])
            counts[min(b.number - a.number, 2) - 1] += 1
            difference = max(difference, abs(float(np.interp(where, a.x, a.y) - np.interp(where, b.x, b.y))))
    return Crossings(counts[0], counts[1], difference)


def least_slope(x: Array, h: Array, near: float) -> float:
    """Return the least slope dh/dx on all branches of an operator with input x and value h, shape (n,).

    Points nearer than `near` to the start of their branch are excluded.
    """
    slopes = []
    for b in branches(x, h, x):
        far = (b.x - b.x[0] if b.rising else b.x[-1] - b.x) > near
        slope = np.diff(b.h) / np.diff(b.x)
        slopes.append(slope[far[1:] & far[:-1]])
    return float(np.concatenate(slopes).min())


def area(x: Array, y: Array) -> float:
    """Return the signed area of a closed loop (x, y) divided by the area of its bounding box.

    The area is positive if the loop is counterclockwise.
    """
    enclosed = float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2
    return enclosed / float(np.ptp(x) * np.ptp(y))
