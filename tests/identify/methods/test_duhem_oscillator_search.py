"""Oscillator with a Duhem force of free shape: first estimates, stages of the search, passive parameters."""

from __future__ import annotations

import numpy as np
import pytest

from hystfmu import Dataset, InputError
from hystfmu.identify.methods import duhem_oscillator as kind
from hystfmu.identify.methods.duhem_oscillator import Trial, physical

H, N = 1e-3, 800


@pytest.fixture
def data():
    rng = np.random.default_rng(1)
    return Dataset(H * np.arange(N), rng.normal(size=N), 1e-3 * rng.normal(size=N), unit_u="N", unit_y="m")


@pytest.fixture
def built(monkeypatch, data):
    """Run `build` with a given linear oscillator and given costs of the searches."""

    def build(costs, lead=(2.0, 10.0, 5e4), stride=1, data=data):
        calls, told, left = [], [], iter(costs)

        def minimise(p, function, iterations, tolerance, progress, residuals):
            progress(0.0)
            progress(1.0)
            calls.append((np.array(p), function, iterations, tolerance, residuals, residuals.keywords))
            return p + 0.001, next(left)

        monkeypatch.setattr(kind, "linear_oscillator", lambda u, y, h: (calls.append((len(u), h)), lead)[1])
        monkeypatch.setattr(kind, "minimise", minimise)
        graph, parameters = kind.build(data, {"stride": stride}, 0, told.append)
        return graph, parameters, calls, told

    return build


WIDEST = 1.1 * 5e4


def test_four_ranges_on_a_quarter_then_all_rows_and_finer_knots(built, data):
    graph, parameters, calls, told = built([4.0, 3.0, 2.0, 3.5, 9.0, 1.0, 0.99])
    assert calls[0] == (N, H)
    searches = calls[1:]
    widest = WIDEST * np.abs(data.y).max()
    assert [c[5]["z_max"] for c in searches] == pytest.approx(
        [widest * s for s in (1, 0.5, 0.25, 0.125, 0.25, 0.25, 0.25)]
    )
    assert [c[5]["count"] for c in searches] == [N // 4] * 4 + [N] * 3
    assert {(c[2], c[3]) for c in searches} == {(30, 1e-6)}
    first = [1, 1, 0.5, 0.8, 0.65, 0.5, 0.35, 0.2]
    assert all(c[0] == pytest.approx(first) for c in searches[:4])
    assert searches[4][0] == pytest.approx(np.array(first) + 0.001)
    for c, n in zip(searches[5:], (9, 17), strict=True):
        assert c[0][3:] == pytest.approx(np.linspace(0.8, 0.2, n) + 0.001 * (2 if n == 9 else 3))
        assert c[0][:3] == pytest.approx(np.array(first[:3]) + 0.001 * (2 if n == 9 else 3))
    assert told == pytest.approx([(i + f) / 8 for i in range(7) for f in (0, 1)])
    assert parameters == 12  # 17 knots gained too little
    node = graph.node("plant")
    assert node.value("f") == pytest.approx(5e4 * physical(searches[5][0] + 0.001)[3:])
    assert node.value("z_max")[0] == pytest.approx(0.25 * widest)
    assert (node.value("m_L")[0], node.value("c_L")[0]) == pytest.approx((2 * 1.003, 10 * 1.003))
    assert node.value("k_L")[0] == pytest.approx(5e4 * 0.503)
    assert (graph.inputs[0].unit, graph.inputs[0].start, graph.outputs[0].unit) == ("N", data.u[0], "m")


def test_knots_that_gain_nothing_end_the_search(built):
    _, parameters, calls, _ = built([1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    assert parameters == 8
    assert len(calls) == 1 + 6


def test_residuals_and_their_jacobian(built, data):
    _, _, calls, _ = built([1.0] * 6, stride=4)
    assert calls[0] == (N // 4, 4 * H)
    p, function, _, _, residuals, words = calls[1]
    assert words["count"] == N // 16
    q = p + 0.05
    e, J = function(q)
    graph = kind.graph(physical(q), (2.0, 10.0, 5e4, words["z_max"]), data)
    y = data.y[::4]
    run = graph.run(data.u, H).reshape(-1)[::4]
    assert e == pytest.approx((run - y)[: N // 16] / np.sqrt(np.mean(y**2)))
    assert residuals(q) == pytest.approx(e)
    for j, step in enumerate(1e-4 * np.eye(len(q))):
        assert J[:, j] == pytest.approx((residuals(q + step) - e) / 1e-4)


def test_a_small_damping_is_raised(built):
    graph, *_ = built([1.0] * 6, lead=(2.0, 1e-6, 5e4))
    assert graph.node("plant").value("c_L")[0] == pytest.approx(0.01 * np.sqrt(1e5) * 1.002)


def test_a_soft_oscillator_is_one_too(built):
    """It is refused for its output, not for its frequency."""
    for lead in ((1e-5, 1e-5, 0.5), (1e-6, 1e-6, 1e-3)):
        with pytest.raises(InputError, match=r"than no output at all"):
            built([1.0] * 6, lead=lead)


@pytest.mark.parametrize("lead", [(-1.0, 1.0, 5e4), (1.0, 1.0, -5e4), (1.0, 1.0, (np.pi / H) ** 2)])
def test_an_oscillator_that_the_rows_cannot_hold_is_refused(built, lead):
    with pytest.raises(InputError, match=r"must have m_L > 0, k > 0 .* pi/h = 3.14e\+03 1/s\. Got m_L = "):
        built([1.0] * 6, lead=lead)


def test_a_longer_step_holds_less(built):
    fast = (1.0, 1.0, (0.9 * np.pi / H) ** 2)
    built([1.0] * 6, lead=fast)
    with pytest.raises(InputError, match=r"pi/h = 1.57e\+03"):
        built([1.0] * 6, lead=fast, stride=2)


def test_more_parameters_must_gain_by_the_bayesian_information_criterion():
    def trial(n, cost):
        return Trial(np.zeros(n), 1.0, cost, 100)

    worth = np.exp(-4 * np.log(100) / 100)  # four more: n ln(ratio) must exceed 4 ln n
    assert trial(12, 0.999 * worth).beats(trial(8, 1.0))
    assert not trial(12, 1.001 * worth).beats(trial(8, 1.0))
    one = np.exp(-np.log(100) / 100)
    assert trial(8, 0.999 * one).beats(trial(8, 1.0))
    assert not trial(8, 1.001 * one).beats(trial(8, 1.0))
    assert trial(8, 0.0).beats(trial(8, 1.0))


def test_the_stiffer_of_two_knots_counts_where_the_motion_turns():
    p = physical(np.array([-1.0, 0.5, 1e-4, 0.1, 0.9, 0.3, 0.2, 0.6]))
    assert p.tolist() == [1e-3, 0.5, 1e-3, 0.6, 0.9, 0.3, 0.2, 0.1]
    assert physical(np.array([1.0, 1, 1, -0.5, -0.6]))[3:].tolist() == [1e-3, -0.6]
    assert physical(np.array([1.0, 1, 1, 0.2, 0.3, 0.5, 0.6]))[3:].tolist() == [0.6, 0.5, 0.3, 0.2]
