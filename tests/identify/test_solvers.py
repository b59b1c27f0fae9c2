"""Solvers against closed forms and scipy: what they minimise, under which constraints, in how many steps."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear, minimize_scalar

from hystfmu.identify.methods.preisach import FOLDS, Penalised, best_strengths
from hystfmu.identify.solvers import nonnegative
from hystfmu.identify.solvers.trainers import conjugate_gradients, levenberg_marquardt


def rows(seed: int, n: int, p: int, q: int):
    """A problem with positive and zero weights: A (n, p), b (n,), F (n, q)."""
    rng = np.random.default_rng(seed)
    A, F = rng.normal(size=(n, p)), np.column_stack([np.ones(n), rng.normal(size=(n, q - 1))])
    return A, A @ rng.normal(size=p) + F @ rng.normal(size=q) + rng.normal(size=n), F


def bounded(A, b, F):
    """The same problem by scipy."""
    lower = np.concatenate([np.zeros(A.shape[1]), np.full(F.shape[1], -np.inf)])
    return lsq_linear(np.hstack([A, F]), b, (lower, np.inf), method="bvls", tol=1e-14).x


@pytest.mark.parametrize(("n", "p", "q"), [(40, 6, 1), (40, 6, 3), (9, 12, 2), (200, 15, 2)])
def test_non_negative_weights_are_those_of_scipy(n, p, q):
    A, b, F = rows(n + p, n, p, q)
    x, v = nonnegative.nonnegative(A, b, F)
    assert (x >= 0).all()
    assert (x == 0).any()
    other = bounded(A, b, F)
    assert A @ x + F @ v == pytest.approx(A @ other[:p] + F @ other[p:], abs=1e-8)
    if n > p + q:
        assert np.concatenate([x, v]) == pytest.approx(other, abs=1e-8)


def test_columns_that_add_nothing_get_no_weight():
    A, b, F = rows(3, 30, 4, 2)
    A[:, 1], A[:, 2] = 0.0, 2 * F[:, 0] - F[:, 1]
    x, v = nonnegative.nonnegative(A, b, np.hstack([F, F[:, :1]]))  # a free column twice shares its weight
    assert x[1] == x[2] == 0
    assert v[0] == pytest.approx(v[2], rel=1e-9)
    other = bounded(A[:, [0, 3]], b, F)
    assert [x[0], x[3], v[0] + v[2], v[1]] == pytest.approx(other, abs=1e-8)


def test_without_a_column_that_adds_something_the_free_columns_remain():
    F = np.column_stack([np.ones(9), np.arange(9.0)])
    x, v = nonnegative.nonnegative(F[:, ::-1].copy(), 3 * F[:, 1] - 1, F)
    assert x.tolist() == [0.0, 0.0]
    assert v == pytest.approx([-1.0, 3.0])


def test_the_extreme_columns_are_those_off_the_line_between_others():
    n = nonnegative.COARSE + 60
    k = np.arange(n)
    A = np.vstack([np.abs(k - 100.0), np.maximum(k - 250.0, 0.0)])  # straight but at 100 and 250
    assert nonnegative._extreme(A).tolist() == [0, 100, 250, n - 1]
    assert nonnegative._extreme(A[:, :10]).tolist() == list(range(10))


def test_a_positive_solution_is_the_shortest():
    rng = np.random.default_rng(1)
    A = rng.normal(size=(80, 90))
    weights = rng.random(90)
    weights[::15] = 0
    b = A @ weights
    x = nonnegative.positive_solution(A, b)
    assert x is not None
    assert np.linalg.norm(A @ x - b) < 1e-12 * np.linalg.norm(b)
    assert (x >= 0).all()
    assert (x == 0).any()  # plain least norm is negative somewhere
    # conditions of the least norm: x = max(0, A' m) for some m
    used = x > 1e-12
    m = np.linalg.lstsq(A[:, used].T, x[used], rcond=None)[0]
    assert x == pytest.approx(np.maximum(A.T @ m, 0), abs=1e-10)


def test_without_a_positive_solution_there_is_none():
    rng = np.random.default_rng(2)
    A = rng.random((5, 40)) + 0.1  # all entries positive: b < 0 is out of reach
    assert nonnegative.positive_solution(A, -np.ones(5)) is None
    assert nonnegative.positive_solution(np.vstack([A, A[0]]), np.arange(6.0)) is None  # contradictory rows


def test_the_row_space_is_factored():
    rng = np.random.default_rng(4)
    A = rng.normal(size=(150, 40)) @ rng.normal(size=(40, 200))  # rank 40
    Q, L = nonnegative.row_space(A)
    assert Q.shape == (200, 40)
    assert np.abs(Q.T @ Q - np.eye(40)).max() < 1e-13
    assert A[:40] == pytest.approx(L @ Q.T, abs=1e-11)
    assert np.abs(np.triu(L, 1)).max() < 1e-11
    assert np.abs(A - (A @ Q) @ Q.T).max() < 1e-10


def stacked(problem_of, strengths, keep):
    """The penalised problem of some rows by scipy: scaled weights and the constant."""
    A, F, y, penalties = problem_of
    columns = np.hstack([A, F])
    n, m = A.shape[1], columns.shape[1]
    centred = columns - columns.mean(axis=0)
    size = np.linalg.norm(centred, axis=0)
    size[:n] = np.maximum(size[:n], 0.1 * size[:n].max())
    blocks = [
        np.eye(m),
        *(np.hstack([P / size[:n] * np.median(size[:n]), np.zeros((len(P), m - n))]) for P in penalties),
    ]
    held = np.vstack([s * block for s, block in zip(strengths, blocks, strict=True)])
    system = np.block([[(centred / size)[keep], np.ones((len(keep), 1))], [held, np.zeros((len(held), 1))]])
    lower = np.r_[np.zeros(n), np.full(m - n + 1, -np.inf)]
    target = np.r_[(y - y.mean())[keep], np.zeros(len(held))]
    z = lsq_linear(system, target, (lower, np.inf), method="bvls", tol=1e-14).x
    return z, centred / size, size, columns.mean(axis=0)


@pytest.mark.parametrize("strengths", [(1e-3, 0.0), (0.3, 0.0), (0.05, 2.0)])
def test_penalised_weights_and_their_cross_validation(strengths):
    A, y, F = rows(7, 57, 5, 3)
    A[:, 4] *= 1e-3  # hardly excited: not scaled up further than a tenth of the largest
    F = F[:, 1:]
    penalties = [np.diff(np.eye(5), axis=0)]
    p = Penalised(A, F, y, penalties)
    z, scaled, size, middle = stacked((A, F, y, penalties), strengths, np.arange(57))
    x, v, c = p.solve(strengths)
    assert np.r_[x, v] == pytest.approx(z[:-1] / size, abs=1e-7)
    assert c == pytest.approx(y.mean() + z[-1] - middle @ (z[:-1] / size), abs=1e-8)
    squares = 0.0
    for chunk in np.array_split(np.arange(57), FOLDS):
        z = stacked((A, F, y, penalties), strengths, np.setdiff1d(np.arange(57), chunk))[0]
        squares += np.sum((scaled[chunk] @ z[:-1] + z[-1] - (y - y.mean())[chunk]) ** 2)
    assert p.error(strengths) == pytest.approx(np.sqrt(squares / 57), rel=1e-7)


def test_the_strengths_with_the_least_error_are_found():
    class Bowl:
        calls = 0

        def error(self, s):
            Bowl.calls += 1
            return (
                (np.log10(s[0]) + 2) ** 2
                + (np.log10(s[1]) - 1) ** 2
                + 0.5 * (np.log10(s[0]) + 2) * (np.log10(s[1]) - 1)
            )

    levels = [tuple(10.0 ** np.arange(-4, 4)), tuple(10.0 ** np.arange(-3, 4))]
    seen: list[float] = []
    assert best_strengths(Bowl(), levels, seen.append) == ((0.01, 10.0), 0.0)
    assert len(seen) == Bowl.calls <= 45  # each pair once
    assert seen == sorted(seen)
    assert seen[-1] <= 1.0
    assert seen[0] == pytest.approx(1 / 45)


def quadratic(n: int):
    rng = np.random.default_rng(n)
    root = rng.normal(size=(n, n))
    H, x = root @ root.T / n + 0.2 * np.eye(n), rng.normal(size=n)

    def function(p):
        function.calls += 1
        return float(0.5 * (p - x) @ H @ (p - x)) + 3.0, H @ (p - x)

    function.calls = 0
    return function, x


@pytest.mark.parametrize("n", [1, 2, 6, 10])
def test_conjugate_directions_end_after_as_many_steps_as_variables(n):
    function, x = quadratic(n)
    p, value, steps = conjugate_gradients(np.zeros(n), function, 100, slope=1e-5, gradient=1e-7)
    assert p == pytest.approx(x, abs=1e-6)
    assert value == pytest.approx(3.0, abs=1e-12)
    assert steps <= n + 1
    assert function.calls <= 8 * (n + 1)


def test_conjugate_gradients_in_the_valley_of_rosenbrock():
    def valley(p):
        a, b = 1 - p[:-1], p[1:] - p[:-1] ** 2
        g = np.zeros(len(p))
        g[:-1] = -2 * a - 400 * p[:-1] * b
        g[1:] += 200 * b
        return float(np.sum(a**2 + 100 * b**2)), g

    seen: list[float] = []
    p, value, steps = conjugate_gradients(np.full(4, -1.0), valley, 300, gradient=1e-9, progress=seen.append)
    assert p == pytest.approx(np.ones(4), abs=1e-8)
    assert value < 1e-16
    assert steps < 120
    assert seen == [k / 300 for k in range(len(seen))]
    assert conjugate_gradients(np.ones(4), valley, 300)[2] == 0  # nothing to gain
    p, value, steps = conjugate_gradients(np.full(4, -1.0), valley, 5)
    assert steps == 5
    assert value == valley(p)[0] < valley(np.full(4, -1.0))[0]


def test_levenberg_marquardt_ends_at_the_least_squares():
    rng = np.random.default_rng(3)
    A, b = rng.normal(size=(20, 4)), rng.normal(size=20)
    seen: list[float] = []
    p, cost = levenberg_marquardt(np.zeros(4), lambda p: (A @ p - b, A), 60, progress=seen.append)
    best = np.linalg.lstsq(A, b, rcond=None)[0]
    assert p == pytest.approx(best, rel=1e-6)
    assert cost == pytest.approx(float(np.sum((A @ best - b) ** 2)), rel=1e-12)
    assert seen == [k / 60 for k in range(len(seen))]
    assert len(seen) <= 15
    jacobians = []
    q, _ = levenberg_marquardt(
        np.zeros(4), lambda p: (jacobians.append(1), (A @ p - b, A))[1], 60, residuals=lambda p: A @ p - b
    )
    assert q == pytest.approx(p, abs=1e-12)
    assert len(jacobians) <= len(seen) + 1


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
    p, value, taken = conjugate_gradients(start, well, steps, slope=1e-3)
    want = powell_beale(start, steps)[-1]
    assert p == pytest.approx(want, abs=2e-4)
    assert value == well(p)[0]
    assert taken == steps


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
