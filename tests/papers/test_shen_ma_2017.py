"""Shen & Ma 2017: the constraint-factor operator, its fit, the network on it, and the table of the paper.

Independent of the package: an operator with return-point memory and Masing's virgin branch is a sum of plays, of
density 2 g''(2r) beside the linear term g'(0) (differentiate g(2r)/2 twice); `plants.plays` follows their definition.
"""

import numpy as np
import plants
import pytest
import reasons
from scipy.optimize import minimize

from hystfmu import Dataset, Graph, InputError, Node, signals
from hystfmu.identify import fit, options
from hystfmu.identify.catalogue import resolve
from hystfmu.identify.methods.constraint_factor_mlp import (
    GRID,
    LEAST_SLOPE,
    Branch,
    basis_derivatives,
    increasing_branch,
    literal_branch,
    stack_coordinates,
)
from hystfmu.identify.network.readout import hidden_sweep
from hystfmu.model import accuracy
from papers import Report, reproduce, shen_ma_2017
from papers.table import figure

A = np.array([0.6, 0.5, 0.3])  # increasing
LITERAL = {"branch": "literal", "memory": "last"}


def g(d, a):
    """Eq. 1."""
    return (1 - np.exp(-d)) * (a[0] + sum(c * d ** (2 * j + 1) for j, c in enumerate(a[1:])))


def by_plays(x, a, reach=1.5, n=3000):
    """The operator as plays: g'(0) x and the density 2 g''(2r), midpoint rule, derivatives by differences."""
    h = reach / n
    r = (np.arange(n) + 0.5) * h
    e = 1e-4
    second = (g(2 * r + e, a) - 2 * g(2 * r, a) + g(2 * r - e, a)) / e**2
    return a[0] * x + plants.plays(x, r) @ (2 * second * h)


@pytest.fixture(scope="module")
def path():
    return np.concatenate([signals.nested_reversals(60, 4, 0.02), np.full(3, 0.2), signals.minor_loops(3, 0.25, 60)])


def test_the_columns_are_the_operator(path):
    h = by_plays(path, A)
    columns = stack_coordinates(path, 0.0).columns(2, np.inf)
    np.testing.assert_allclose(columns @ A, h, atol=2e-6 * np.ptp(h))
    values = {"a0": A[0], "a": A[1:], "d_max": 5.0, "x0": 0.0}
    block = Graph.single(Node("operator", "constraint_factor", {}, values)).run(path)
    np.testing.assert_allclose(columns @ A, block, rtol=1e-12, atol=1e-13)


def test_the_columns_go_straight_on_beyond_the_longest_branch_as_the_block_does(path):
    for memory in ("dominant", "last"):
        values = {"a0": A[0], "a": A[1:], "d_max": 0.7, "x0": 0.1, "memory": memory}
        block = Graph.single(Node("operator", "constraint_factor", {}, values)).run(path)
        columns = stack_coordinates(path, 0.1, memory).columns(2, 0.7)
        np.testing.assert_allclose(columns @ A, block, rtol=1e-12, atol=1e-13)


def test_the_increasing_branch_is_the_constrained_optimum(path):
    """Against SciPy's SLSQP with the same slope constraints, on data whose free optimum falls."""
    where, rows = stack_coordinates(path, 0.0), slice(0, len(path))
    a = np.array([-0.15, 1.0, 0.5])
    H = where.columns(2, np.inf)
    y = H @ a
    free = np.ones((len(y), 1))
    b = increasing_branch(where, y, free, rows, 2, 0.0)
    assert Branch(a, b.d_max, 1.0).falling > 0.03
    assert b.falling == 0
    grid = 0.5 * b.d_max * (1 - np.cos(np.linspace(0, np.pi, GRID)))
    least = LEAST_SLOPE * np.ptp(y) / b.d_max
    E, centred = basis_derivatives(grid, 2), H - H.mean(axis=0)
    t = y - y.mean()
    cost = lambda p: np.mean((t - centred @ p) ** 2)  # noqa: E731
    constraint = {"type": "ineq", "fun": lambda p: E @ p - least, "jac": lambda p: E}
    best = minimize(cost, [1.0, 0.5, 0.1], method="SLSQP", constraints=constraint, options={"ftol": 1e-14})
    assert cost(b.a) <= best.fun * (1 + 1e-6)
    assert (E @ b.a >= least * (1 - 1e-6)).all()


