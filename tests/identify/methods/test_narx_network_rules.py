"""NARX network: regression one step ahead, free run and its derivatives, starts, limits, order of the lags."""

import numpy as np
import pytest

from hystfmu import Dataset, InputError
from hystfmu.identify.methods import narx_network as kind
from hystfmu.identify.network.training import Network

H, L, HIDDEN = 1e-3, 2, 3
SIZE = HIDDEN * (2 * L + 3) + 2 * L + 2  # a, W1, b1, W2, b2
OPTIONS = {"lags": L, "hidden": HIDDEN, "one_step": 7, "iterations": 9, "y0": None}


def free_run(p, u, before):
    """The equation row by row: u(k-L..k) and y(k-L..k-1), oldest first; u rests before row 0."""
    a, W1, b1, W2, b2 = np.split(p, np.cumsum([2 * L + 1, HIDDEN * (2 * L + 1), HIDDEN, HIDDEN]))
    y, past = [*before], [u[0]] * L + [*u]
    for k in range(len(u)):
        x = np.array([*past[k : k + L + 1], *y[-L:]])
        y.append(float(a @ x + W2 @ np.tanh(W1.reshape(HIDDEN, -1) @ x + b1) + b2[0]))
    return np.array(y[L:])


@pytest.fixture
def p():
    return 0.3 * np.random.default_rng(2).normal(size=SIZE)


def test_the_free_run_and_its_derivatives(p):
    rng = np.random.default_rng(5)
    u, before = rng.normal(size=30), rng.normal(size=L)
    y, s = kind.simulate(p, u, before, L, HIDDEN, derivatives=True)
    assert y == pytest.approx(free_run(p, u, before))
    slopes = [(free_run(p + e, u, before) - free_run(p - e, u, before)) / 2e-6 for e in 1e-6 * np.eye(SIZE)]
    assert pytest.approx(np.array(slopes), abs=1e-6) == s.T
    y, s = kind.simulate(p, u, before, L, HIDDEN)
    assert y == pytest.approx(free_run(p, u, before))
    assert s.shape == (0, SIZE)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_run_that_leaves_ten_stays_there(sign):
    p = np.zeros(SIZE)
    p[2 * L] = 1.5  # y(k) = 1.5 y(k-1)
    y, _ = kind.simulate(p, np.zeros(20), sign * np.array([1.0, 2.0]), L, HIDDEN)
    assert y.tolist() == pytest.approx([sign * v for v in (3, 4.5, 6.75, *[10.0] * 17)])
    p[2 * L] = 1.0
    assert kind.simulate(p, np.zeros(3), np.array([0.0, 9.9999]), L, HIDDEN)[0].tolist() == [9.9999] * 3
    assert kind.simulate(p, np.zeros(3), np.array([0.0, -10.0]), L, HIDDEN)[0].tolist() == [-10.0] * 3
    p[-1] = 5.0  # an offset
    assert kind.simulate(p, np.zeros(3), np.array([0.0, 1.0]), L, HIDDEN)[0].tolist() == [6.0, 10.0, 10.0]


@pytest.fixture
def stages(monkeypatch, p):
    """Replace both trainings; return what they were asked."""
    asked = {}

    def train(x, rest, hidden, activation, starts, iterations, decay, seed, direction, progress, most_rows):
        asked["regression"] = (x, rest, hidden, activation, starts, iterations, decay, seed, direction, most_rows)
        progress(0.5)
        rng = np.random.default_rng(1)
        made = [0.1 * rng.normal(size=n) for n in ((HIDDEN, 2 * L + 1), HIDDEN, HIDDEN)]
        return Network(*made, 0.2, "tanh"), 0.0

    def minimise(p, function, iterations, progress):
        asked["simulation"] = (p, function, iterations)
        progress(0.5)
        return p + 0.01, 0.0

    monkeypatch.setattr(kind, "train", train)
    monkeypatch.setattr(kind, "levenberg_marquardt", minimise)
    return asked


