"""Polynomial NARX: choice of the range, covariates, refusals; the graph runs the equation."""

import numpy as np
import pytest

from hystfmu import Dataset, InputError, fit
from hystfmu.identify.methods import polynomial_narx
from hystfmu.identify.methods import polynomial_narx as kind
from hystfmu.identify.methods.polynomial_narx import basis, lagged
from hystfmu.identify.solvers.ridge import least_squares

H = 1e-3
OPTIONS = {
    "n_u": 2, "n_f": 1, "n_y": 0, "n_k": 1, "q": 2, "ridge": 1e-3,
    "memory": "dominant", "range": 2.0, "u0": None, "margin": 0.1,
}  # fmt: skip
TRAIN = slice(20, 280)


def record(n=300, covariate=False, train=TRAIN):
    rng = np.random.default_rng(7)
    u = 5 + 2 * np.sin(np.arange(n) / 11) * np.linspace(1, 0.3, n)
    T = {"T [degC]": 20 + 30 * rng.random(n)} if covariate else None
    y = 40 + 3 * u + np.r_[0, u[:-1]] ** 2 + (0.05 * u * T["T [degC]"] if covariate else 0) + 0.01 * rng.normal(size=n)
    return Dataset(H * np.arange(n), u, y, train=train, unit_u="V", unit_y="um", covariates=T)


def batch(phi, y, ridge=1e-3):
    return np.linalg.solve(phi.T @ phi + len(y) * ridge**2 * np.eye(phi.shape[1]), phi.T @ y)


def polynomial(data, n_u=2, n_f=1, q=2, first=1, span=2.0):
    """Regressors with scaled lags, before the weights; and the scaled signals."""
    s = kind.signals(data, span, "dominant", float(data.u[0]), 0.1)
    z = np.column_stack([lagged(s.x, n_u, first), lagged(s.f, n_f, first)])
    z = z / np.concatenate([np.full(n_u, np.abs(s.x).max()), np.full(n_f, np.abs(s.f).max())])
    return basis(z, q), s


@pytest.mark.parametrize("first", [0, 1])
def test_the_graph_runs_the_batch_solution(first):
    data, told = record(), []
    graph, parameters = kind.build(data, {**OPTIONS, "n_k": first}, 0, told.append)
    phi, s = polynomial(data, first=first)
    want = phi @ batch(phi[TRAIN], s.y[TRAIN]) * s.half + s.middle
    assert graph.run(data.u, H).reshape(-1)[3:] == pytest.approx(want[3:], rel=1e-6)
    assert parameters == 10
    assert told == [0.4]
    assert (graph.inputs[0].unit, graph.inputs[0].start, graph.outputs[0].unit) == ("V", data.u[0], "um")
    assert graph.node("network").value("y0")[0] == pytest.approx(s.y[0])


def test_a_signal_without_values_keeps_its_gain():
    s = kind.Signals((), np.array([0.0, 0.25]), np.zeros(2), np.array([4.0, -8.0]), 0.0, 1.0, np.zeros((2, 0)))
    assert s.lags(1, 2, 1, 0)[1].tolist() == [4.0, 1.0, 1.0, 0.125]


@pytest.mark.parametrize("n_f", [0, 5])
def test_the_range_with_the_least_training_error(monkeypatch, n_f):
    data, told, tried = record(), [], []
    solve = kind.solve

    def noted(seen, rows, lags, q, ridge):
        found = solve(seen, rows, lags, q, ridge)
        tried.append((round(float(np.ptp(seen.x[TRAIN])), 9), lags, found[1]))
        return found

    monkeypatch.setattr(kind, "solve", noted)
    kind.build(data, {**OPTIONS, "n_u": 4, "n_f": n_f, "range": None}, 0, told.append)
    assert [t[0] for t in tried[:3]] == [1.0, 2.0, 4.0]
    assert all(t[1] == [3, min(n_f, 3), 0, 1] for t in tried[:3])
    assert tried[3][1] == [4, n_f, 0, 1]
    best = min(tried[:3], key=lambda t: (t[2], t[0]))[0]
    assert tried[3][0] == (best if n_f else 2.0)
    assert told == [0.2, 0.4]


def test_a_covariate_scales_a_network_of_its_own():
    data = record(covariate=True)
    graph, parameters = kind.build(data, OPTIONS, 0, lambda f: None)
    phi, s = polynomial(data)
    T = data.covariates.values[:, 0]
    lo, hi = T[TRAIN].min(), T[TRAIN].max()
    c = (2 * T - lo - hi) / (hi - lo)
    both = np.hstack([phi, phi * c[:, None]])
    theta = batch(both[TRAIN], s.y[TRAIN])
    limited = np.clip(T, lo - 0.1 * (hi - lo), hi + 0.1 * (hi - lo))
    c = (2 * limited - lo - hi) / (hi - lo)
    want = np.hstack([phi, phi * c[:, None]]) @ theta * s.half + s.middle
    assert graph.run(np.column_stack([data.u, T]), H).reshape(-1)[3:] == pytest.approx(want[3:], rel=1e-6)
    assert parameters == 20
    assert [i.name for i in graph.inputs] == ["u", "T"]
    assert s.beside[:, 0] == pytest.approx((2 * T - lo - hi) / (hi - lo))
    for end, beyond in ((hi + 0.1 * (hi - lo), 1e3), (lo - 0.1 * (hi - lo), -1e3)):
        far = graph.run(np.column_stack([data.u, np.full(300, end)]), H)
        assert graph.run(np.column_stack([data.u, np.full(300, beyond)]), H) == pytest.approx(far)


