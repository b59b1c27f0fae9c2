"""Searches of densities and of saturating slopes by numbers: exact derivatives, starts, the path, what ends them."""

import numpy as np
import pytest
from numpy.polynomial import legendre

from hystfmu.identify.features import bell_density, saturating
from hystfmu.identify.features.bell_density import Relays
from hystfmu.identify.features.saturating import Level, Path, Saturating, started
from hystfmu.identify.methods.duhem import segments

START = "demagnetised"
X = np.interp(np.arange(56), [0, 12, 32, 47, 55], [0.0, 1.0, -0.8, 0.5, -0.2])


def by_differences(of, p, step=1e-6):
    return np.column_stack([(of(p + d) - of(p - d)) / (2 * step) for d in step * np.eye(len(p))])


# ---- densities -------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def relays():
    return Relays([(X, np.arange(5, len(X)))], 9, 0.05, START, True)


def test_the_grid_is_about_the_centre_and_beyond_the_input(relays):
    assert relays.half == pytest.approx(1.1 * 0.95)
    assert Relays([(X, np.arange(5))], 4, 0.0, START, False, 2.0).half == 2.0
    values = relays.node("r", relays.line, 0.1).values
    ends = [0.05 + (0.1 + side) * relays.half for side in (-1, 1)]
    assert [float(np.ravel(values[k])[0]) for k in ("lo", "hi")] == pytest.approx(ends)
    assert not np.any(Relays([(X, np.arange(9))], 4, 0.0, START, False).moved)
    half = relays.on(np.arange(len(X) - 5) < 7)
    assert np.array_equal(half.seen, relays.seen[:7])
    assert np.array_equal(half.moved, relays.moved[:7])


def test_a_bell_curve_is_a_parabola_of_the_logarithm(relays):
    mu = relays.density(relays.bell(0.3, 0.2, -0.1, 0.4))
    assert mu.sum() == pytest.approx(1.0)
    assert (mu[~relays.inner] == 0).all()
    inner = relays.inner
    rest = np.log(mu[inner]) + 0.5 * ((relays.d[inner] - 0.3) / 0.2) ** 2 + 0.5 * ((relays.m[inner] + 0.1) / 0.4) ** 2
    assert np.ptp(rest) < 1e-9


def test_the_derivatives_of_a_density(relays):
    """Of v, and those of the residuals for the coefficients of the polynomial that fit best (Kaufman 1975)."""
    p = np.concatenate([[0.01, 0.3], relays.bell(0.3, 0.3, 0.0, 0.4)])
    found = relays.slopes(p[0], p[1], p[2:])
    assert found == pytest.approx(by_differences(lambda q: relays.v(q[0], q[1], q[2:]), p), abs=1e-8)
    problem = bell_density.Problem(relays, np.tanh(2 * X[5:]) ** 2, 3, 0.5, 0.1)
    n = len(X) - 5
    Q = problem._projected(p)[2]
    given, near = problem.jacobian(p), by_differences(problem.residuals, p)
    assert given[:n] == pytest.approx(near[:n] - Q @ (Q.T @ near[:n]), abs=1e-6)
    assert given[n:] == pytest.approx(near[n:], abs=1e-6)
    bell = problem.at(p)
    assert bell.centre == pytest.approx(0.05 + 0.01 * relays.half)
    v = relays.v(*p[:2], p[2:])
    assert bell.size == np.abs(v).max()
    best = legendre.legfit(v / bell.size, problem.y, 3)
    assert bell.q == pytest.approx(best, abs=1e-9)
    assert problem.residuals(p)[:n] == pytest.approx((legendre.legval(v / bell.size, best) - problem.y) / 0.1, abs=1e-8)
    quadratic = np.add.outer(np.arange(12.0) ** 2, 3 * np.arange(12.0) ** 2).ravel()
    assert np.abs(problem.penalty[:, 2:] @ quadratic).max() < 1e-9  # a parabola has no penalty
    cubic = np.outer(np.ones(12), np.arange(12.0) ** 3).ravel()
    assert np.linalg.norm(problem.penalty[:, 2:] @ cubic) == pytest.approx(6 / 0.5 * np.sqrt(12 * 9))
    assert problem.coordinates.lo[:3].tolist() == [-1e-9, 0.0, -np.inf]
    assert problem.coordinates.hi[:3].tolist() == [1e-9, 5.0, np.inf]
    assert problem.coordinates.scale[:3].tolist() == [0.02, 0.1, 1.0]


def test_the_search_of_a_bell_curve_finds_it(relays):
    true = relays.bell(0.35, 0.25, 0.1, 0.3)
    v = relays.v(0.015, 0.2, true)
    problem = bell_density.Problem(relays, (v / np.abs(v).max()) ** 2, 2, 0.5, 1e-3)
    bell = problem.started()
    assert bell.centre == pytest.approx(0.05 + 0.015 * relays.half, abs=2e-3)
    assert bell.w == pytest.approx(0.2, rel=0.05)
    fixed = bell_density.Problem(Relays([(X, np.arange(5, len(X)))], 9, bell.centre, START, False, relays.half),
                                 problem.y, 2, 0.5, 1e-3)  # fmt: skip
    better = fixed.fitted(bell)
    assert np.sqrt(np.mean(fixed.errors(better) ** 2)) < 2e-3
    E = np.ravel(fixed.node(better).values["E"])
    assert fixed.relays.seen @ E == pytest.approx(fixed.relays.v(0.0, better.w, better.ln_mu) / better.size)