@pytest.mark.turn("figures of papers")
def test_a_negative_actuator_is_followed_by_the_negative_operator():
    u = signals.training(40, 3)[::2]
    y = plants.asymmetric(u)
    for key in ("constraint_factor_mlp", "fitted_operator_mlp"):
        up, down = (fit(Dataset.from_signal(u, s * y), key, hidden=4, iterations=60) for s in (1, -1))
        assert down.fit["rms_percent"] <= 1.5 * up.fit["rms_percent"] <= 1.5


# ---- as printed ----------------------------------------------------------------------------------------------------
def test_the_printed_branch_falls_and_is_refused():
    """Table 1: g'(0) = a_0 = -13.1; it falls again around d = 0.36."""
    a = np.array(shen_ma_2017.PAPER_A)
    d = np.array([0.0, 0.1, 0.36, 0.6])
    assert (Branch(a, 0.8, 1.0).slope(d) < 0).tolist() == [True, False, True, False]
    assert g(0.02, a) < 0
    assert g(0.40, a) < g(0.325, a)
    with pytest.raises(InputError, match="must not decrease between"):
        Graph.single(Node("o", "constraint_factor", {}, {"a0": a[0], "a": a[1:], "d_max": 0.8})).run(np.zeros(3))


def test_normal_equations_as_printed():
    """Eq. 8 is least squares for a small order; at m = 9 its condition is 1e14 or more (SCIENCE sheet: 1e14..4e15)."""
    u = 0.4 * signals.decaying_sine(5, 0.05)
    y = plants.asymmetric(u / 0.4)
    where, rows = stack_coordinates(u, 0.0, "last"), slice(0, len(u))
    b = literal_branch(where, y, rows, 2)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(u))) != 0) + 1
    start = np.array([turns[turns < k][-1] for k in range(turns[0] + 1, len(u))])
    k = np.arange(turns[0] + 1, len(u))
    d, v = np.abs(u[k] - u[start]), np.sign(u[k] - u[start]) * (y[k] - y[start])
    B = np.column_stack([1 - np.exp(-d), (1 - np.exp(-d)) * d, (1 - np.exp(-d)) * d**3])
    np.testing.assert_allclose(b.a, np.linalg.lstsq(B, v, rcond=None)[0], rtol=1e-9)
    assert literal_branch(where, y, rows, 9).condition > 1e14


def test_half_of_the_printed_thresholds_are_dead():
    """Eq. 11 spans the full range: a play of half-width above half the range never comes back."""
    u = signals.decaying_sine(3, 0.1)
    moves = np.diff(plants.plays(u, np.arange(200) / 200 * np.ptp(u)), axis=0)
    both = (moves > 0).any(axis=0) & (moves < 0).any(axis=0)
    assert 95 <= both.sum() <= 101
    data = Dataset.from_signal(u, plants.prandtl_ishlinskii(u))
    assert (shen_ma_2017.paper_pi(data, 200).graph.node("hysteresis").value("w")[101:] == 0).all()


# ---- models --------------------------------------------------------------------------------------------------------
@pytest.mark.turn("figures of papers")
@pytest.mark.some(1)
@pytest.mark.parametrize("plant", [plants.prandtl_ishlinskii, plants.asymmetric])
def test_constraint_factor_and_network_on_held_out_signals(plant):
    u = signals.training(100, 1)
    data = Dataset.from_signal(u, plant(u))
    ours, literal = (
        accuracy.held_out_table(fit(data, "constraint_factor_mlp", **o), plant, data.span) for o in ({}, LITERAL)
    )
    for name, e in ours.items():
        assert e["rms_percent"] <= 0.4, name
        assert literal[name]["rms_percent"] >= 10 * e["rms_percent"], name


@pytest.mark.stress
def test_fitted_operator_and_network_straighten_a_bent_readout():
    u = signals.training(100, 1)
    data = Dataset.from_signal(u, plants.asymmetric(u))
    bent, plain = (
        accuracy.held_out_table(fit(data, "fitted_operator_mlp", bend=b), plants.asymmetric, data.span) for b in (5, 1)
    )
    for name, e in bent.items():
        assert e["rms_percent"] <= 0.2, name
    assert plain["nested reversals"]["rms_percent"] >= 3 * bent["nested reversals"]["rms_percent"]


