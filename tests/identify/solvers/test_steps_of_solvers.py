"""Solvers step by step: trials of a line search, Powell-Beale directions, damping, which columns are solved at once."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.fft import dct
from scipy.optimize import minimize_scalar

from hystfmu.identify.solvers import nonnegative, trainers
from hystfmu.identify.solvers.trainers import conjugate_gradients, levenberg_marquardt

SEED = int(np.random.default_rng().integers(1 << 31))


# ---- line search ----------------------------------------------------------------------------------------------------
def searched(f, slope_of, step, slope=0.1):
    """Search along a line; return step, value, and the places of all trials."""
    tried = []

    def function(p):
        tried.append(float(p[0]))
        return f(p[0]), np.array([slope_of(p[0])])

    found = trainers._line_search(np.zeros(1), np.ones(1), f(0.0), slope_of(0.0), step, function, slope)
    return found, tried


@pytest.mark.parametrize(
    ("step", "tried"),
    [(1.0, [1, 3]), (10.0, [10, 3]), (3.1, [3.1]), (3.4, [3.4, 3]), (0.1, [0.1, 1.0, 3]), (0.01, [0.01, 0.1, 1.0, 3])],
)
def test_trials_of_a_line_search_on_a_parabola(step, tried):
    found, places = searched(lambda a: (a - 3) ** 2, lambda a: 2 * (a - 3), step)
    assert places == pytest.approx(tried)
    assert found[:2] == pytest.approx((tried[-1], (tried[-1] - 3) ** 2), abs=1e-12)
    assert found[2] == pytest.approx([2 * (tried[-1] - 3)], abs=1e-9)


@pytest.mark.parametrize(("slope", "count"), [(0.1, 2), (0.9, 1)])
def test_the_slope_must_fall_to_its_fraction(slope, count):
    _, places = searched(lambda a: (a - 3) ** 2, lambda a: 2 * (a - 3), 0.5, slope)
    assert len(places) == count


def test_a_search_ends_after_twenty_trials():
    found, places = searched(lambda a: -a, lambda a: -1.0, 1.0)
    assert len(places) == 20
    assert places[1] == pytest.approx(5.55)  # the middle of 1.1 and 10 times the last step
    assert found[0] == places[-1]


def test_a_search_without_a_lower_point_finds_none():
    found, places = searched(lambda a: 1.5 if a else 1.0, lambda a: -1.0, 1.0)
    assert found is None
    assert len(places) == 20
    assert places == sorted(places, reverse=True)
    found, _ = searched(lambda a: 1.0 + 1e-15 * a, lambda a: -1e-15, 1.0)
    assert found is not None  # higher by no more than rounding
    found, places = searched(lambda a: np.inf if a else 0.0, lambda a: -1.0, 1.0)
    assert found is None
    assert places[:3] == pytest.approx([1.0, 0.5, 0.25])


def test_a_decrease_must_be_a_ten_thousandth_of_the_predicted_one():
    value = {0.0: 1.0, 1.0: 1.0 - 0.99e-4}
    _, places = searched(lambda a: value.get(a, 0.5), lambda a: -1.0 if a == 0 else 0.0, 1.0)
    assert len(places) == 2
    value[1.0] = 1.0 - 1.01e-4
    _, places = searched(lambda a: value.get(a, 0.5), lambda a: -1.0 if a == 0 else 0.0, 1.0)
    assert places == [1.0]


def test_a_minimum_between_two_rising_ends():
    """The first trial lies beyond the minimum, on the rising side."""
    found, places = searched(lambda a: (a - 1) ** 4, lambda a: 4 * (a - 1) ** 3, 1.9)
    assert places[0] == 1.9
    assert found[0] < 1.5
    assert abs(4 * (found[0] - 1) ** 3) <= 0.4


# ---- directions -----------------------------------------------------------------------------------------------------
N = 5
WELL = np.random.default_rng(8).normal(size=(12, N))


def well(p):
    """A smooth convex function that is not quadratic."""
    a = WELL @ p
    return float(np.sum(np.exp(0.5 * a) + np.exp(-0.4 * a))), WELL.T @ (0.5 * np.exp(0.5 * a) - 0.4 * np.exp(-0.4 * a))


def powell_beale(p, steps):
    """The equations of the module with searches by Brent's method; the last points."""
    g = well(p)[1]
    d, since, points, d_t, y_t = -g, 0, [], None, None
    for _ in range(steps):
        a = minimize_scalar(lambda a, p=p, d=d: well(p + a * d)[0], bracket=(0, 1e-3), tol=1e-14).x
        p = p + a * d
        points.append(p)
        new = well(p)[1]
        y = new - g
        if since == 0:
            d_t, y_t = d, y
        if abs(g @ new) >= 0.2 * new @ new or since + 1 >= N:
            d, since = -new, 0
        else:
            beta, gamma = new @ y / (d @ y), new @ y_t / (d_t @ y_t) if since else 0.0
            d, since = -new + beta * d + gamma * d_t, since + 1
        g = new
    return points


