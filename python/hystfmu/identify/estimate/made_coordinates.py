"""Coordinates of free parameters: logarithms, steps of values that rise, ratios of values with a given sum."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.identify.estimate.coordinates import Coordinates
from hystfmu.identify.estimate.default_bounds import is_log
from hystfmu.identify.estimate.free import Free

RATIO = 10.0  # bound of the logarithm of a value over the last one, where the sum is given
STEP = 0.3  # scale of a logarithm
SHARE = 0.1  # scale of another coordinate, relative to the room between its bounds


@dataclass(frozen=True)
class _Part:
    """Coordinates of one free parameter."""

    lo: Array
    hi: Array
    scale: Array
    start: Array
    values: Callable[[Array], Array]


def made_coordinates(
    frees: Sequence[Free], bounds: Sequence[tuple[float, float]], whole: Mapping[str, Array]
) -> tuple[Coordinates, Array]:
    """Return the coordinates of a search and its first start.

    Parameters
    ----------
    frees : sequence of Free
        What is searched.
    bounds : sequence of (float, float)
        Their bounds.
    whole : mapping of str to array
        Values of the parameters in the graph, by ``node.parameter``, with the elements that are not free.
    """
    parts = [_part(free, lo, hi) for free, (lo, hi) in zip(frees, bounds, strict=True)]
    ends = np.cumsum([0, *(len(part.start) for part in parts)])

    def values(p: Array) -> dict[str, Array]:
        found: dict[str, Array] = {}
        for free, part, first, last in zip(frees, parts, ends, ends[1:], strict=False):
            array = found.setdefault(free.place, whole[free.place].copy())
            array[list(free.elements)] = part.values(p[first:last])
        return found

    def joined(name: str) -> Array:
        return np.concatenate([np.zeros(0), *(getattr(part, name) for part in parts)])

    return Coordinates(joined("lo"), joined("hi"), joined("scale"), values), joined("start")


def _part(free: Free, lo: float, hi: float) -> _Part:
    n, room = len(free.start), hi - lo
    if free.sum is not None:
        total = free.sum

        def shares(p: Array) -> Array:
            e = np.exp(np.append(p, 0.0))
            return np.asarray(total * e / e.sum())

        first = np.log(free.start[:-1] / free.start[-1])
        return _Part(first - RATIO, first + RATIO, np.full(n - 1, STEP), first, shares)
    if free.rises:

        def rising(p: Array) -> Array:
            return np.asarray(np.minimum(np.cumsum(p), hi))

        least = np.concatenate([[lo], np.zeros(n - 1)])
        most = np.concatenate([[hi], np.full(n - 1, room)])
        return _Part(least, most, np.full(n, SHARE * room / n), np.diff(free.start, prepend=0.0), rising)
    if is_log(free):
        ends = np.log(lo), np.log(hi)
        return _Part(np.full(n, ends[0]), np.full(n, ends[1]), np.full(n, STEP), np.log(free.start), np.exp)
    return _Part(np.full(n, lo), np.full(n, hi), np.full(n, SHARE * room), free.start.copy(), np.array)
