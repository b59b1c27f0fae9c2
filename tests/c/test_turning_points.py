"""The turning-point machine against definitions without a stack: plain plays, memory from the whole history."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from plants import plays
from whole_history import of_distance

from hystfmu.base.errors import InputError
from hystfmu.data.signals import nested_reversals
from hystfmu.graph.blocks import PrandtlIshlinskii, PrandtlIshlinskiiInverse, ZhaoTan, ZhaoTanInverse

Array = NDArray[np.float64]


# ---- the independent side -------------------------------------------------------------------------------------------
def zhao_tan_branch(d: Array) -> Array:
    return -np.expm1(-d) * d


# ---- inputs ---------------------------------------------------------------------------------------------------------
RNG = np.random.default_rng(7)
SIGNALS: dict[str, Array] = {
    "white": RNG.uniform(-1, 1, 300), "reversals": nested_reversals(40, 3, 0.1),
    "nested": 0.97 ** np.arange(120) * np.where(np.arange(120) % 2, 1.0, -1.0),
    "growing": 1.03 ** np.arange(120) * np.where(np.arange(120) % 2, 0.1, -0.1),
    "plateaus": np.repeat(RNG.uniform(-1, 1, 80), 3), "closes_on_extrema": RNG.integers(-4, 5, 300) / 4.0,
    "one_sided": RNG.uniform(2, 3, 200), "monotone": np.linspace(-1, 2, 50), "constant": np.full(20, 0.3),
}  # fmt: skip
every_signal = pytest.mark.parametrize("signal", SIGNALS)


@every_signal
@pytest.mark.parametrize("x0", [0.0, 0.4, -2.0])
def test_zhao_tan_is_the_operator_of_the_whole_history(signal: str, x0: float) -> None:
    u = SIGNALS[signal]
    h = of_distance(u, x0, 0.0, zhao_tan_branch)
    assert np.abs(ZhaoTan(x0=x0)(u) - h).max() <= 2e-14 * max(1.0, np.abs(h).max())


THRESHOLDS: dict[str, Array] = {
    "even": np.arange(20) / 20,
    "random": np.sort(RNG.uniform(0, 1, 30)),
    "clustered": np.sort(np.concatenate([RNG.uniform(0, 1e-6, 20), [0.5, 0.9]])),
    "equal": np.repeat([0.0, 0.1, 0.25, 0.5], 3),
    "one": np.array([0.25]),
    "all_zero": np.zeros(4),
    "out_of_reach": np.array([0.1, 50.0]),
}


@every_signal
@pytest.mark.parametrize("thresholds", THRESHOLDS)
@pytest.mark.parametrize("u0", [0.0, 0.5])
def test_stack_is_the_sum_of_plays(signal: str, thresholds: str, u0: float) -> None:
    u, r = SIGNALS[signal], THRESHOLDS[thresholds]
    w = np.random.default_rng(11).normal(size=len(r))
    expected = 0.3 * u + plays(u, r, u0) @ w
    y = PrandtlIshlinskii(w0=0.3, r=r, w=w, u0=u0)(u)
    scale = 0.3 * np.abs(u).max() + np.abs(w).sum() * max(np.abs(u).max(), u0)
    assert np.abs(y - expected).max() <= 4e-15 * scale


@pytest.mark.some(0.5)
@pytest.mark.parametrize("signed", [True, pytest.param(False, marks=pytest.mark.stress)])
def test_four_hundred_thousand_random_steps(signed: bool) -> None:
    """S5: <= 2e-14 of max|y| against the plain loop; the memory forgets nothing and drifts nowhere."""
    rng = np.random.default_rng(5)
    r = np.sort(rng.uniform(0, 1, 50))
    w = rng.normal(size=50) if signed else rng.uniform(0, 1, 50)
    u = np.concatenate([rng.uniform(-1, 1, 200_000), nested_reversals(20_000, 9, 0.05)])[:400_000]
    assert len(u) == 400_000
    y = PrandtlIshlinskii(w0=0.1, r=r, w=w)(u)
    z, expected = np.zeros(50), np.empty(len(u))
    for k, x in enumerate(u):
        np.maximum(x - r, z, out=z)
        np.minimum(x + r, z, out=z)
        expected[k] = 0.1 * x + w @ z
    assert np.abs(y - expected).max() <= 2e-14 * np.abs(expected).max()


def test_weights_that_cancel_are_summed_without_loss() -> None:
    """With r = 0 every play is the input: 1e16 + 1 - 1e16 = 1."""
    u = SIGNALS["white"]
    assert np.array_equal(PrandtlIshlinskii(r=[0.0, 0.0, 0.0], w=[1e16, 1.0, -1e16])(u), u)


def test_zhao_tan_is_a_prandtl_ishlinskii_operator() -> None:
    """phi(q) = g(2q)/2 has the second derivative 4 e^(-2q) (1 - q): the density of its plays."""
    n, most = 100_000, 12.0
    r = (np.arange(n) + 0.5) * (most / n)
    w = 4 * np.exp(-2 * r) * (1 - r) * (most / n)
    u = 2 * SIGNALS["white"]
    assert np.abs(PrandtlIshlinskii(r=r, w=w)(u) - ZhaoTan()(u)).max() <= 8.5e-8


# ---- inverses in cascade (S6) ---------------------------------------------------------------------------------------
@every_signal
@pytest.mark.parametrize("x0", [0.0, 0.4])
def test_zhao_tan_after_its_inverse_is_identity(signal: str, x0: float) -> None:
    h = SIGNALS[signal]
    assert np.abs(ZhaoTan(x0=x0)(ZhaoTanInverse(x0=x0)(h)) - h).max() <= 2e-14


@every_signal
@pytest.mark.parametrize("thresholds", THRESHOLDS)
@pytest.mark.parametrize("u0", [0.0, 0.5])
def test_plays_after_the_inverse_are_identity(signal: str, thresholds: str, u0: float) -> None:
    y, r = SIGNALS[signal], THRESHOLDS[thresholds]
    rng = np.random.default_rng(2)
    slopes = rng.uniform(0.3, 1.5, len(r) + 1)  # of the loading curve: weights of both signs
    values = {"w0": slopes[0], "r": r, "w": np.diff(slopes), "u0": u0}
    u = PrandtlIshlinskiiInverse(**values)(y)
    assert np.abs(slopes[0] * u + plays(u, r, u0) @ np.diff(slopes) - y).max() <= 1e-14
    assert np.abs(PrandtlIshlinskii(**values)(u) - y).max() <= 1e-14


def test_zhao_tan_inverse_over_all_magnitudes() -> None:
    """g(g^-1(v)) = v to the last bits from the series at 0 to the asymptote."""
    v = np.logspace(-300, 3, 3000)
    x = ZhaoTanInverse()(v / 2)  # virgin branch: x = g^-1(2 h) / 2
    assert np.abs(zhao_tan_branch(2 * x) / v - 1).max() <= 2e-15


# ---- return-point memory as a property ------------------------------------------------------------------------------
level = st.integers(-8, 8).map(lambda i: i / 8)


@settings(max_examples=200, deadline=None)
@given(st.lists(level, min_size=1, max_size=12), level, level, st.lists(level, max_size=6))
def test_a_closed_inner_loop_leaves_no_trace(before: list[float], a: float, b: float, after: list[float]) -> None:
    """Madelung: from x to b and back to x, within the branch that x lies on, nothing is remembered."""
    u0, x = before[-1], a
    lo, hi = min(u0, x), max(u0, x)
    if not lo <= b <= hi:
        return
    plain = np.array([*before, x, *after])
    loop = np.array([*before, x, b, x, *after])
    for block in (ZhaoTan(), PrandtlIshlinskii(w0=0.2, r=[0.1, 0.3, 0.6], w=[1.0, -0.5, 2.0])):
        straight, with_loop = block(plain), block(loop)
        assert np.abs(straight[len(before) :] - with_loop[len(before) + 2 :]).max() <= 4e-15


@settings(max_examples=100, deadline=None)
@given(st.lists(level, min_size=1, max_size=20), st.lists(st.integers(0, 3), min_size=20, max_size=20))
def test_plateaus_and_finer_sampling_change_nothing(levels: list[float], more: list[int]) -> None:
    dense = [levels[0]]
    marks = [0]
    for a, b, m in zip(levels, levels[1:], more, strict=False):
        dense += [a] * m + list(np.linspace(a, b, m + 2)[1:-1]) + [b]
        marks.append(len(dense) - 1)
    coarse, fine = ZhaoTan()(np.array(levels)), ZhaoTan()(np.array(dense))[marks]
    assert np.abs(coarse - fine).max() <= 4e-15


# ---- the cap of the memory ------------------------------------------------------------------------------------------
def extrema_stored(block: ZhaoTan, u: Array) -> int:
    executor = block.graph.executor()
    executor.run(u[:, None], 1, 1.0)
    return int(executor.state[1])  # after the step: the memory begins with its count


def test_memory_holds_every_nested_extremum_until_it_is_full() -> None:
    u = SIGNALS["nested"]
    assert extrema_stored(ZhaoTan(depth=200), u) == len(u) - 1
    for depth in (4, 5, 16):
        assert extrema_stored(ZhaoTan(depth=depth), u) in (depth - 1, depth)


def test_memory_does_not_grow_on_loops_that_close_exactly_or_on_plateaus() -> None:
    cycles = np.tile([1.0, 0.5, -0.5, -1.0, -0.5, 0.5], 50)
    inner = np.concatenate([[1.0], np.tile([-0.25, 0.25], 50)])
    assert extrema_stored(ZhaoTan(), cycles) <= 1
    assert extrema_stored(ZhaoTan(), inner) <= 3
    assert extrema_stored(ZhaoTan(), np.repeat(SIGNALS["nested"][:30], 3)) == 29


@pytest.mark.parametrize("depth", [4, 5, 16])
def test_a_full_memory_loses_no_more_than_the_loop_it_forgets(depth: int) -> None:
    """Down the nested loops the output is exact; on the way out it is off by at most the swing of the forgotten loop;
    outside the outermost loops that were kept it is exact again."""
    inwards = SIGNALS["nested"]
    outwards = np.linspace(inwards[-1], inwards[0] * np.sign(inwards[-1] * inwards[0]) * 1.2, 400)
    u = np.concatenate([np.interp(np.arange(4 * 119 + 1) / 4, np.arange(120), inwards), outwards])
    full, capped = ZhaoTan(depth=500)(u), ZhaoTan(depth=depth)(u)
    n = len(u) - 400
    assert np.array_equal(full[:n], capped[:n])
    error = np.abs(full - capped)
    forgotten = zhao_tan_branch(np.abs(inwards[depth - 2] - inwards[depth - 1]))  # the widest loop that had to go
    assert 0 < error.max() <= forgotten
    assert (error[np.abs(u) > np.abs(inwards[0])] == 0).all()


def test_too_small_a_memory_is_refused() -> None:
    with pytest.raises(InputError, match=r"The 'depth' size of zhao_tan must be an int in \[4, 100000\]. Got 3 "):
        ZhaoTan(depth=3)


# ---- why the dominant extremum --------------------------------------------------------------------------------------
def test_the_last_extremum_drifts_under_noise() -> None:
    """20 cycles of a unit sine with 0.5 % noise: the last-extremum form drifts, the dominant one does not."""
    n = 200
    u = np.sin(2 * np.pi * np.arange(20 * n) / n)
    noisy = u + 5e-3 * np.random.default_rng(0).standard_normal(u.size)
    off = {m: np.abs(ZhaoTan(memory=m)(noisy) - ZhaoTan(memory=m)(u)).max() for m in ("dominant", "last")}
    assert off["dominant"] <= 0.03
    assert off["last"] >= 0.2


def test_the_last_extremum_is_unbounded() -> None:
    """2000 random reversals within +-1: g(2) = 1.73 bounds the operator; the last-extremum form exceeds it."""
    u = nested_reversals(2000, 0)
    assert np.ptp(ZhaoTan()(u)) <= zhao_tan_branch(np.float64(2.0)) + 1e-14
    assert np.ptp(ZhaoTan(memory="last")(u)) >= 3.0


def test_last_is_the_literal_recursion() -> None:
    """h = h_p + sgn (1 - e^-d) d from the last reversal, Zhao & Tan 2008, eq. 1, as a plain loop."""
    u = SIGNALS["plateaus"]
    x_p, h_p, x, h, direction, expected = 0.1, 0.0, 0.1, 0.0, 0.0, []
    for v in u:
        if v != x:
            if direction * (v - x) < 0:
                x_p, h_p = x, h
            direction = np.sign(v - x)
            h = h_p + np.sign(v - x_p) * zhao_tan_branch(abs(v - x_p))
            x = v
        expected.append(h)
    assert np.abs(ZhaoTan(memory="last", x0=0.1)(u) - expected).max() <= 1e-14 * np.abs(expected).max()
