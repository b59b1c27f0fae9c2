"""Return-point memory by its definition, without a stack: every row reads the whole history; inputs to test it."""

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

Array = NDArray[np.float64]


def dominant_extrema(path: Array, x0: float) -> list[float]:
    """The farthest value from x0, then the lowest (highest) after it, the highest (lowest) after that, .., the last."""
    far = np.abs(path - x0)
    i = len(path) - 1 - int(np.argmax(far[::-1]))
    extrema, down = [float(path[i])], path[i] > x0
    while i < len(path) - 1:
        rest = path[i + 1 :]
        best = rest.min() if down else rest.max()
        extrema.append(float(best))
        i += len(rest) - int(np.argmax(rest[::-1] == best))
        down = not down
    return extrema


def with_memory(u: Array, x0: float, virgin: Callable[[float], float], rise: Callable[[float, float], float]) -> Array:
    """virgin(x) of the first extremum, then rise(a, b) > 0 or minus it for every branch between a < b."""
    rows = []
    for k in range(len(u)):
        e = dominant_extrema(np.concatenate([[x0], u[: k + 1]]), x0)
        steps = [rise(a, b) if b > a else -rise(b, a) for a, b in itertools.pairwise(e)]
        rows.append(virgin(e[0]) + sum(steps))
    return np.array(rows)


def of_distance(u: Array, x0: float, h0: float, g: Callable[[float], float]) -> Array:
    """Branch g(|x - x_p|), virgin branch g(2|x - x0|)/2."""
    return with_memory(u, x0, lambda x: h0 + np.sign(x - x0) * g(2 * abs(x - x0)) / 2, lambda a, b: g(b - a))


RNG = np.random.default_rng(8)
SIGNALS: dict[str, Array] = {
    "white": RNG.uniform(-1, 1, 200),
    "nested": 0.97 ** np.arange(80) * np.where(np.arange(80) % 2, 1.0, -1.0),
    "growing": 1.03 ** np.arange(80) * np.where(np.arange(80) % 2, 0.1, -0.1),
    "plateaus": np.repeat(RNG.uniform(-1, 1, 60), 3),
    "closes_on_extrema": RNG.integers(-4, 5, 200) / 4.0,
}
every_signal = pytest.mark.parametrize("signal", SIGNALS)
