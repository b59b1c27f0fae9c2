"""Columns and operators of the fits against their definitions, in numpy."""

import numpy as np
import pytest
from numpy.polynomial import legendre

from hystfmu.graph.recursion import lag, parallel_lags
from hystfmu.identify.features import bent_sum, smooth_density
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.features.straightened import straightened
from hystfmu.identify.methods import constraint_factor_mlp as constraint_factor
from hystfmu.identify.methods import preisach
from hystfmu.identify.solvers import trust_region

RNG = np.random.default_rng(11)
PATH = np.concatenate([np.cumsum(RNG.normal(size=90)) / 4, [0.3, 0.3, -4.0, 5.0, 5.0, 1.0]])  # with plateaus


def test_knots_lie_evenly_inside_the_range_and_not_at_zero():
    u = np.array([-1.0, 0.5, 3.0])
    assert preisach.knots(u, 3) == pytest.approx([4e-6, 1.0, 2.0], rel=1e-12)
    assert preisach.knots(u + 2, 3) == pytest.approx([2.0, 3.0, 4.0], rel=1e-12)
    assert preisach.knots(np.array([-2.0, 2.0]), 4) == pytest.approx([-1.2, -0.4, 0.4, 1.2], rel=1e-12)


@pytest.mark.parametrize("h", [0.01, 0.4])
def test_a_lag_approaches_its_held_input(h):
    q, expected = PATH[0], []
    for x in PATH:
        q += -np.expm1(-h / 0.3) * (x - q)
        expected.append(q)
    assert lag(h, 0.3).run(PATH[:, None])[:, 0] == pytest.approx(expected, abs=1e-12)


def test_plays_and_their_thresholds():
    u = np.array([-1.0, 3.0, 0.0])
    assert thresholds(u, 4) == pytest.approx(0.98 * 2 * np.arange(1, 5) / 4)
    z, r = np.full(3, PATH[0] + 0.1), np.array([0.2, 0.5, 2.0])
    for x, row in zip(PATH, plays(PATH, r, PATH[0] + 0.1), strict=True):
        z = np.clip(z, x - r, x + r)
        assert row == pytest.approx(z, abs=1e-15)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_bent_output_is_straightened_by_legendre_polynomials(sign):
    x, c = np.linspace(0, 1, 30), np.column_stack([np.linspace(3, 9, 30) ** 2])
    y = sign * (5 + 4 * x**2)
    v, free = straightened(x, y, 3, c)
    assert v == pytest.approx(2 * x**2 - 1, abs=1e-12)
    P = legendre.legvander(v, 3)
    assert free[:, :3] == pytest.approx(P[:, [0, 2, 3]])
    assert free[:, 3:] == pytest.approx(P * ((2 * c - 81 - 9) / (81 - 9)))
    assert straightened(x, y, 3, c[:, :0])[1] == pytest.approx(P[:, [0, 2, 3]])


# ---- constraint factor ----------------------------------------------------------------------------------------------
def b(d, m):
    return np.column_stack([-np.expm1(-d), *(-np.expm1(-d) * d ** (2 * j - 1) for j in range(1, m + 1))])


def test_the_basis_of_the_branch_and_its_derivatives():
    d = np.array([0.0, 0.3, 1.0, 2.5])
    assert constraint_factor.basis(d, 3) == pytest.approx(b(d, 3), abs=1e-14)
    h = 1e-5
    d = d[1:]
    slopes = (b(d + h, 3) - b(d - h, 3)) / (2 * h)
    assert constraint_factor.basis_derivatives(d, 3) == pytest.approx(slopes, rel=1e-8)
    beyond = constraint_factor.basis(np.array([1.0, 4.0]), 3, 2.5)  # linear beyond the longest branch
    assert beyond[0] == pytest.approx(b(np.array([1.0]), 3)[0])
    assert beyond[1] == pytest.approx(b(np.array([2.5]), 3)[0] + 1.5 * slopes[-1], rel=1e-8)


