"""Duhem fit: scaling, starts from the increments, refinement of the free run, limits of the searches."""

from itertools import repeat
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import OptimizeResult

from hystfmu import Dataset, InputError
from hystfmu.identify.estimate import search
from hystfmu.identify.methods import duhem

OPTIONS = {"m": 0, "q": 2, "dead_band": 0.0}
P = 5  # terms of a direction for m = 0, q = 2
TRAIN = slice(20, 600)


class Spy:
    """Stands in for `scipy.optimize.least_squares`: notes its calls, answers the start moved by `step`."""

    def __init__(self, costs, step=0.0):
        self.costs, self.step, self.calls = costs, step, []

    def __call__(self, fun, x0, *_, **words):
        self.calls.append(SimpleNamespace(fun=fun, x0=np.array(x0, dtype=float), words=words))
        x = self.calls[-1].x0 + self.step
        r, n = np.asarray(fun(x)), len(x)
        jac = np.ones((len(r), n)) * np.arange(1, n + 1)
        return OptimizeResult(x=x, cost=next(self.costs), fun=r, jac=jac)


@pytest.fixture
def data():
    u = 30 + 5 * np.sin(np.arange(700) / 20) * np.linspace(1, 0.5, 700)
    u[650:] += 50  # behind the training rows
    w = np.zeros(700)
    for k in range(1, 700):
        d = (u[k] - u[k - 1]) / 5
        w[k] = w[k - 1] + d * (1 - 0.5 * np.sign(d) * w[k - 1])
    return Dataset(1e-3 * np.arange(700), u, 100 + 4 * u + 10 * w, train=TRAIN, unit_u="V", unit_y="um")


def scaled(data):
    seen = data.u[:600]
    u = (2 * data.u - seen.max() - seen.min()) / np.ptp(seen)
    y = data.y[TRAIN]
    return u, (y - y.mean()) / (np.ptp(y) / 2)


def test_starts_refinement_and_their_limits(monkeypatch, data):
    spy, told = Spy(repeat(1.0)), []
    monkeypatch.setattr(search, "least_squares", spy)
    graph, parameters = duhem.build(data, OPTIONS, 0, told.append)
    u, y = scaled(data)
    slope = np.polyfit(u[TRAIN], y, 1)[0]
    assert [c.x0.tolist() for c in spy.calls[:3]] == [pytest.approx([s * slope, 0.0]) for s in (0, 0.5, 1)]
    assert [(c.words["x_scale"].tolist(), c.words["max_nfev"]) for c in spy.calls[:3]] == [([0.1, 0.1], 60)] * 3
    assert [(c.words["x_scale"], c.words["max_nfev"]) for c in spy.calls[3:]] == [("jac", 30)] * 3
    assert all(c.x0.tolist() == [0.0] * (3 + 2 * P) for c in spy.calls[3:])
    assert told == pytest.approx([0, 0.1, 0.2, 0.3, 0.5, 0.7])
    slopes = duhem._Slopes(u[TRAIN], y, np.ones(580, dtype=bool), 0, 2, 0.0)
    assert spy.calls[0].fun(np.array([0.3, 0.1])) == pytest.approx(slopes.solve(0.3, 0.1)[2])
    squares = [np.sum(c.fun(c.x0) ** 2) for c in spy.calls[3:]]
    assert squares == sorted(squares)  # the best free run is refined first
    assert graph.run(data.u, data.h).reshape(-1)[TRAIN] == pytest.approx(
        data.y[TRAIN] + spy.calls[3].fun(spy.calls[3].x0) * np.sqrt(580) * np.ptp(data.y[TRAIN]) / 2
    )
    assert parameters == 3 + 2 * P
    inner = graph.node("input").value("gain")[0] * data.u + graph.node("input").value("offset")[0]
    assert inner == pytest.approx(u)
    assert (graph.inputs[0].unit, graph.inputs[0].start, graph.outputs[0].unit) == ("V", data.u[0], "um")


@pytest.mark.parametrize(("rms", "refined"), [(0.0499, 1), (0.0501, 3)])
def test_an_error_below_five_percent_ends_the_refinement(monkeypatch, data, rms, refined):
    spy = Spy(repeat(rms**2 / 2))
    monkeypatch.setattr(search, "least_squares", spy)
    duhem.build(data, OPTIONS, 0, lambda f: None)
    assert len(spy.calls) == 3 + refined


def test_the_best_refinement_is_taken(monkeypatch, data):
    spy = Spy(iter([1.0, 1.0, 1.0, 3.0, 1.0, 2.0]), 1e-3)
    monkeypatch.setattr(search, "least_squares", spy)
    graph, _ = duhem.build(data, OPTIONS, 0, lambda f: None)
    second = spy.calls[4]
    left = second.fun(second.x0 + 1e-3) * np.sqrt(580) * np.ptp(data.y[TRAIN]) / 2
    assert graph.run(data.u, data.h).reshape(-1)[TRAIN] == pytest.approx(data.y[TRAIN] + left)