@pytest.mark.parametrize("steps", range(1, 9))
def test_the_points_of_powell_and_beale(steps):
    start = np.array([1.0, -0.5, 0.8, 0.3, -0.9])
    p, value, taken = conjugate_gradients(start, well, steps, slope=1e-8)
    want = powell_beale(start, steps)[-1]
    assert p == pytest.approx(want, abs=2e-5)
    assert value == well(p)[0]
    assert taken == steps


def test_the_first_trial_is_a_unit_step_and_the_next_predicts_the_last_decrease():
    places = []

    def function(p):
        places.append(np.array(p))
        return float(p @ p) * 50, 100 * p

    conjugate_gradients(np.array([3.0, 4.0]), function, 1)
    assert np.linalg.norm(places[1] - places[0]) == pytest.approx(1.0)
    places.clear()
    conjugate_gradients(np.array([3e-3, 4e-3]), function, 1)
    assert places[1] == pytest.approx(places[0] - 100 * places[0])  # the gradient is shorter than 1
    values, trials = [], []

    def noted(p):
        trials.append(np.array(p))
        return well(p)

    start = np.array([1.0, -0.5, 0.8, 0.3, -0.9])
    first, *_ = conjugate_gradients(start, noted, 1, slope=1e-8)
    count = len(trials)
    trials.clear()
    conjugate_gradients(start, noted, 2, slope=1e-8)
    g0, g1 = well(start)[1], well(first)[1]
    a = (first - start)[0] / -g0[0]
    restart = abs(g0 @ g1) >= 0.2 * g1 @ g1
    d = -g1 if restart else -g1 + g1 @ (g1 - g0) / (-g0 @ (g1 - g0)) * -g0
    assert trials[count] - first == pytest.approx(a * (-g0 @ g0) / (d @ g1) * d, rel=1e-4, abs=1e-9)
    assert values == []


def test_a_small_gradient_ends_the_steps():
    seen = []
    p, _, steps = conjugate_gradients(np.array([1.0, 2.0]), lambda p: (float(p @ p), 2 * p), 9, gradient=4.0)
    assert (p.tolist(), steps) == ([1.0, 2.0], 0)
    _, _, steps = conjugate_gradients(
        np.array([1.0, 2.0]), lambda p: (float(p @ p), 2 * p), 9, gradient=3.99, progress=seen.append
    )
    assert steps == 1
    assert seen == pytest.approx([0, 1 / 9])


# ---- damping --------------------------------------------------------------------------------------------------------
def valley(p):
    return np.array([10 * (p[1] - p[0] ** 2), 1 - p[0]]), np.array([[-20 * p[0], 10.0], [-1.0, 0.0]])


def marquardt(p, function, iterations):
    """The equations of the module by the normal equations."""
    mu, (r, J) = 1e-2, function(p)
    scale = np.zeros(len(p))
    for _ in range(iterations):
        norms = np.linalg.norm(J, axis=0)
        scale = np.maximum(scale, np.maximum(norms, 1e-8 * norms.max()))
        for _ in range(12):
            trial = p - np.linalg.solve(J.T @ J + mu * np.diag(scale**2), J.T @ r)
            if np.sum(function(trial)[0] ** 2) < r @ r:
                break
            mu *= 4
        else:
            return p
        p, (r, J), mu = trial, function(trial), max(mu / 5, 1e-14)
    return p