def test_a_branch_knows_where_it_falls():
    rising = constraint_factor.Branch(np.array([1.0, 0.5]), 4.0, 1.0)
    d = np.linspace(0.1, 4, 7)
    assert rising(d) == pytest.approx((1 - np.exp(-d)) * (1 + 0.5 * d))
    assert rising.slope(d) == pytest.approx(np.exp(-d) * (1 + 0.5 * d) + 0.5 * (1 - np.exp(-d)))
    assert rising.falling == 0
    # slope e^-d (2 - d) - 1 + ... of (1 - e^-d)(1 - d): the zero by bisection
    bent = constraint_factor.Branch(np.array([1.0, -1.0]), 2.0, 1.0)
    lo, hi = 0.0, 2.0
    for _ in range(50):
        mid = (lo + hi) / 2
        lo, hi = (mid, hi) if np.exp(-mid) * (1 - mid) - (1 - np.exp(-mid)) > 0 else (lo, mid)
    assert bent.falling == pytest.approx(1 - lo / 2, abs=1e-3)


@pytest.mark.parametrize("literal", [False, True])
def test_a_branch_of_the_basis_is_found_again(literal):
    x = 1.5 * np.sin(np.linspace(0, 40, 600)) * np.linspace(1, 0.1, 600)
    where = constraint_factor.stack_coordinates(x, 0.0)
    a = np.array([0.8, 0.5, 0.02])
    rows, free = slice(50, 600), np.ones((550, 1))
    y = where.columns(2, np.inf) @ a + 3.0
    if literal:
        found = constraint_factor.literal_branch(where, y, rows, 2)
    else:
        found = constraint_factor.increasing_branch(where, y[rows], free, rows, 2, 0.0)
    assert found.d_max == where.d[rows].max()
    assert found.a == pytest.approx(a, rel=1e-5)
    assert found.falling == 0
    if not literal:
        H = where.columns(2, found.d_max)[rows]
        H = H - H.mean(axis=0)
        assert found.condition == pytest.approx(np.linalg.cond(H / np.linalg.norm(H, axis=0)), rel=1e-6)


def test_a_falling_branch_is_kept_just_increasing():
    x = 2 * np.sin(np.linspace(0, 40, 500)) * np.linspace(1, 0.1, 500)
    where = constraint_factor.stack_coordinates(x, 0.0)
    y = where.columns(2, np.inf) @ np.array([2.0, -0.6, 0.0])
    found = constraint_factor.increasing_branch(where, y, np.ones((500, 1)), slice(None), 2, 0.0)
    least = 1e-3 * np.ptp(y) / found.d_max
    slopes = found.slope(np.linspace(0, found.d_max, 4001))
    assert slopes.min() > 0
    assert slopes.min() == pytest.approx(least, rel=0.2)
    smooth = constraint_factor.increasing_branch(where, y, np.ones((500, 1)), slice(None), 2, 10.0)

    def rough(a):
        return np.abs(np.diff(a.slope(np.linspace(0, a.d_max, 100)), 2)).max()

    assert rough(smooth) < 0.2 * rough(found)


# ---- bent sum -------------------------------------------------------------------------------------------------------
def bent(q, g=(), c=()):
    return bent_sum.BentSum(np.ones(1), np.array(q), np.zeros(0), 0.0, np.array(g), np.array(c, float, ndmin=2))