@pytest.mark.stress
def test_hidden_sweep():
    """A pulse needs two sigmoids; the model takes the best one."""
    x = np.linspace(-1, 1, 300)[:, None]
    y = np.tanh(6 * (x[:, 0] + 0.4)) - np.tanh(6 * (x[:, 0] - 0.4))
    chosen = resolve("constraint_factor_mlp", options("constraint_factor_mlp"), {"starts": 6, "iterations": 100})
    fractions = []
    odd, even = slice(0, None, 2), slice(1, None, 2)
    found = hidden_sweep(x, y, odd, even, (2, 1, 8), chosen, progress=fractions.append)
    assert found[1] > 100 * found[2] > 0
    assert list(found) == [2, 1, 8]
    assert hidden_sweep(x, y, odd, even, (1,), chosen)[1] == pytest.approx(found[1], rel=1e-6)
    assert max(fractions) == 1
    assert all(0 < f <= 1 for f in fractions)
    u = signals.training(20, 1)[::3]
    data = Dataset.from_signal(u, plants.asymmetric(u))
    m = fit(data, "constraint_factor_mlp", sweep=3, iterations=30)
    assert m.graph.node("network").dims["n_hidden"] in (1, 2, 3)


# ---- the table -----------------------------------------------------------------------------------------------------
@pytest.mark.stress
def test_table(monkeypatch):
    monkeypatch.setattr(shen_ma_2017.table, "__defaults__", ((2, 5, 10),))
    monkeypatch.setattr(shen_ma_2017, "BIASES", (1.0,))
    monkeypatch.setattr(shen_ma_2017, "DECAYS", (0.02, 0.1))
    monkeypatch.setattr(shen_ma_2017, "ORDERS", (5, 9, 11))
    monkeypatch.setattr(shen_ma_2017, "SEEDS", 2)
    fractions = []
    report = reproduce("shen_ma_2017", progress=fractions.append)
    rows = {r.quantity: r for r in report.rows}
    timed = [r for r in report.rows if r.where == "speed"]  # their targets hold on an idle machine
    assert [r.quantity for r in report.rows if r.met is False and r not in timed] == []
    assert [r.printed for r in report.rows if r.place == "table 2"] == [0.0611, 0.0611, 0.0677, 0.069, 5]
    assert [r.printed for r in report.rows if r.place == "table 3"] == [0.4327, 0.433, 0.4348]
    assert rows["a_0 = g'(0), sensor late by 8 of 200 samples"].literal < 0
    assert rows["plays that never come back, %"].literal == pytest.approx(50, abs=1)
    assert all(0 <= f <= 1 for f in fractions)
    assert "0.4327" in report.text()
    assert {figure(d) for d in report.drawings} == {f"fig. {n}" for n in (1, 2, 3, 4)}
    reasons.check(report)


def test_the_magnetostrictive_actuator_without_pinning_follows_the_anhysteretic_curve(monkeypatch):
    """With c = 1 the magnetisation solves M = coth(H_e/a) - a/H_e, H_e = H + alpha M; the strain is its square."""
    from scipy.optimize import brentq

    p = shen_ma_2017
    monkeypatch.setattr(p, "REVERSIBLE", 1.0)
    x, bias = 0.4 * np.sin(np.linspace(0, 9, 4000)), 0.7

    def magnetisation(field):
        curve = lambda e: 1 / np.tanh(e) - 1 / e  # noqa: E731
        return brentq(lambda m: curve((field + p.COUPLING * m) / p.SHAPE) - m, 1e-6, 1)

    expected = np.array([magnetisation(bias + v) ** 2 for v in x[::100]])
    np.testing.assert_allclose(p.strain(x, bias)[::100] - expected, -expected[0], atol=1e-3)


def test_the_magnetostrictive_actuator_has_a_loop_and_is_asymmetric():
    x = np.sin(2 * np.pi * np.arange(600) / 200)
    y = shen_ma_2017.strain(x, 1.0)
    up, down = y[350:450].max(), y[350:450].min()
    at_rest = y[400], y[500]  # the same field, rising and falling
    assert abs(at_rest[0] - at_rest[1]) > 0.05 * (up - down)
    np.testing.assert_allclose(y[250:400], y[450:600], atol=0.02 * (up - down))


def test_data_folder_without_the_file(tmp_path):
    with pytest.raises(InputError, match="Test_Vi_Do_Di"):
        reproduce("shen_ma_2017", tmp_path)


def test_the_full_table_tries_every_number_of_neurons(monkeypatch):
    asked = []

    def table(data, progress, hidden=shen_ma_2017.SWEEP):
        asked.append(list(hidden))
        return Report("shen_ma_2017", "", ())

    monkeypatch.setattr(shen_ma_2017, "table", table)
    reproduce("shen_ma_2017")
    reproduce("shen_ma_2017", full=True)
    assert len(asked[0]) < 20
    assert asked[1] == list(range(1, 101))
