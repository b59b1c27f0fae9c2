"""Solvers step by step: trials of a line search, Powell-Beale directions, damping, which columns are solved at once."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from hystfmu.identify.solvers import trainers
from hystfmu.identify.solvers.trainers import conjugate_gradients, levenberg_marquardt


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
