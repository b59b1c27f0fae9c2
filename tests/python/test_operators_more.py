"""Constraint factor, reconstructed inverse, KP, Preisach, Duhem, polynomial NARX, differentiator: against other methods."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from hystfmu.blocks import ConstraintFactor, ZhaoTan, ZhaoTanInverseReconstructed
from hystfmu.errors import InputError

Array = NDArray[np.float64]


# ---- return-point memory from the definition: no stack, every row reads the whole history ---------------------------
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
    "growing": 1.04 ** np.arange(80) * np.where(np.arange(80) % 2, 0.1, -0.1),
    "plateaus": np.repeat(RNG.uniform(-1, 1, 60), 3),
    "closes_on_extrema": RNG.integers(-4, 5, 200) / 4.0,
}
every_signal = pytest.mark.parametrize("signal", SIGNALS)


# ---- constraint factor ----------------------------------------------------------------------------------------------
PUBLISHED = [3.5024e02, -4.7518e03, 3.8646e04, -1.9549e05, 6.3845e05, -1.3467e06, 1.7721e06, -1.3230e06, 4.2793e05]


def constrained(a0: float, a: list[float]) -> Callable[[float], float]:
    return lambda d: float((1 - np.exp(-d)) * (a0 + sum(c * d ** (2 * j - 1) for j, c in enumerate(a, 1))))


@every_signal
@pytest.mark.parametrize("a", [[1.0], [0.4, 0.3, 0.2], [0.5, -0.2, 0.05, 0.01, 0.002]])
def test_constraint_factor_is_the_operator_of_the_whole_history(signal: str, a: list[float]) -> None:
    x = SIGNALS[signal]
    expected = of_distance(x, 0.2, 0.0, constrained(0.7, a))
    assert np.abs(ConstraintFactor(a0=0.7, a=a, x0=0.2)(x) - expected).max() <= 1e-13 * np.abs(expected).max()


@pytest.mark.parametrize("memory", ["dominant", "last"])
def test_constraint_factor_of_one_power_is_zhao_tan(memory: str) -> None:
    x = SIGNALS["white"]
    h = ZhaoTan(memory=memory, x0=0.3)(x)
    assert np.array_equal(ConstraintFactor(a0=0.0, a=[1.0], memory=memory, x0=0.3)(x), h)


def test_constraint_factor_goes_on_straight_beyond_d_max() -> None:
    x = np.linspace(0, 2, 2001)  # virgin branch: d = 2 x
    h = ConstraintFactor(a0=0.5, a=[1.0, 0.25], d_max=2.0)(x)
    near = constrained(0.5, [1.0, 0.25])
    assert np.abs(h[:1001] - [near(2 * v) / 2 for v in x[:1001]]).max() <= 1e-14
    slope = np.diff(h) / 1e-3
    assert np.abs(slope[1000:] - slope[1000]).max() <= 1e-10
    assert np.abs(slope[1000] - slope[999]) <= 5e-3  # no corner


def test_published_coefficients_of_shen_and_ma_are_no_operator() -> None:
    """Table 1: a_0 < 0 makes every branch fall at its start; the literal reading still runs."""
    values = {"a0": -13.1053, "a": PUBLISHED, "d_max": 1.0}
    with pytest.raises(InputError, match="must not fall between d = 0 and d_max"):
        ConstraintFactor(**values)([0.0, 1.0])
    h = ConstraintFactor(**values, memory="last")([0.0, 0.001, 0.5])
    d = np.array([0.0, 0.001, 0.5])
    powers = d[:, None] ** np.arange(1, 18, 2)
    assert np.abs(h - (1 - np.exp(-d)) * (powers @ PUBLISHED - 13.1053)).max() <= 1e-9
    assert h[1] < 0


@pytest.mark.parametrize(("d_max", "increases"), [(0.9, True), (1.1, False), (3.0, False)])
def test_a_branch_that_falls_somewhere_is_refused(d_max: float, increases: bool) -> None:
    """a0 + a_1 d + a_2 d^3 with a dip behind d = 1, found by numpy."""
    a0, a = 1.0, [1.0, -0.6117]
    g = np.array([constrained(a0, a)(d) for d in np.linspace(0, d_max, 100_001)])
    assert (np.diff(g) > 0).all() == increases
    block = ConstraintFactor(a0=a0, a=a, d_max=d_max)
    if increases:
        block([0.0, 1.0])
    else:
        with pytest.raises(InputError, match="must not fall"):
            block([0.0, 1.0])


# ---- reconstructed inverse ------------------------------------------------------------------------------------------
@every_signal
def test_reconstructed_inverse_is_the_operator_of_the_whole_history(signal: str) -> None:
    h = SIGNALS[signal]
    expected = of_distance(h, 0.0, 0.4, lambda d: float((1 + np.exp(-d)) * d))
    assert np.abs(ZhaoTanInverseReconstructed(x0=0.4)(h) - expected).max() <= 2e-14


@every_signal
def test_reconstructed_inverse_is_twice_its_input_minus_the_forward_operator(signal: str) -> None:
    """(1 + e^-d) d = 2 d - (1 - e^-d) d: the network sees the forward operator up to its own input."""
    h = SIGNALS[signal]
    assert np.abs(ZhaoTanInverseReconstructed()(h) - (2 * h - ZhaoTan()(h))).max() <= 2e-14


def test_reconstructed_inverse_turns_clockwise_and_the_forward_operator_does_not() -> None:
    t = np.linspace(0, 4 * np.pi, 2001)
    u = np.sin(t)
    for block, turns in ((ZhaoTan(), 1), (ZhaoTanInverseReconstructed(), -1)):
        y = block(u)[1000:]
        area = np.sum((u[1000:-1] * np.diff(y) - y[:-1] * np.diff(u[1000:])) / 2)  # > 0: counter-clockwise
        assert np.sign(area) == turns
