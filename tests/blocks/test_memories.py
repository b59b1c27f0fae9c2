"""Operators with return-point memory: each against the operator of the whole history, or a sum of relays."""

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from whole_history import SIGNALS, every_signal, of_distance, with_memory

from hystfmu.base.errors import InputError
from hystfmu.graph.blocks import (
    Block,
    ConstraintFactor,
    KrasnoselskiiPokrovskii,
    PlayBank,
    PrandtlIshlinskii,
    Preisach,
    ZhaoTan,
    ZhaoTanInverseReconstructed,
)

Array = NDArray[np.float64]


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
    assert np.abs(slope[1000] - slope[999]) <= 5e-3  # no kink


def test_published_coefficients_of_shen_and_ma_are_no_operator() -> None:
    """Table 1: a_0 < 0 makes every branch fall at its start; the literal form still runs."""
    values = {"a0": -13.1053, "a": PUBLISHED, "d_max": 1.0}
    with pytest.raises(InputError, match="must not decrease between d = 0 and d_max"):
        ConstraintFactor(**values)([0.0, 1.0])
    h = ConstraintFactor(**values, memory="last")([0.0, 0.001, 0.5])
    d = np.array([0.0, 0.001, 0.5])
    powers = d[:, None] ** np.arange(1, 18, 2)
    assert np.abs(h - (1 - np.exp(-d)) * (powers @ PUBLISHED - 13.1053)).max() <= 1e-9
    assert h[1] < 0


@pytest.mark.some(1)
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
        with pytest.raises(InputError, match="must not decrease between"):
            block([0.0, 1.0])


# ---- reconstructed inverse ------------------------------------------------------------------------------------------
@every_signal
def test_reconstructed_inverse_is_the_operator_of_the_whole_history(signal: str) -> None:
    h = SIGNALS[signal]
    expected = of_distance(h, 0.0, 0.4, lambda d: float((1 + np.exp(-d)) * d))
    assert np.abs(ZhaoTanInverseReconstructed(x0=0.4)(h) - expected).max() <= 2e-14


@every_signal
def test_reconstructed_inverse_is_twice_its_input_minus_the_forward_operator(signal: str) -> None:
    """(1 + e^-d) d = 2 d - (1 - e^-d) d: the network input is the forward operator up to its own input."""
    h = SIGNALS[signal]
    assert np.abs(ZhaoTanInverseReconstructed()(h) - (2 * h - ZhaoTan()(h))).max() <= 2e-14


def test_reconstructed_inverse_turns_clockwise_and_the_forward_operator_does_not() -> None:
    t = np.linspace(0, 4 * np.pi, 2001)
    u = np.sin(t)
    for block, turns in ((ZhaoTan(), 1), (ZhaoTanInverseReconstructed(), -1)):
        y = block(u)[1000:]
        area = np.sum((u[1000:-1] * np.diff(y) - y[:-1] * np.diff(u[1000:])) / 2)  # > 0: counter-clockwise
        assert np.sign(area) == turns


# ---- Krasnosel'skii-Pokrovskii --------------------------------------------------------------------------------------
def kernels(u: Array, a: float, p1: Array, p2: Array) -> Array:
    """Kernels by the direction of the input, from saturation at the first row: a rising ramp or a falling one."""

    def r(x: Array) -> Array:
        return np.interp(x, [0, a], [-1, 1])

    k = r(u[0] - p2)
    rows = [k]
    for last, now in itertools.pairwise(u):
        if now > last:
            k = np.maximum(k, r(now - p2))
        elif now < last:
            k = np.minimum(k, r(now - p1))
        rows.append(k)
    return np.array(rows)


def triangle(grid: Array) -> tuple[Array, Array]:
    i, j = np.tril_indices(len(grid))
    return grid[j], grid[i]


@every_signal
def test_210_kernels_on_the_triangle_of_zhao_and_tan(signal: str) -> None:
    u = SIGNALS[signal]
    p1, p2 = triangle(np.linspace(-1, 0.9, 20))
    w = np.random.default_rng(2).normal(size=210)
    assert len(p1) == 210
    y = KrasnoselskiiPokrovskii(n=20, lo=-1.0, hi=1.0, w=w, offset=0.5, u0=-9.0)(u)
    assert np.abs(y - (kernels(u, 0.1, p1, p2) @ w + 0.5)).max() <= 1e-14 * np.abs(w).sum()