# ---- saturating slopes -----------------------------------------------------------------------------------------------
TRUE = Saturating(
    np.log([[2.0, 3.0, 4.0, 3.0, 2.0], [1.5, 2.0, 3.0, 4.0, 5.0]]),
    np.array([[0.7, 0.8, 0.8, 0.9, 0.9], [-0.9, -0.8, -0.8, -0.7, -0.7]]), 0.1, -0.2,
)  # fmt: skip


def test_the_path_has_all_rows_reversals_and_points_between():
    path = Path(np.array([0.0, 0.05, 0.05, 0.1, 0.03, 0.03, -0.01]), np.array([1, 4, 6]))
    assert path.u.tolist() == [0.05, 0.03, -0.01]
    assert path.rows.tolist() == [3, 10, 12]  # 0 to 0.05 in three parts, then 0.1 in three, 0.03 in four, -0.01 in two
    assert path.length == pytest.approx([0.05 / 3] * 3 + [0.05 / 3] * 3 + [0.07 / 4] * 4 + [0.04 / 2] * 2)
    assert path.up.tolist() == [True] * 6 + [False] * 6
    assert path.middle[:2] == pytest.approx([0.05 / 6, 0.05 / 2])


def test_the_solution_between_points_is_exact_and_its_derivatives_are():
    rows = np.arange(2, len(X))
    problem = saturating.Problem(Path(X, rows), 0.5 * X[rows], Level(5, 0.3, 0.1), 0.05)
    w = [TRUE.w0]
    for middle, up, length in zip(problem.path.middle, problem.path.up, problem.path.length, strict=True):
        basis = saturating.uniform_splines(np.array([middle]), 5)[0]
        side = 0 if up else 1
        r, target = basis @ np.exp(TRUE.rate[side]), basis @ (np.exp(TRUE.rate[side]) * TRUE.bound[side])
        w.append(target / r + (w[-1] - target / r) * np.exp(-r * length))
    assert problem.w(TRUE) == pytest.approx(w)
    assert problem.errors(TRUE) == pytest.approx(0.1 * X[rows] + np.array(w)[problem.path.rows] - 0.5 * X[rows])
    assert problem.jacobian(TRUE.p) == pytest.approx(by_differences(problem.residuals, TRUE.p), abs=1e-5)
    held = problem.penalty @ TRUE.p
    parts = [np.concatenate([np.diff(c, 3) / 0.3, c / 10]) for c in TRUE.rate]
    parts += [np.concatenate([np.diff(c) / 0.1, c / 3]) for c in TRUE.bound]
    assert held == pytest.approx(np.concatenate(parts))
    assert Saturating.at(TRUE.p).p.tolist() == TRUE.p.tolist()
    finer = TRUE.finer(9)
    assert (finer.rate[:, ::2], finer.k, finer.w0) == (pytest.approx(TRUE.rate), 0.1, -0.2)
    assert finer.bound[:, 1::2] == pytest.approx((TRUE.bound[:, 1:] + TRUE.bound[:, :-1]) / 2)


def test_starts_are_least_squares_of_increments_and_a_good_fit_ends_the_search(monkeypatch):
    u = np.interp(np.arange(240), np.arange(0, 241, 40), [0, 1, -1, 0.8, -0.6, 0.4, 0])
    rows = np.arange(240)
    problem = saturating.Problem(Path(u, rows), np.zeros(240), Level(5, 0.3, 0.1), 1e-3)
    problem.y = problem.errors(TRUE)
    starts = started(u, problem.y, rows, segments(u, 0.02), 5)
    assert [s.k for s in starts] == [0.0, 0.1, 0.2, 0.4]
    good = starts[1]
    assert good.w0 == pytest.approx(problem.y[0] - 0.1 * u[0])
    assert np.exp(good.rate[:, 1:4]) == pytest.approx(np.exp(TRUE.rate[:, 1:4]), rel=0.3)
    assert good.bound == pytest.approx(TRUE.bound, abs=0.15)
    assert np.sqrt(np.mean(problem.errors(good) ** 2)) < 0.02
    asked, refined = [], saturating.refined
    monkeypatch.setattr(saturating, "refined", lambda *given: asked.append(given[2:]) or refined(*given))
    found = problem.fitted(starts)
    assert (asked, found.k) == ([(40, 1e-4)], pytest.approx(0.1, abs=0.01))  # below 1.5 times the noise
    problem.y = problem.y + 0.01 * np.random.default_rng(1).normal(size=240)
    problem.fitted(starts)
    assert len(asked) == 3  # the two best starts