def test_regression_one_step_ahead_and_then_in_simulation(stages):
    rng, told = np.random.default_rng(3), []
    u, y = rng.uniform(-1, 1, 100), rng.uniform(-1, 1, 100)
    found, error = kind.trained(u, y, L, HIDDEN, (7, 9), 4, told.append)
    x = np.array([[u[k - 2], u[k - 1], u[k], y[k - 2], y[k - 1]] for k in range(2, 100)])
    a = np.linalg.lstsq(x, y[2:], rcond=None)[0]
    rest = y[2:] - x @ a
    most = np.abs(rest).max()
    got = stages["regression"]
    assert got[0] == pytest.approx(x)
    assert got[1] == pytest.approx(rest / most)
    assert got[2:] == (HIDDEN, "tanh", 1, 7, 1e-7, 4, None, 98)
    first, function, iterations = stages["simulation"]
    assert iterations == 9
    assert first[:5] == pytest.approx(a)
    net = np.random.default_rng(1)
    W1, b1, W2 = (0.1 * net.normal(size=n) for n in ((HIDDEN, 5), HIDDEN, HIDDEN))
    assert first[5:] == pytest.approx(np.concatenate([W1.ravel(), b1, W2 * most, [0.2 * most]]))
    size = np.sqrt(np.sum(y**2))
    e, J = function(first)
    assert e == pytest.approx(np.r_[(free_run(first, u[2:], y[:2]) - y[2:])[40:] / size, 1e-5 * first])
    steps = [(function(first + d)[0] - function(first - d)[0]) / 2e-6 for d in 1e-6 * np.eye(SIZE)]
    assert pytest.approx(np.array(steps), abs=1e-6) == J.T
    assert found == pytest.approx(first + 0.01)
    assert error == pytest.approx(np.linalg.norm((free_run(found, u[2:], y[:2]) - y[2:])[40:]) / size)
    assert told == pytest.approx([0.15, 0.65])


def test_a_record_that_lags_explain_leaves_nothing_to_scale(stages):
    u = np.random.default_rng(3).uniform(-1, 1, 60)
    y = np.zeros(60)
    kind.trained(u, y + 1e-30, L, HIDDEN, (1, 1), 0, lambda f: None)
    assert np.isfinite(stages["simulation"][0]).all()


@pytest.fixture
def data():
    rng = np.random.default_rng(6)
    return Dataset(
        H * np.arange(80), 4 * rng.normal(size=80), 50 * rng.normal(size=80), train=slice(10, 70), unit_u="N"
    )


@pytest.mark.parametrize(("errors", "starts", "best"), [([0.3, 0.2, 0.25], 3, 1), ([0.3, 0.099], 2, 1), ([0.09], 1, 0)])
def test_up_to_three_starts(monkeypatch, data, p, errors, starts, best):
    asked, told = [], []

    def trained(u, y, lags, hidden, iterations, seed, progress):
        asked.append((u, y, lags, hidden, iterations, seed))
        progress(0.5)
        return p * (1 + 0.1 * len(asked)), errors[len(asked) - 1]

    monkeypatch.setattr(kind, "trained", trained)
    graph, parameters = kind.build(data, OPTIONS, 11, told.append)
    assert [c[5] for c in asked] == [11, 12, 13][:starts]
    assert told == pytest.approx([(k + 0.5) / 3 for k in range(starts)])
    assert {c[2:5] for c in asked} == {(L, HIDDEN, (7, 9))}
    most_u, most_y = np.abs(data.u[10:70]).max(), np.abs(data.y[10:70]).max()
    assert asked[0][0] == pytest.approx(data.u[10:70] / most_u)
    assert asked[0][1] == pytest.approx(data.y[10:70] / most_y)
    chosen = p * (1 + 0.1 * (best + 1))
    rest = np.full(L, data.y[0] / most_y)
    want = most_y * free_run(chosen, data.u / most_u, rest)
    assert graph.run(data.u, H).reshape(-1) == pytest.approx(want)
    assert parameters == SIZE
    assert (graph.inputs[0].unit, graph.inputs[0].start) == ("N", data.u[0])
    other, _ = (asked.clear(), kind.build(data, {**OPTIONS, "y0": 3.0}, 11, told.append))[1]
    want = most_y * free_run(chosen, data.u / most_u, np.full(L, 3.0 / most_y))
    assert other.run(data.u, H).reshape(-1) == pytest.approx(want)


def test_rows_and_stability_that_are_needed(monkeypatch, data):
    with pytest.raises(InputError, match=r"must be at least 66 for 3 lags. Got 60 instead"):
        kind.build(data, {**OPTIONS, "lags": 3}, 0, lambda f: None)
    wild = np.zeros(SIZE)
    wild[2 * L] = 1.2
    monkeypatch.setattr(kind, "trained", lambda *given: (wild, 0.0))
    with pytest.raises(InputError, match="with 2 lags must be stable in a free run"):
        kind.build(data, {**OPTIONS, "y0": 1.0}, 0, lambda f: None)
    still = np.zeros(SIZE)
    still[2 * L] = 1.0
    most = np.abs(data.y[10:70]).max()
    monkeypatch.setattr(kind, "trained", lambda *given: (still, 0.0))
    kind.build(data, {**OPTIONS, "y0": 9.99 * most}, 0, lambda f: None)
    with pytest.raises(InputError, match="stable"):
        kind.build(data, {**OPTIONS, "y0": 10.01 * most}, 0, lambda f: None)
    enough = Dataset.from_signal(data.u[:44], data.y[:44], H)
    kind.build(enough, OPTIONS, 0, lambda f: None)
    with pytest.raises(InputError, match=r"at least 44 for 2 lags. Got 43"):
        kind.build(Dataset.from_signal(data.u[:43], data.y[:43], H), OPTIONS, 0, lambda f: None)