@pytest.mark.parametrize(("options", "words"), [
    ({"n_u": 20, "n_f": 2}, "at most the 260 training rows. Got 276 for n_u = 20, n_f = 2, n_y = 0, q = 2"),
    ({"n_u": 60, "n_f": 40}, "at most 5000 and"),
])  # fmt: skip
def test_what_does_not_go_together(options, words):
    with pytest.raises(InputError, match=words):
        kind.build(record(), {**OPTIONS, **options}, 0, lambda f: None)


def test_as_many_weights_as_rows_are_enough():
    data = record(train=slice(20, 75))  # 55 rows, 55 monomials of nine variables
    assert kind.build(data, {**OPTIONS, "n_u": 8}, 0, lambda f: None)[1] == 55
    with pytest.raises(InputError, match=r"the 54 training rows. Got 55"):
        kind.build(data.with_train((20, 74)), {**OPTIONS, "n_u": 8}, 0, lambda f: None)


def test_an_unstable_model_with_lags_of_y_is_refused(monkeypatch):
    monkeypatch.setattr(kind, "solve", lambda *given: (np.array([0, 0, 3.0, 1.0]), 0.0, np.ones(3)))
    with pytest.raises(InputError, match="kind polynomial_narx must follow the data"):
        fit(record(), "polynomial_narx", n_u=1, n_f=1, n_y=1, q=1, range=2.0)


# ---- regression and signals ------------------------------------------------------------------------------------------
RNG = np.random.default_rng(8)


@pytest.mark.parametrize("rows", [50, 4100])  # one chunk, and three
def test_the_ridge_of_a_regression(rows):
    phi, y = RNG.normal(size=(rows, 3)), RNG.normal(size=rows)
    theta, rms = least_squares(phi, y, 0.3)
    want = np.linalg.solve(phi.T @ phi + rows * 0.09 * np.eye(3), phi.T @ y)
    assert theta == pytest.approx(want, rel=1e-9)
    assert rms == pytest.approx(np.sqrt(np.mean((y - phi @ want) ** 2)))


def narx_data():
    u = 5 + 3 * np.sin(np.arange(300) / 9) * np.linspace(1, 0.2, 300)
    return Dataset.from_signal(u, 2 * u + 40, 1e-3, "narx")


def test_the_signals_of_the_polynomial_are_scaled_to_the_training_rows():
    data = narx_data()
    s = polynomial_narx.signals(data, 2.0, "dominant", float(data.u[0]), 0.05)
    u, y = data.u[data.train], data.y[data.counted]
    lo, hi = u.min(), u.max()
    limited = np.clip(data.u, lo - 0.05 * (hi - lo), hi + 0.05 * (hi - lo))
    assert s.x == pytest.approx((2 * limited - lo - hi) / (hi - lo))  # a range of 2
    assert (s.middle, s.half) == pytest.approx(((y.max() + y.min()) / 2, np.ptp(y) / 2))
    assert s.y == pytest.approx((data.y - s.middle) / s.half)
    assert s.nodes[0].value("gain")[0] == pytest.approx(2 / (hi - lo))
    assert s.nodes[1].value("x0")[0] == pytest.approx(s.x[0])
    assert s.f[0] == pytest.approx(0.0)
    first = int(np.argmax(s.x))  # before the first reversal, the virgin branch: h = g(2 |x - x0|) / 2
    d = s.x[: first + 1] - s.x[0]
    assert s.f[: first + 1] == pytest.approx(d * -np.expm1(-2 * d), abs=1e-9)
    assert s.beside.shape == (300, 0)


def test_lags_and_their_gains():
    data = narx_data()
    s = polynomial_narx.signals(data, 4.0, "dominant", float(data.u[0]), 0.05)
    z, gains = s.lags(2, 1, 3, 0)
    k = 50
    assert z[k] == pytest.approx([s.x[k], s.x[k - 1], s.f[k], s.y[k - 1], s.y[k - 2], s.y[k - 3]])
    most = [np.abs(v).max() for v in (s.x, s.x, s.f, s.y, s.y, s.y)]
    assert gains == pytest.approx(1 / np.array(most))
    assert s.lags(1, 1, 0, 1)[0][k] == pytest.approx([s.x[k - 1], s.f[k - 1]])
    theta, rms, gains = polynomial_narx.solve(s, data.counted, [2, 0, 0, 0], 1, 1e-9)
    assert rms < 1e-6 * s.half
    assert theta[0] * gains[0] * s.x[k] + theta[1] * gains[1] * s.x[k - 1] + theta[2] == pytest.approx(s.y[k], abs=1e-5)
    wrong = polynomial_narx.solve(s, data.counted, [1, 0, 0, 1], 1, 1e-9)[1]  # without the present value
    late = np.column_stack([s.x[data.counted], np.r_[s.x[0], s.x[:-1]][data.counted], np.ones(len(s.x[data.counted]))])
    left = s.y[data.counted] - late[:, 1:] @ np.linalg.lstsq(late[:, 1:], s.y[data.counted], rcond=None)[0]
    assert wrong == pytest.approx(s.half * np.sqrt(np.mean(left**2)), rel=1e-6)