@pytest.mark.parametrize(("s", "monotone"), [
    (bent([3.0]), False),  # a constant
    (bent([3.0, 1.0]), True),
    (bent([3.0, -1.0]), True),
    (bent([0.0, 1.0, 0.3]), True),  # slope 1 + 0.9 v
    (bent([0.0, 1.0, 0.34]), False),  # slope 1 + 1.02 v
    (bent([0.0, -1.0, 0.3]), True),
    (bent([0.0, 1.0, 0.33]), False),  # slope 0.01 at -1: below 2 % of the mean
    (bent([0.0, 1.0, 0.32]), True),  # slope 0.04
    (bent([0.0, 1.0], [0.9], [[0.0]]), True),
    (bent([0.0, 1.0], [0.5, -0.6], [[0.0], [0.0]]), False),  # gains may reverse it
    (bent([0.0, 1.0], [0.0], [[0.0, 0.9]]), True),
    (bent([0.0, 1.0], [0.0], [[0.0, -1.1]]), False),
    (bent([0.0, 1.0], [0.0, 0.0], [[0.0, 0.5], [0.0, 0.6]]), False),
    (bent([0.0, -1.0], [0.3], [[0.0, 0.6]]), True),
])  # fmt: skip
def test_a_bend_rises_or_falls_everywhere(s, monotone):
    assert s.monotone is monotone


def made(after=None, T=()):
    """A problem whose output is 0.3 + v + 0.2 P_2(v), v = 0.7 x + 0.3 play, crept, after some dynamics."""
    u = np.sin(np.linspace(0, 25, 400)) * np.linspace(1, 0.2, 400)
    columns = np.column_stack([u, plays(u, np.array([0.3, 0.6]), 0.0)])
    w = np.array([0.7, 0.3, 0.0])
    v = columns @ w
    w, v = w / np.abs(v).max(), v / np.abs(v).max()
    p = bent_sum.Problem(columns, np.zeros(300), np.arange(100, 400), 0.01, np.array(T), after)
    out = 0.3 + v + 0.2 * (1.5 * v**2 - 0.5)
    for k, t in zip((0.4, 0.0), T, strict=False):
        out = out + k * lag(0.01, t).run(out[:, None])[:, 0]
    y = out[100:] if after is None else after(out[:, None], p.rows)[:, 0]
    return bent_sum.Problem(columns, y, p.rows, 0.01, np.array(T), after), w


def delayed(x, rows):
    return parallel_lags(np.array([0.3]), np.ones(1), 0.0).run(x, rows)


@pytest.mark.parametrize("after", [None, delayed], ids=["static", "dynamics"])
@pytest.mark.parametrize("T", [(), (0.1, 1.0)], ids=["", "creep"])
def test_the_weights_behind_a_bend_are_found_again(after, T):
    p, w = made(after, T)
    start = bent_sum.fit_linear(p, 2)
    assert (start.w >= 0).all()
    assert start.k.tolist() == [0.0] * len(T)
    s = bent_sum.fit(p, start)
    assert s.rms < 1e-3 * start.rms
    assert s.w == pytest.approx(w, abs=2e-3)
    assert s.q == pytest.approx([0.3, 1.0, 0.2], abs=5e-3)
    assert s.k == pytest.approx([0.4, 0.0][: len(T)], abs=2e-2)
    assert np.sqrt(np.mean((bent_sum.model(p, s) - p.y) ** 2)) == pytest.approx(s.rms, rel=1e-6, abs=1e-12)
    assert np.abs(p.columns @ s.w).max() == pytest.approx(1.0)
    columns, fit = bent_sum.behind(p, s)
    weights, _ = fit(p.seen(columns), p.y)
    assert np.sqrt(np.mean((p.seen(columns) @ weights - p.y) ** 2)) <= 1.01 * s.rms + 1e-12


# ---- density, standard errors ---------------------------------------------------------------------------------------
def test_cells_count_for_the_nodes_whose_triangle_holds_them():
    n = 4
    T = smooth_density.triangles(n)
    nodes = [(i, j) for i in range(1, n + 1) for j in range(i)]
    cells = [(k, j) for k in range(n) for j in range(k + 1)]
    assert T.tolist() == [[float(k + 1 <= i and j >= low) for k, j in cells] for i, low in nodes]