@pytest.mark.parametrize("iterations", range(1, 12))
@pytest.mark.parametrize("alone", [False, True])
def test_the_points_of_levenberg_and_marquardt(iterations, alone):
    start = np.array([-1.2, 1.0])
    residuals = (lambda p: valley(p)[0]) if alone else None
    p, cost = levenberg_marquardt(start, valley, iterations, 0.0, residuals=residuals)
    want = marquardt(start, valley, iterations)
    assert p == pytest.approx(want, rel=1e-6)
    assert cost == pytest.approx(np.sum(valley(want)[0] ** 2), rel=1e-5)


def test_twelve_dampings_are_tried():
    tried = []

    def function(p):
        tried.append(p[0])
        return np.array([1.0 + abs(p[0])]), np.array([[1.0]])

    p, cost = levenberg_marquardt(np.zeros(1), function, 50)
    assert (p.tolist(), cost, len(tried)) == ([0.0], 1.0, 13)
    assert tried[1:] == pytest.approx([-1 / (1 + 1e-2 * 4**k) for k in range(12)])


@pytest.mark.parametrize(("tolerance", "count"), [(1e-5, 10), (0.0, 60)])
def test_ten_iterations_that_gain_too_little_end_the_search(tolerance, count):
    told, left = [], iter(1 + 1e-7 * np.arange(200, 0, -1))

    def function(p):
        return np.array([next(left) ** 0.5, 0.0]), np.array([[1.0], [1.0]])

    levenberg_marquardt(np.zeros(1), function, 60, tolerance, told.append)
    assert len(told) == count


def test_a_column_without_effect_keeps_a_hundred_millionth_of_the_scale():
    p, _ = levenberg_marquardt(
        np.array([0.0, 0.0]), lambda p: (np.array([p[0] - 1, 1e-9 * (p[1] - 1)]), np.diag([1.0, 1e-9])), 1
    )
    scale = 1e-8
    assert p[0] == pytest.approx(1 / 1.01)
    assert p[1] == pytest.approx(1e-18 / (1e-18 + 1e-2 * scale**2), rel=1e-6)


# ---- which columns at once ------------------------------------------------------------------------------------------
@pytest.fixture
def branches(monkeypatch):
    """Answer with a given number of positive weights; note who was asked."""
    asked = []

    def make(positive, exact=None):
        def direct(A, b):
            asked.append(("direct", A.shape[1]))
            x = np.zeros(A.shape[1])
            x[:positive] = 1.0
            return x

        monkeypatch.setattr(nonnegative, "_direct", direct)
        monkeypatch.setattr(
            nonnegative, "positive_solution", lambda A, b: (asked.append(("exact", A.shape[1])), exact)[1]
        )
        monkeypatch.setattr(
            nonnegative, "_priced",
            lambda A, b, working, weights: (asked.append(("priced", len(working), len(weights))), weights)[1],
        )  # fmt: skip
        return asked

    return make


@pytest.mark.parametrize(
    ("n", "positive", "exact", "who"),
    [
        (300, 300, None, [("direct", 300)]),
        (301, 150, None, [("direct", 300), ("priced", 300, 300)]),
        (301, 151, "x", [("direct", 300), ("exact", 301)]),
        (1200, 151, None, [("direct", 300), ("exact", 1200), ("direct", 1200)]),
        (1201, 151, None, [("direct", 300), ("exact", 1201), ("priced", 300, 300)]),
        (3000, 151, "x", [("direct", 300), ("exact", 3000)]),
        (3001, 151, "x", [("direct", 300), ("priced", 300, 300)]),
    ],
)
def test_how_many_columns_are_solved_at_once(branches, n, positive, exact, who):
    asked = branches(positive, exact)
    found = nonnegative._solved(np.zeros((2, n)), np.zeros(2))
    assert asked == who
    assert (found is exact) if who[-1][0] == "exact" else len(found) > 0


