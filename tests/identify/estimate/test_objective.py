"""The objective of a search by numbers: linear parameters by least squares, derivatives, what the core refuses."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from hystfmu import Dataset, Graph, Node
from hystfmu.identify.estimate import objective as module
from hystfmu.identify.estimate.objective import Linear, Objective, OutOfTime
from hystfmu.identify.features.plays import plays
from hystfmu.identify.solvers.trust_region import Coordinates, Differences, Found, refined

U = np.interp(np.arange(90), [0, 25, 60, 75, 89], [0.0, 1.0, -1.0, 0.6, -0.3])
Y = 0.4 * U + plays(U, np.array([0.2, 0.5]), 0.0) @ [0.5, 0.3] + 0.05 * np.sin(9 * np.arange(90))
GRAPH = Graph.single(Node("h", "prandtl_ishlinskii", {"n": 2}, {"w0": 1.0, "r": [0.1, 0.2], "w": [1.0, 1.0]}))
LINEAR = [Linear("h.w0"), Linear("h.w", (0, 1), True)]
P = np.log([0.25, 0.55])


def objective(data=None, linear=LINEAR, values=lambda p: {"h.r": np.exp(p)}, **given):
    coordinates = Coordinates(np.full(2, -9.0), np.full(2, 1.0), np.array([0.3, 0.5]), values)
    return Objective(Dataset.from_signal(U, Y, 1e-3) if data is None else data, GRAPH, coordinates, linear, **given)


def by_differences(of, p, step=1e-6):
    return np.column_stack([(of(p + d) - of(p - d)) / (2 * step) for d in step * np.eye(len(p))])


def columns(p, u=U):
    return np.column_stack([u, plays(u, np.exp(p), u[0])])


def test_linear_parameters_are_least_squares():
    of, A = objective(), columns(P)
    weights = np.linalg.lstsq(A, Y, rcond=None)[0]
    assert (weights > 0).all()
    residuals, found, basis = of.project(P)
    assert found == pytest.approx(weights)
    assert residuals == pytest.approx((A @ weights - Y) / (np.ptp(Y) * np.sqrt(90)))
    assert basis.T @ basis == pytest.approx(np.eye(3), abs=1e-12)
    assert basis @ (basis.T @ A) == pytest.approx(A)
    values = of.graph(P).node("h").values
    assert np.concatenate([np.ravel(values[k]) for k in ("w0", "w", "r")]) == pytest.approx([*weights, 0.25, 0.55])
    assert (of.best[0], of.best[1].tolist()) == (pytest.approx(residuals @ residuals / 2), P.tolist())
    of.project(P + 1)
    assert of.best[1].tolist() == P.tolist()  # the other point is worse


def test_a_weight_that_must_not_be_negative_is_left_out():
    of = objective(Dataset.from_signal(U, Y - 1.2 * plays(U, np.array([0.55]), 0.0)[:, 0], 1e-3))
    residuals, found, basis = of.project(P)
    A = columns(P)
    want = lsq_linear(A, of.y, ([-np.inf, 0, 0], np.inf), method="bvls", tol=1e-14).x
    assert found == pytest.approx(want, abs=1e-9)
    assert basis.shape == (90, 1 + np.count_nonzero(found[1:]))
    assert 0 in found
    assert residuals == pytest.approx((A @ want - of.y) / of.size)


def test_the_jacobian_is_that_of_fixed_weights_off_their_columns():
    of = objective(size=2.0)
    weights, basis = of.project(P)[1:]
    slopes = by_differences(lambda p: columns(p) @ weights, P)
    assert of.sensitivities(P) == pytest.approx(slopes, abs=1e-6)
    assert of.jacobian(P) == pytest.approx((slopes - basis @ (basis.T @ slopes)) / 2.0, abs=1e-6)
    turns = of.turns(P, weights)
    assert [t["h.r"] for t in turns] == [pytest.approx([0.25, 0.0], rel=1e-8), pytest.approx([0.0, 0.55], rel=1e-8)]
    at_end = of.turns(np.array([1.0, -9.0]), weights)  # a step in one direction only
    assert [t["h.r"] for t in at_end] == [
        pytest.approx([np.e, 0.0], rel=1e-5),
        pytest.approx([0, np.exp(-9)], rel=1e-5),
    ]
    assert [sorted(c) for c in of.weighed(of.values(P, weights))] == [["h.w0"], ["h.w"], ["h.w"]]


def test_rows_of_several_records_and_a_part_of_them():
    one = Dataset.from_signal(U, Y, 1e-3)
    both = Dataset.joined([one, one.with_output(Y + 0.1 * U)])
    rows = np.r_[3:40, 95:170]
    of = objective(both, rows=rows)
    A, y = np.vstack([columns(P), columns(P)])[rows], both.y[rows]
    assert of.residuals(P) == pytest.approx((A @ np.linalg.lstsq(A, y, rcond=None)[0] - y) / of.size)
    assert of.size == pytest.approx(both.span * np.sqrt(len(rows)))
    assert objective(both, rows=np.arange(20)).residuals(P).shape == (20,)


def test_values_that_the_core_refuses_are_far_and_flat():
    of = objective(values=lambda p: {"h.r": np.array([-1.0, 1.0])})
    assert of.residuals(P) == pytest.approx(np.full(90, 1e3 / np.sqrt(90)))
    assert np.array_equal(of.jacobian(P), np.zeros((90, 2)))
    assert np.array_equal(of.sensitivities(P), np.zeros((90, 2)))
    huge = objective(linear=[], values=lambda p: {"h.r": np.exp(p), "h.w0": 1.1e100})
    assert huge.residuals(P)[0] == pytest.approx(1e3 / np.sqrt(90))


def test_the_time_limit_ends_a_search_that_has_a_point():
    of = objective(until=-np.inf)
    of.project(P)
    with pytest.raises(OutOfTime):
        of.project(P + 0.1)


# ---- searches --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("costs", "tried", "last"), [
    ([5.0, 2.0, 3.0], 3, 11.0), ([5.0, 2.0, 2.0], 3, 11.0), ([5.1e-9, 4.9e-9, 0.0], 2, 11.0),
    ([4.9e-9, 0.0, 0.0], 1, 10.0),
])  # fmt: skip
def test_short_searches_from_all_starts_until_one_is_good_enough(monkeypatch, costs, tried, last):
    asked, told = [], []

    def refined(of, p, evaluations, *tolerance):
        asked.append((float(p[0]), evaluations, *tolerance))
        return Found(p + 10, costs[int(p[0]) % 10])

    monkeypatch.setattr(module, "refined", refined)
    found = module.search(None, [np.array([k]) for k in (0.0, 1.0, 2.0)], told.append)
    assert asked == [*((float(k), 30, 1e-8) for k in range(tried)), (last, 200)]
    assert told == [*(0.25 * k for k in range(tried)), 0.75]
    assert found.p[0] == last + 10
    asked.clear()
    module.search(None, [np.array([1.0])], told.append, (7, 9))
    assert (asked, told[-1]) == ([(1.0, 9)], 0.5)


def test_a_search_without_time_returns_its_best_point():
    of = objective(until=-np.inf)
    of.project(P)
    found = module.search(of, [P + 0.1])
    assert (found.p.tolist(), found.cost, found.whole) == (P.tolist(), of.best[0], False)


def test_what_is_told_of_values_and_their_errors():
    found = module.Determined(
        ("a", "b", "c"), np.array([1.0, 2.0, 3.0]), np.array([0.1, np.inf, 0.0]), np.array([False, False, True]), 1.0,
        (("b",), ("a", "b"), ("a", "b", "c")),
    )  # fmt: skip
    assert found.table == {
        "a": {"value": 1.0, "standard_error": 0.1}, "b": {"value": 2.0, "known": "no"},
        "c": {"value": 3.0, "known": "at a bound"},
    }  # fmt: skip
    assert [line.partition(":")[0] for line in found.warnings] == [
        "the record does not determine b", "the record determines a and b only together",
        "the record determines a, b and c only together",
    ]  # fmt: skip


# ---- coordinates and differences -------------------------------------------------------------------------------------
def test_points_inside_their_bounds():
    c = Coordinates(np.array([0.0, -np.inf, 1.0]), np.array([0.5, np.inf, 1.0]), np.ones(3), lambda p: {"x": p})
    assert c.inside(np.array([-1.0, 7.0, 2.0])).tolist() == [0.5e-10, 7.0, 1.0]
    assert c.inside(np.array([1.0, 7.0, 2.0]))[0] == 0.5 - 0.5e-10
    wide = Coordinates(np.zeros(1), np.full(1, 9.0), np.ones(1), lambda p: {})
    assert wide.inside(np.array([-1.0])).tolist() == [1e-10]
    told = [c.at_bounds(np.array([v, 0.0, 1.5])).tolist() for v in (0.49e-6, 0.51e-6, 0.5 - 0.51e-6, 0.5 - 0.49e-6)]
    assert [t[0] for t in told] == [True, False, False, True]
    assert all(t[1:] == [False, True] for t in told)
    part = c.only(np.array([True, False, True]), np.array([0.1, 0.2, 0.3]))
    assert (part.lo.tolist(), part.hi.tolist(), part.scale.tolist()) == ([0.0, 1.0], [0.5, 1.0], [1.0, 1.0])
    assert np.asarray(part.values(np.array([0.4, 0.6]))["x"]).tolist() == [0.4, 0.2, 0.6]


def test_finite_differences_stay_inside_the_bounds():
    asked = []

    def of(p):
        asked.append(p.copy())
        return np.array([p[0] ** 2, p[0] * p[1], 3.0])

    search = Differences(of, np.array([1.0, 2.0]), (0.0, np.array([5.0, 1.0])), step=1e-3)
    found = search.jacobian(np.array([2.0, 1.0]))
    assert found == pytest.approx(np.array([[4.001, 0], [1, 2], [0, 0]]), abs=1e-9)
    assert [p.tolist() for p in asked] == [[2.0, 1.0], [2.001, 1.0], [2.0, 0.998]]
    search.residuals(np.array([2.0, 1.0]))
    assert len(asked) == 3  # the residuals are kept
    q = np.eye(3)[:, :1]
    held = Differences(of, np.array([1.0, 2.0]), step=1e-3, held=lambda p: (of, q))
    assert held.jacobian(np.array([2.0, 1.0])) == pytest.approx(np.array([[0, 0], [1, 2], [0, 0]]), abs=1e-9)
    none = refined(Differences(lambda p: np.array([3.0, 4.0]), np.zeros(0)), np.zeros(0), 5)
    assert (none.cost, none.misfit, none.whole) == (12.5, 5.0, True)