@pytest.mark.parametrize("u0", [0.137, -0.6, 0.4, -1.1, 3.0])
def test_kernels_start_as_the_middle_of_their_ramps_at_u0(u0: float) -> None:
    """The first branch of either direction, the branches that it closes, and what follows."""
    rng, lo, hi, n = np.random.default_rng(3), -1.1, 0.9, 8
    a, w = (hi - lo) / n, rng.normal(size=36)
    p1, p2 = triangle(lo + a * np.arange(n))

    def r(x: Array) -> Array:
        return np.interp(x, [0, a], [-1, 1])

    for u in (
        np.linspace(u0, 1.2, 41),
        np.linspace(u0, -1.4, 41),
        1.5 * np.linspace(0, 1, 99) * rng.uniform(-1, 1, 99),
    ):
        k, expected = r(u0 - (p1 + p2) / 2), []
        for x in u:
            k = np.clip(k, r(x - p2), r(x - p1))
            expected.append(w @ k)
        y = KrasnoselskiiPokrovskii(n=n, lo=lo, hi=hi, w=w, u0=u0)(u).ravel()
        assert np.abs(y - expected).max() <= 1e-14 * np.abs(w).sum()


def test_a_kernel_inside_its_ramps_is_a_play() -> None:
    """k = 2/a times a play of half-width (p2 - p1)/2 around (p1 + p2 + a)/2 as long as nothing saturates."""
    u, a = SIGNALS["white"], 8.0
    k = KrasnoselskiiPokrovskii(n=2, lo=-8.0, hi=8.0, w=[0.0, 1.0, 0.0])(7 * u)
    play = PlayBank(r=[a / 2], z0=[0.0])(7 * u)
    assert np.abs(k - 2 / a * play.ravel()).max() <= 1e-15


def test_an_empty_grid_of_kernels_is_refused() -> None:
    with pytest.raises(InputError, match="lo must be less than hi"):
        KrasnoselskiiPokrovskii(lo=1.0, hi=1.0)([0.0])


# ---- Preisach -------------------------------------------------------------------------------------------------------
def relays(u: Array, alpha: Array, beta: Array, w: Array, state: Array) -> Array:
    """Weighted sum of relays: +1 from u >= alpha on, -1 from u <= beta on, else as they were."""
    rows = []
    for x in u:
        state = np.where(x >= alpha, 1.0, np.where(x <= beta, -1.0, state))
        rows.append(w @ state)
    return np.array(rows)


def everett_of_relays(grid: Array, alpha: Array, beta: Array, w: Array) -> Array:
    """E at the nodes below the diagonal: the weight of the relays between beta_j and alpha_i."""
    return np.array([w[(alpha <= grid[i]) & (beta >= grid[j])].sum() for i in range(1, len(grid)) for j in range(i)])


@pytest.mark.parametrize("start", ["demagnetised", "low", "high"])
@pytest.mark.parametrize("n", [1, 2, 7, 12])
def test_preisach_is_a_sum_of_relays(n: int, start: str) -> None:
    """Exact for inputs on the grid.  E halves a cell on alpha + beta = lo + hi: so do relays in mirrored pairs."""
    lo, hi = -1.5, 2.0
    rng, grid = np.random.default_rng(n), np.linspace(lo, hi, n + 1)
    beta, alpha = np.sort(rng.uniform(lo, hi, (400, 2)), axis=1).T
    alpha, beta, w = np.append(alpha, lo + hi - beta), np.append(beta, lo + hi - alpha), rng.normal(size=400)
    w = np.append(w, w)
    state = {"low": -1.0, "high": 1.0, "demagnetised": np.where(alpha + beta < lo + hi, 1.0, -1.0)}[start]
    u = grid[rng.integers(0, n + 1, 300)]
    E = everett_of_relays(grid, alpha, beta, w)
    y = Preisach(n=n, lo=lo, hi=hi, E=E, start=start, offset=0.3)(u)
    assert np.abs(y - relays(u, alpha, beta, w, state * np.ones(800)) - 0.3).max() <= 1e-13 * np.abs(w).sum()