def test_pieces_are_five_dead_bands_long(monkeypatch, data):
    asked = []
    monkeypatch.setattr(search, "least_squares", Spy(repeat(1.0)))
    segments = duhem.segments
    monkeypatch.setattr(duhem, "segments", lambda u, least: (asked.append(least), segments(u, least))[1])
    duhem.build(data, {**OPTIONS, "dead_band": 0.01}, 0, lambda f: None)
    assert asked == [pytest.approx(5 * 0.01 / (np.ptp(data.u[:600]) / 2))]


def test_rows_of_both_directions_are_needed(data):
    up = Dataset.from_signal(
        np.r_[np.linspace(0, 1, 60), 0.99, 0.98], np.r_[np.linspace(0, 1, 60), 0.9, 0.8], 1e-3, "up"
    )
    with pytest.raises(InputError, match=r"up: .* m = 0, q = 2 must have at least 5 rows .* Got 59 and 2 instead"):
        duhem.build(up, OPTIONS, 0, lambda f: None)
    with pytest.raises(InputError, match=r"m = 0, q = 5 must have at least 11 rows"):
        duhem.build(up, {**OPTIONS, "q": 5}, 0, lambda f: None)


def test_the_node_has_its_coefficients_by_powers():
    theta = [np.arange(10.0), np.arange(10.0) + 100]  # m = 1, q = 2: (1, w, w^2, |w|, |w| w) for u^0, then for u^1
    node = duhem._node(theta, 0.5, 7.0, -1.0, 2.0, 1, 2)
    assert node.value("a_rise").tolist() == [0, 5]
    assert node.value("b_rise").ravel().tolist() == [1, 2, 6, 7]
    assert node.value("c_rise").ravel().tolist() == [3, 4, 8, 9]
    assert node.value("a_fall").tolist() == [100, 105]
    assert node.value("b_fall").ravel().tolist() == [101, 102, 106, 107]
    assert node.value("c_fall").ravel().tolist() == [103, 104, 108, 109]
    assert [float(node.value(k)[0]) for k in ("w0", "u0", "w_max", "k")] == [2.0, -1.0, 2.0, 0.5]
    assert duhem._node(theta, 0.5, -7.0, -1.0, 2.0, 1, 2).value("w0")[0] == -2.0


def test_terms_that_the_data_do_not_tell_share_their_weight():
    u = np.tile([0.0, 0.5, 1.0, 0.5], 10)  # two steps up, two down: five terms, two of them are seen
    y = np.tile([0.0, 1.0, 1.5, 1.2], 10)
    slopes = duhem._Slopes(u, y, np.ones(40, dtype=bool), 0, 2, 0.0)
    theta, _, left = slopes.solve(0.0, 0.0)
    terms = duhem.basis((u[:-1] + u[1:]) / 2, (y[:-1] + y[1:]) / 2, 0, 2) * np.diff(u)[:, None]
    for sign, found in zip((1, -1), theta, strict=True):
        rows = sign * np.diff(u) > 0
        assert found == pytest.approx(np.linalg.pinv(terms[rows], rcond=1e-8) @ np.diff(y)[rows], abs=1e-9)
    assert np.abs(left).max() < 1e-9


def test_the_second_row_may_be_a_reversal():
    first, last = duhem.segments(np.array([0.0, 1.0, 0.0, -1.0]), 100.0)
    assert (first.tolist(), last.tolist()) == ([0, 1], [1, 3])


def test_a_slope_that_follows_the_input():
    u = np.sin(np.arange(300) / 15)
    y = u + 0.25 * u**2  # slope 1 + u / 2 in both directions
    slopes = duhem._Slopes(u, y, np.ones(300, dtype=bool), 1, 1, 0.0)
    theta, _, left = slopes.solve(0.0, 0.0)
    terms = duhem.basis(u, y, 1, 1)
    for found in theta:
        assert terms @ found == pytest.approx(1 + 0.5 * u, abs=1e-6)
    assert np.abs(left).max() < 1e-9


def test_the_first_row_counts_only_if_it_is_measured(data):
    u, y = scaled(data)
    kept = np.ones(580, dtype=bool)
    slopes = duhem._Slopes(u[TRAIN], y, kept, 0, 2, 0.0)
    assert duhem._Start(slopes, np.array([0.2, 0.1]), u, y, TRAIN, kept).first == 0.0
    whole = duhem._Start(slopes, np.array([0.2, 0.1]), u[TRAIN], y, slice(0, 580), kept)
    assert whole.first == pytest.approx(y[0] - 0.2 * u[20] - 0.1)
    kept = kept.copy()
    kept[:3] = False
    late = duhem._Start(slopes, np.array([0.2, 0.1]), u[TRAIN], y, slice(0, 580), kept)
    assert late.first == 0.0
    assert late.w_max == pytest.approx(3 * np.abs(y - 0.2 * u[TRAIN] - 0.1)[3:].max())
    assert late.cost == pytest.approx(np.sum(late.error(np.zeros(13)) ** 2))
    assert len(late.error(np.zeros(13))) == 577
