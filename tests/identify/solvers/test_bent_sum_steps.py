"""A bent sum of plays step by step: where a fit starts, straight and constant bends, one Gauss-Newton step."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import legendre

from hystfmu.identify.features import bent_sum
from hystfmu.identify.features.bent_sum import BentSum, Following, Problem
from hystfmu.identify.methods import constraint_factor_mlp as constraint_factor
from hystfmu.identify.solvers.nonnegative import nonnegative

H = 0.01
X = np.sin(np.linspace(0, 25, 300)) * np.linspace(1, 0.3, 300)
PLAY = np.array([0.0])
for _x in X[1:]:
    PLAY = np.append(PLAY, np.clip(PLAY[-1], _x - 0.2, _x + 0.2))
COLUMNS = np.column_stack([X, PLAY])
ROWS = np.arange(30, 300)
THETA = np.random.default_rng(2).uniform(-1, 1, (300, 2))


def problem(y, **more):
    return Problem(COLUMNS, y[ROWS], ROWS, H, np.array(more.pop("T", ())), **more)


def test_a_fit_starts_from_weights_without_a_bend():
    y = 3 + 2 * X + PLAY
    p = problem(y, T=(0.1,))
    s = bent_sum.fit_linear(p, 3)
    w, _ = nonnegative(COLUMNS[ROWS].copy(), y[ROWS], np.ones((270, 1)))
    size = np.abs(COLUMNS @ w).max()
    assert s.w == pytest.approx(w / size)
    assert s.q == pytest.approx([3, size, 0, 0], abs=1e-9)
    assert s.k.tolist() == [0.0]
    assert (s.g.shape, s.c.shape) == ((0,), (0, 4))
    assert s.rms < 1e-9


def test_an_output_that_falls_starts_from_equal_weights():
    s = bent_sum.fit_linear(problem(-2 * X - PLAY), 1)
    size = np.abs(X + PLAY).max()
    assert s.w == pytest.approx(np.ones(2) / size)
    assert s.q[1] < 0


def test_covariates_join_the_start_as_free_columns():
    y = 3 + 2 * X + 0.5 * THETA[:, 0]
    f = Following(THETA, ("gain", "none"))
    s = bent_sum.fit_linear(problem(y, following=f), 2)
    assert s.g.tolist() == [0.0, 0.0]
    assert s.c.shape == (2, 3)
    assert s.c[0] == pytest.approx([0.5, 0, 0], abs=1e-9)
    assert s.rms < 1e-9


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_the_slope_of_a_bend(degree):
    q = np.array([0.5, 2.0, 0.3])[: degree + 1]
    v = np.linspace(-1, 1, 7)
    want = np.zeros(7) if degree == 0 else legendre.legval(v, legendre.legder(q))
    assert problem(X).following.slope(v, q, np.zeros((0, degree + 1)), np.zeros(0)) == pytest.approx(want)


def delayed(columns, rows):
    return columns[np.maximum(rows - 1, 0)]


@pytest.mark.parametrize("after", [None, delayed])
@pytest.mark.parametrize("followed", [False, True])
def test_derivatives_of_the_output_by_weights_creep_and_gains(after, followed):
    f = Following(THETA, ("gain", "offset")) if followed else Following(THETA[:, :0], ())
    p = problem(X**3, T=(0.05, 0.5), after=after, following=f)
    n = 2 if followed else 0
    s = BentSum(
        np.array([0.6, 0.4]), np.array([0.2, 1.0, 0.3]), np.array([0.1, 0.2]),
        0.0, np.array([0.3, 0.0][:n]), np.full((n, 3), 0.1) * ([[1, 0, 0]] * n if n else 1),
    )  # fmt: skip
    linear, target, free = bent_sum._linearised(p, s, p.seen(bent_sum._before(p, s)), p.y)
    here, e = bent_sum.model(p, s), 1e-6

    def moved(name, j):
        value = getattr(s, name).copy()
        value[j] += e
        return (bent_sum.model(p, replace(s, **{name: value})) - here) / e

    assert linear[:, :2] == pytest.approx(np.column_stack([moved("w", j) for j in range(2)]), abs=1e-4)
    creep = np.column_stack([moved("k", j) for j in range(2)])
    rest = creep - linear[:, 2:]  # but for the lag of the first value, which the constant takes
    assert np.ptp(rest, axis=0) == pytest.approx(np.zeros(2), abs=1e-4)
    assert free[:, 0].tolist() == [1.0] * 270
    assert free.shape[1] == 1 + followed
    gains = np.zeros(270)
    if followed:
        assert free[:, 1] == pytest.approx(moved("g", 0), abs=1e-4)
        gains = free[:, 1] * 0.3
    assert target == pytest.approx(p.y - here + linear @ np.r_[s.w, s.k] + gains)


@pytest.mark.parametrize("roughness", [0.0, 1e-4, 1e-1])
def test_a_branch_is_the_penalised_least_squares(roughness):
    """Where no slope is at its bound: normal equations with the third derivative, relative to the longest branch."""
    x = 1.5 * np.sin(np.linspace(0, 40, 500)) * np.linspace(1, 0.1, 500)
    where = constraint_factor.stack_coordinates(x, 0.0)
    free = np.column_stack([np.ones(500), np.arange(500.0)])
    y = where.columns(3, np.inf) @ np.array([0.8, 0.5, 0.02, 0.01]) + 1e-3 * np.cos(np.arange(500)) + 1e-3 * free[:, 1]
    found = constraint_factor.increasing_branch(where, y, free, slice(None), 3, roughness)
    Hc = where.columns(3, where.d.max())
    rest = Hc - free @ np.linalg.lstsq(free, Hc, rcond=None)[0]
    d = np.linspace(0, where.d.max(), 400)
    third = where.d.max() ** 3 * np.diff(constraint_factor.basis_derivatives(d, 3), 2, axis=0) / (d[1] - d[0]) ** 2
    R = roughness * np.sqrt(500 / 398) * third
    left = y - free @ np.linalg.lstsq(free, y, rcond=None)[0]
    want = np.linalg.lstsq(np.vstack([rest, R]), np.r_[left, np.zeros(398)], rcond=None)[0]
    assert found(d) == pytest.approx(constraint_factor.basis(d, 3) @ want, rel=1e-4, abs=1e-5)