@pytest.mark.parametrize(("rows", "reduced"), [(9, 4), (8, 8)])
def test_many_rows_are_reduced_to_a_triangle(monkeypatch, rows, reduced):
    asked = []
    monkeypatch.setattr(
        nonnegative, "nnls", lambda A, b, maxiter: (asked.append((A.shape, maxiter)), (np.ones(A.shape[1]), 0.0))[1]
    )
    rng = np.random.default_rng(SEED)
    assert nonnegative._direct(rng.normal(size=(rows, 4)), rng.normal(size=rows)).tolist() == [1.0] * 4
    assert asked == [((5 if reduced == 4 else 8, 4), 420)]
    A, b = rng.normal(size=(30, 4)), rng.normal(size=30)
    triangle = nonnegative._triangle(A, b)
    R, q = triangle[:, :-1], triangle[:, -1]
    x = rng.normal(size=4)
    assert np.linalg.norm(R @ x - q) == pytest.approx(np.linalg.norm(A @ x - b))


def test_prices_add_peaks_of_the_gradient_until_none_is_left(monkeypatch):
    rng, asked = np.random.default_rng(SEED), []
    direct = nonnegative._direct
    monkeypatch.setattr(nonnegative, "_direct", lambda A, b: (asked.append(A.shape[1]), direct(A, b))[1])
    t = np.linspace(0, 1, 80)
    A = np.maximum(t[:, None] - np.linspace(0, 0.98, 500), 0)
    A /= np.linalg.norm(A, axis=0)
    b = A[:, [100, 333]] @ [1.0, 2.0] + 1e-3 * rng.normal(size=80)
    working = np.arange(0, 500, 50)
    x = nonnegative._priced(A, b, working, direct(A[:, working], b))
    g = A.T @ (b - A @ x)
    assert g.max() <= 1e-10
    assert len(asked) >= 2
    assert max(asked) < 120
    assert nonnegative._priced(A, A[:, 100] * 0.0, working, np.zeros(10)).tolist() == [0.0] * 500


# ---- minimum norm ---------------------------------------------------------------------------------------------------
def test_rows_are_mixed_by_an_orthogonal_matrix():
    rng = np.random.default_rng(SEED)
    rows = rng.normal(size=(50, 7))
    A, b = nonnegative._mixed(rows)
    mixed = np.column_stack([A, b])
    assert mixed.T @ mixed == pytest.approx(rows.T @ rows)
    draw = np.random.default_rng(0)
    signs = draw.choice([-1.0, 1.0], (50, 1))
    assert mixed == pytest.approx(dct(signs * rows, axis=0, norm="ortho")[draw.permutation(50)])


def test_a_correction_in_the_null_space_is_the_shortest():
    rng = np.random.default_rng(SEED)
    Q = np.linalg.qr(rng.normal(size=(12, 5)))[0]
    x = Q @ Q.T @ (rng.random(12) + 0.4)
    x[3] -= 0.3
    y = nonnegative._pushed(Q, x)
    if y is not None:
        assert (y >= 0).all()
        assert Q.T @ y == pytest.approx(Q.T @ x, abs=1e-9)
    inside = rng.random(12) + 1
    assert nonnegative._pushed(Q, inside) == pytest.approx(inside)
    many = inside.copy()
    many[:3] = -1.0  # a quarter of all
    assert nonnegative._pushed(Q, many) is None
    few = rng.random(30) + 1
    few[:6] = -1e-3  # a fifth
    wide = np.linalg.qr(rng.normal(size=(30, 5)))[0]
    found = nonnegative._pushed(wide, few)
    assert found is not None
    assert wide.T @ found == pytest.approx(wide.T @ few, abs=1e-9)
    assert np.linalg.norm(found - few) < 0.1
    assert nonnegative._pushed(wide, 1e-9 * few) == pytest.approx(1e-9 * found, rel=1e-6, abs=1e-15)
    few[6] = -1e-3
    assert nonnegative._pushed(wide, few) is None
