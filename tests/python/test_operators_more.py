"""Operators with other memories and lagged polynomials: each against a definition written another way."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from hystfmu.blocks import (
    Block,
    BoucWen,
    ConstraintFactor,
    Differentiator,
    Duhem,
    KrasnoselskiiPokrovskii,
    PlayBank,
    PolynomialNarx,
    PrandtlIshlinskii,
    Preisach,
    ZhaoTan,
    ZhaoTanInverseReconstructed,
)
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
    "growing": 1.03 ** np.arange(80) * np.where(np.arange(80) % 2, 0.1, -0.1),
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
    y = KrasnoselskiiPokrovskii(a=0.1, p1=p1, p2=p2, w=w, offset=0.5, k0=-np.ones(210))(u)
    assert np.abs(y - (kernels(u, 0.1, p1, p2) @ w + 0.5)).max() <= 1e-14 * np.abs(w).sum()


def test_a_kernel_inside_its_ramps_is_a_play() -> None:
    """k = 2/a times a play of half-width (p2 - p1)/2 around (p1 + p2 + a)/2 as long as nothing saturates."""
    u, a, p1, p2 = SIGNALS["white"], 8.0, -4.2, -3.8
    k = KrasnoselskiiPokrovskii(a=a, p1=[p1], p2=[p2], w=[1.0])(u)
    play = PlayBank(r=[(p2 - p1) / 2], z0=[(p1 + p2 + a) / 2])(u)
    assert np.abs(k - 2 / a * (play.ravel() - (p1 + p2 + a) / 2)).max() <= 1e-15


def test_kernels_that_fall_right_of_where_they_rise_are_refused() -> None:
    with pytest.raises(InputError, match="p1 must not be greater than p2"):
        KrasnoselskiiPokrovskii(p1=[0.0, 0.2], p2=[0.1, 0.1], w=[1.0, 1.0])([0.0])


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
    """Mayergoyz 1991, ch. 1: what makes a Preisach operator.  Here loops of one width differ in height from place to
    place, which those of a Prandtl-Ishlinskii operator do not."""
    block = asymmetric_preisach(start="low")
    loop = [0.5, 0.1, 0.35, 0.1, 0.5]
    rising, other = block([-1.0, *loop, 0.8]), block([-1.0, 0.9, 0.1, *loop])[2:]
    assert abs(rising[1] - other[1]) > 0.1  # the same input, another past
    assert np.abs(np.diff(rising[1:6]) - np.diff(other[1:6])).max() <= 1e-14  # congruent
    assert rising[1] == pytest.approx(rising[5], abs=1e-14)  # closed
    assert rising[-1] == pytest.approx(block([-1.0, 0.8])[-1], abs=1e-14)  # nothing is left of it
    lower = block([-1.0, -0.5, -0.9])
    assert abs((lower[1] - lower[2]) / (rising[1] - rising[2]) - 1) > 0.1


def test_a_range_without_width_is_refused() -> None:
    with pytest.raises(InputError, match="lo must be less than hi"):
        Preisach(lo=1.0, hi=1.0)([0.0])


# ---- Duhem ----------------------------------------------------------------------------------------------------------
def as_duhem(n: int, beta: float, gamma: float) -> dict[str, object]:
    """Bouc-Wen of whole n with A = 1: the two kinds of power change places between odd and even n."""
    rows: dict[str, object] = {"m": 0, "q": n, "a_rise": [1.0], "a_fall": [1.0]}
    for end, s in (("rise", 1), ("fall", -1)):
        signed, plain = np.zeros(n), np.zeros(n)
        (signed if n % 2 else plain)[-1] = -s * beta
        (plain if n % 2 else signed)[-1] = -gamma
        rows |= {f"b_{end}": signed, f"c_{end}": plain}
    return rows


@every_signal
@pytest.mark.parametrize(("n", "tolerance"), [(1, 1e-9), (2, 5e-9), (3, 2e-8)])
@pytest.mark.parametrize(("beta", "gamma"), [(0.5, 0.5), (1.0, -0.6), (0.2, 0.9)])
def test_bouc_wen_is_a_duhem_operator(signal: str, n: int, tolerance: float, beta: float, gamma: float) -> None:
    """Against the block bouc_wen: exact for n = 1, another integrator for n > 1."""
    u = 2 * SIGNALS[signal]
    values = as_duhem(n, beta, gamma)
    expected = BoucWen(beta=beta, gamma=gamma, n=float(n), alpha=0.25, k=4.0, z0=0.1)(u)[:, 0]
    y = Duhem(k=1 / 3, **values, w0=0.1, du_max=0.01)(u)
    assert np.abs(3 * y - expected).max() <= tolerance * 3


POLYNOMIALS = {
    "a_rise": [1.0, 0.2, -0.1],
    "a_fall": [0.8, -0.1, 0.0],
    "b_rise": [-0.5, 0.1, -0.2, 0.05, 0.1, 0.0],
    "b_fall": [0.4, -0.1, 0.1, 0.05, 0.0, -0.1],
    "c_rise": [-0.3, 0.0, 0.1, 0.1, 0.0, 0.0],
    "c_fall": [-0.4, 0.1, 0.0, 0.0, 0.1, 0.0],
}


def duhem_by_scipy(u: Array, w0: float) -> Array:
    """Every monotone piece by DOP853, cut where w = 0, with the powers as numpy writes them."""
    rows = [w0]
    for end, last, now in zip(np.where(np.diff(u) > 0, "rise", "fall"), u[:-1], u[1:], strict=True):
        a, b, c = (np.array(POLYNOMIALS[f"{k}_{end}"]).reshape(3, -1) for k in "abc")

        def slope(at: float, w: Array, a: Array = a, b: Array = b, c: Array = c) -> Array:
            of_w = a[:, 0] + b @ np.array([w[0], w[0] ** 2]) + c @ np.array([abs(w[0]), abs(w[0]) * w[0]])
            return np.array([of_w @ np.array([1, at, at**2])])

        def zero(_: float, w: Array) -> float:
            return float(w[0])

        zero.terminal = True  # type: ignore[attr-defined]
        w, at = rows[-1], last
        while at != now:
            done = solve_ivp(slope, (at, now), [w], "DOP853", rtol=1e-13, atol=1e-15, events=zero if w else None)
            at, w = (done.t[-1], done.y[0, -1]) if done.status == 0 else (done.t_events[0][0], 0.0)
        rows.append(w)
    return np.array(rows)


def test_duhem_is_its_differential_equation_to_order_4() -> None:
    u = 1.5 * SIGNALS["white"][:60]
    expected = 0.3 * u + duhem_by_scipy(u, 0.2)
    error = [
        np.abs(Duhem(m=2, q=2, k=0.3, w0=0.2, du_max=d, **POLYNOMIALS)(u) - expected).max() for d in (0.2, 0.1, 0.01)
    ]
    assert error[1] <= error[0] / 11
    assert error[2] <= 1e-9


@pytest.mark.parametrize(("n", "share"), [(1.0, 1e-6), (1.5, 1e-4), (2.3, 1e-4)])
def test_duhem_fitted_to_bouc_wen(n: float, share: float) -> None:
    """Slopes by differences, coefficients by linear least squares; RMS of a free run on other reversals / span."""

    def z(u: Array) -> Array:
        return BoucWen(beta=0.6, gamma=0.3, n=n, alpha=0.0)(u)[:, 1]

    def ramps(seed: int, step: float) -> Array:
        levels = np.random.default_rng(seed).uniform(-2, 2, 80)
        return np.concatenate([np.arange(a, b, step if b > a else -step) for a, b in itertools.pairwise(levels)])

    u, q = ramps(1, 1e-3), 5
    w, du = z(u), np.diff(u)
    middle = (w[1:] + w[:-1]) / 2
    powers = np.arange(1, q + 1)
    basis = np.column_stack(
        [np.ones_like(middle), middle[:, None] ** powers, np.abs(middle)[:, None] * middle[:, None] ** (powers - 1)]
    )
    values: dict[str, object] = {}
    for end, s in (("rise", 1), ("fall", -1)):
        rows = (s * du > 5e-4) & (w[1:] * w[:-1] > 0)
        theta = np.linalg.lstsq(basis[rows], np.diff(w)[rows] / du[rows], rcond=None)[0]
        values |= {f"a_{end}": theta[:1], f"b_{end}": theta[1 : q + 1], f"c_{end}": theta[q + 1 :]}
    test = ramps(2, 1e-2)
    free = Duhem(m=0, q=q, k=0.0, w0=0.0, **values)(test)
    assert np.sqrt(np.mean((free - z(test)) ** 2)) <= share * np.ptp(z(test))


def test_duhem_stays_within_its_bound() -> None:
    y = Duhem(k=0.0, a_rise=1.0, b_rise=5.0, c_rise=0.0, w_max=3.0)([0.0, 100.0, 1e300, -1e300, 1e6])
    assert np.abs(y).max() <= 3.0
    with pytest.raises(InputError, match="w0 must be within w_max"):
        Duhem(w0=2.0, w_max=1.0)([0.0])


# ---- polynomial network of lags -------------------------------------------------------------------------------------
def polynomial_narx(u: Array, f: Array, theta: Array, lags: tuple[int, int, int], q: int, n_k: int, y0: float) -> Array:
    """The definition over dictionaries of monomials, one product at a time."""
    n_u, n_f, n_y = lags
    p = sum(lags)
    products = [c for degree in range(1, q + 1) for c in itertools.combinations_with_replacement(range(p), degree)]
    assert len(theta) == len(products) + 1
    y: list[float] = []
    for k in range(len(u)):
        z = [u[max(k - n_k - i, 0)] for i in range(n_u)] + [f[max(k - n_k - i, 0)] for i in range(n_f)]
        z += [y[k - i] if k >= i else y0 for i in range(1, n_y + 1)]
        y.append(theta[-1] + sum(t * np.prod([z[i] for i in c]) for t, c in zip(theta[:-1], products, strict=True)))
    return np.array(y)


@pytest.mark.parametrize("n_k", [0, 1])
@pytest.mark.parametrize("q", [1, 2, 3, 5])
@pytest.mark.parametrize("lags", [(1, 0, 0), (3, 2, 0), (2, 2, 2), (1, 0, 4)])
def test_polynomial_narx_is_its_definition(lags: tuple[int, int, int], q: int, n_k: int) -> None:
    rng = np.random.default_rng(q)
    theta = rng.normal(size=math.comb(sum(lags) + q, q)) / math.comb(sum(lags) + q, q)
    u, f = rng.uniform(-1, 1, (2, 50))
    block = PolynomialNarx(n_u=lags[0], n_f=lags[1], n_y=lags[2], q=q, n_k=n_k, theta=theta, y0=0.3)
    expected = polynomial_narx(u, f, theta, lags, q, n_k, 0.3)
    assert np.abs(block(np.column_stack([u, f])) - expected).max() <= 4e-15 * max(1, np.abs(expected).max())


@pytest.mark.parametrize(("n", "weights"), [(7, 120), (8, 153), (9, 190), (10, 231)])
def test_number_of_weights_of_the_structures_of_the_ipmc_paper(n: int, weights: int) -> None:
    """n_u = n_f = 7 .. 10, n_y = 0, q = 2: (p + q)! / (p! q!), the constant included."""
    sizes = PolynomialNarx(n_u=n, n_f=n, n_y=0, q=2).node.sizes
    assert sizes["theta"] == weights


def test_a_polynomial_network_that_no_graph_holds_is_refused() -> None:
    with pytest.raises(InputError, match="too many values"):
        PolynomialNarx(n_u=1000, n_f=1000, n_y=1000, q=10)


def test_polynomial_narx_lets_its_input_through_at_once_only_if_told() -> None:
    u = np.zeros((5, 2))
    u[2] = 1.0
    theta = [1.0, 2.0, 0.0]
    block = {"n_u": 1, "n_f": 1, "n_y": 0, "q": 1, "theta": theta}
    assert PolynomialNarx(**block, n_k=0)(u).tolist() == [0, 0, 3, 0, 0]
    assert PolynomialNarx(**block)(u).tolist() == [0, 0, 0, 3, 0]


# ---- derivative -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("tau", [0.0, 1e-3, 0.3])
def test_differentiator_is_a_recursive_filter(tau: float) -> None:
    """du = (1 - 1/q) / ((tau + h) - tau/q) u by scipy.signal, from rest at the first value."""
    h, u = 0.01, SIGNALS["white"]
    expected = lfilter([1, -1], [tau + h, -tau], u - u[0])
    assert np.abs(Differentiator(tau=tau)(u, h=h) - expected).max() <= 1e-13 * np.abs(expected).max()


def test_differentiator_converges_to_the_filtered_derivative() -> None:
    """u = sin(omega t): (omega cos - ..) / (tau s + 1) in steady state, error of order h."""
    tau, omega, errors = 0.05, 9.0, []
    for h in (1e-3, 5e-4):
        t = np.arange(round(2 / h)) * h
        du = Differentiator(tau=tau)(np.sin(omega * t), h=h)
        expected = (1j * omega / (1 + 1j * omega * tau) * np.exp(1j * omega * t)).imag
        errors.append(np.abs(du - expected)[t > 1].max() / omega)
    assert errors[0] <= 0.01
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.05)