def below_diagonal(n: int) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Nodes (alpha_i, beta_j), i > j, in the order of E."""
    i, j = np.tril_indices(n)
    return i + 1, j


def hats(grid: Array, E: Array) -> Callable[[float, float], float]:
    """The interpolation on triangles as a sum of hat functions max(0, 1 - max(|a|, |b|, |a - b|)) over all nodes."""
    i, j = below_diagonal(len(grid) - 1)
    h = grid[1] - grid[0]

    def at(alpha: float, beta: float) -> float:
        a, b = (alpha - grid[i]) / h, (beta - grid[j]) / h
        return float(E @ np.maximum(0, 1 - np.maximum(np.maximum(np.abs(a), np.abs(b)), np.abs(a - b))))

    return at


@every_signal
@pytest.mark.parametrize("start", ["low", "high"])
def test_preisach_between_the_nodes_is_the_operator_of_the_whole_history(signal: str, start: str) -> None:
    u, lo, hi, n = SIGNALS[signal], -0.8, 1.1, 6  # some inputs are outside
    E = np.random.default_rng(4).normal(size=n * (n + 1) // 2)
    at, top = hats(np.linspace(lo, hi, n + 1), E), E[n * (n - 1) // 2]

    def virgin(x: float) -> float:
        return 2 * at(x, lo) - top if start == "low" else top - 2 * at(hi, x)

    x0 = lo if start == "low" else hi
    expected = with_memory(np.clip(u, lo, hi), x0, virgin, lambda a, b: 2 * at(b, a))
    assert np.abs(Preisach(n=n, lo=lo, hi=hi, E=E, start=start)(u) - expected).max() <= 1e-12


@every_signal
def test_prandtl_ishlinskii_is_a_preisach_operator(signal: str) -> None:
    """E = phi((alpha - beta) / 2), thresholds on half steps of the grid: exact for any input, from rest."""
    u, n = SIGNALS[signal], 16
    grid = np.linspace(-1.2, 1.2, n + 1)
    r = np.arange(n) * (grid[1] - grid[0]) / 2
    w = np.random.default_rng(6).normal(size=n)
    i, j = below_diagonal(n)
    E = 0.4 * (grid[i] - grid[j]) / 2 + np.maximum((grid[i] - grid[j])[:, None] / 2 - r, 0) @ w
    y = Preisach(n=n, lo=-1.2, hi=1.2, E=E)(u)
    assert np.abs(y - PrandtlIshlinskii(w0=0.4, r=r, w=w)(u)).max() <= 1e-13


def asymmetric_preisach(**more: object) -> Block:
    n = 10
    i, j = below_diagonal(n)
    return Preisach(n=n, lo=-1.0, hi=1.0, E=((i - j) / n) ** 1.5 * (1 + i / n), **more)


def test_demagnetised_is_the_limit_of_ever_smaller_loops() -> None:
    amplitude = np.arange(1, 0, -1 / 4000)
    fade = np.ravel(np.column_stack([amplitude, -amplitude]))
    u = SIGNALS["white"]
    y = asymmetric_preisach(start="low", depth=10000)(np.concatenate([fade, u]))[len(fade) :]
    assert np.abs(y - asymmetric_preisach()(u)).max() <= 1e-3


def test_minor_loops_are_wiped_out_and_congruent() -> None:
    """Mayergoyz 1991, ch. 1: properties of a Preisach operator.  Loops of one width differ in height with their place,
    unlike those of a Prandtl-Ishlinskii operator."""
    block = asymmetric_preisach(start="low")
    loop = [0.5, 0.1, 0.35, 0.1, 0.5]
    rising, other = block([-1.0, *loop, 0.8]), block([-1.0, 0.9, 0.1, *loop])[2:]
    assert abs(rising[1] - other[1]) > 0.1  # the same input, another past
    assert np.abs(np.diff(rising[1:6]) - np.diff(other[1:6])).max() <= 1e-14  # congruent
    assert rising[1] == pytest.approx(rising[5], abs=1e-14)  # closed
    assert rising[-1] == pytest.approx(block([-1.0, 0.8])[-1], abs=1e-14)  # the memory is wiped out
    lower = block([-1.0, -0.5, -0.9])
    assert abs((lower[1] - lower[2]) / (rising[1] - rising[2]) - 1) > 0.1


def test_a_range_without_width_is_refused() -> None:
    with pytest.raises(InputError, match="lo must be less than hi"):
        Preisach(lo=1.0, hi=1.0)([0.0])