def test_splines_are_a_partition_of_one_and_constant_outside():
    x = np.linspace(-1.5, 1.5, 31)
    for n in (1, 2, 3, 6):
        B = smooth_density.splines(x, n)
        assert B.shape == (31, n)
        assert (B >= 0).all()
        assert B.sum(axis=1) == pytest.approx(np.ones(31))
        assert B[0].tolist() == [1.0] + [0.0] * (n - 1)
        assert B[-1].tolist() == [0.0] * (n - 1) + [1.0]
    v = np.clip(x, -1, 1)
    assert smooth_density.splines(x, 3)[:, 1] == pytest.approx((1 - v**2) / 2)


def test_the_density_is_hats_times_splines_on_the_relays():
    u = np.array([1.0, 5.0, 2.0])
    n, widths, means = 12, 3, 2
    s = smooth_density.smooth_density(u, n, widths, means, "demagnetised")
    assert (s.lo, s.hi) == pytest.approx((1 - 0.4, 5 + 0.4))
    step, reversible = 4.8 / 12, means + 3
    for k, (up, down) in enumerate((i, j) for i in range(n) for j in range(i + 1)):
        m, d = s.lo + (up + down + 1) * step / 2 - 3.0, (up - down) * step / 2
        expected = np.zeros(reversible + widths * means)
        if up == down:
            expected[:reversible] = smooth_density.splines(np.array([m / 2]), reversible)[0]
        else:
            hats = np.maximum(0, 1 - np.abs(2 * min(d / 2, 1.0) - np.arange(3)))
            inner = smooth_density.splines(np.array([m / max(2 - d, step / 2)]), means)[0]
            expected[reversible:] = np.outer(hats, inner).ravel()
        assert np.linalg.solve(smooth_density.triangles(n), s.E)[k] == pytest.approx(expected, abs=1e-10)
    x = np.arange(reversible + widths * means) ** 2.0
    grid = x[reversible:].reshape(widths, means)
    assert s.along_mean @ x == pytest.approx(np.r_[np.diff(x[:reversible]), np.diff(grid, axis=1).ravel()])
    assert s.along_width @ x == pytest.approx(np.diff(grid, 2, axis=0).ravel())
    assert s.columns(u).shape == (3, len(x))


def test_standard_errors_of_a_straight_line():
    rng = np.random.default_rng(0)
    t = np.linspace(0, 1, 4000)
    J = np.column_stack([np.ones_like(t), t, np.exp(t)])
    e = 0.1 * rng.normal(size=4000)
    free = np.array([True, True, False])
    covariance = np.linalg.inv(J[:, :2].T @ J[:, :2])
    T = trust_region.correlation_time(e)
    assert 1 <= T < 1.3
    expected = np.sqrt(np.diag(covariance) * (e @ e) / 3998 * T)
    assert trust_region.standard_errors(e, J, free) == pytest.approx([*expected, 0.0], rel=1e-9)
    J[:, 1] = 0
    alone = np.sqrt(e @ e / 3998 * T / 4000)  # a column without effect does not change the error of the other one
    assert trust_region.standard_errors(e, J, free) == pytest.approx([alone, np.inf, 0.0], rel=1e-9)


def test_the_correlation_time_of_a_first_order_process():
    rng = np.random.default_rng(1)
    e, a = np.zeros(200_000), 0.8
    noise = rng.normal(size=len(e))
    for k in range(1, len(e)):
        e[k] = a * e[k - 1] + noise[k]
    assert trust_region.correlation_time(e + 5) == pytest.approx((1 + a) / (1 - a), rel=0.1)
    assert trust_region.correlation_time(np.full(9, 2.0)) == 1.0
    short = np.array([1.0, 2.0, 0.0, -1.0, 0.5])
    centred = short - 0.5
    lags = [centred[: 5 - k] @ centred[k:] / (centred @ centred) for k in range(5)]
    end = next(k for k, v in enumerate(lags) if v <= 0)
    assert trust_region.correlation_time(short) == pytest.approx(1 + 2 * sum(lags[1:end]))
