"""Bouc-Wen grey box: the operator in closed form, the linear part eliminated, starts and limits of the search."""

from __future__ import annotations

from itertools import repeat

import numpy as np
import pytest
from searches import Spy

from hystfmu import Dataset
from hystfmu.identify.methods import bouc_wen

OPTIONS = {"starts": 3, "n_max": 6.0, "z0": None, "dead_band": 0.0}
LO, HI = [np.log(1e-3), -1.0, 1.0, -1.0], [np.log(1e2), 1.0, 6.0, 1.0]


def test_the_operator_rises_to_its_bound_as_an_exponential():
    u = np.linspace(0, 3, 301)
    values, z = bouc_wen.operator(u, np.array([np.log(0.5), 0.3, 1.0, 0.0]))
    assert values == pytest.approx({"A": 1.0, "beta": 1.4, "gamma": 0.6, "n": 1.0, "z0": 0.0, "u0": 0.0})
    assert z == pytest.approx(0.5 * -np.expm1(-u / 0.5), rel=1e-6, abs=1e-9)
    values, z = bouc_wen.operator(u, np.array([np.log(0.5), 0.25, 2.0, 1.0]))
    assert (values["beta"], values["gamma"]) == pytest.approx((3.0, 1.0))
    assert values["z0"] == pytest.approx(0.5 * 0.999999, rel=1e-12)  # inside the bound


@pytest.fixture
def data():
    rng = np.random.default_rng(2)
    u = 40 + 10 * np.sin(np.arange(400) / 9) * np.linspace(1, 0.4, 400)
    u[350:] += 100  # behind the training rows
    y = 3 * u + 20 * np.tanh(u - 40) + rng.normal(size=400)
    return Dataset(1e-3 * np.arange(400), u, y, train=slice(50, 300), unit_u="V", unit_y="um")


def projected(data, p):
    """Residuals of offset, linear term and z, relative to span and rows; and the coefficients."""
    seen = data.u[:300]
    x = (2 * data.u - seen.max() - seen.min()) / np.ptp(seen)
    a = np.column_stack([np.ones(400), x, bouc_wen.operator(x, p)[1]])
    c = np.linalg.lstsq(a[50:300], data.y[50:300], rcond=None)[0]
    return (a[50:300] @ c - data.y[50:300]) / (np.ptp(data.y[50:300]) / np.sqrt(250)), a @ c


@pytest.mark.parametrize("seed", [0, 5])
def test_starts_limits_and_the_best_to_the_end(monkeypatch, data, seed):
    spy, told = Spy(iter([0.3, 0.1, 0.2, 0.05]), 1e-3), []
    monkeypatch.setattr(bouc_wen, "least_squares", spy)
    graph, parameters, found = bouc_wen.build(data, OPTIONS, seed, told.append)
    rng = np.random.default_rng(seed)
    drawn = [[rng.uniform(np.log(0.05), np.log(3)), rng.uniform(0, 1), rng.uniform(1, 3), 0.0] for _ in range(2)]
    starts = [np.array([np.log(0.5), 0.5, 1.5, 0.0]), *map(np.array, drawn)]
    assert [c.x0 for c in spy.calls[:3]] == [pytest.approx(s, abs=1e-9) for s in starts]
    assert spy.calls[3].x0 == pytest.approx(starts[1] + 1e-3, abs=1e-9)  # the best
    for call, evaluations, tolerance in zip(spy.calls, [30] * 3 + [200], [1e-8] * 3 + [1e-13], strict=True):
        assert call.bounds[0] == pytest.approx(LO)
        assert call.bounds[1] == pytest.approx(HI)
        assert call.words["max_nfev"] == evaluations
        assert call.words["ftol"] == call.words["xtol"] == tolerance
        assert call.words["x_scale"].tolist() == [0.3] * 4
    p = np.array([np.log(0.7), 0.2, 1.3, 0.4])
    assert spy.calls[0].fun(p) == pytest.approx(projected(data, p)[0])
    assert told == pytest.approx([0, 1 / 3, 2 / 3])
    p = spy.calls[3].x0 + 1e-3
    assert graph.run(data.u, data.h).reshape(-1) == pytest.approx(projected(data, p)[1])
    assert parameters == 7
    scaled = graph.node("input").value("gain")[0] * data.u[:300] + graph.node("input").value("offset")[0]
    assert (scaled.min(), scaled.max()) == pytest.approx((-1.0, 1.0))
    bounded = {"ln z_max": (p[0], LO[0], HI[0]), "gamma / (beta + gamma)": (p[1], -1, 1), "n": (p[2], 0, 6)}
    assert found["bounded"] == {k: pytest.approx(v) for k, v in bounded.items()}
    assert (graph.inputs[0].unit, graph.inputs[0].start, graph.outputs[0].unit) == ("V", data.u[0], "um")


@pytest.mark.parametrize(("cost", "starts"), [(0.499e-8, 1), (0.501e-8, 3)])
def test_a_misfit_below_1e_4_of_the_span_ends_the_starts(monkeypatch, data, cost, starts):
    spy = Spy(repeat(cost))
    monkeypatch.setattr(bouc_wen, "least_squares", spy)
    bouc_wen.build(data, OPTIONS, 0, lambda f: None)
    assert len(spy.calls) == starts + 1


def test_a_given_z0_and_a_small_n_max_bound_the_search(monkeypatch, data):
    spy = Spy(repeat(1.0))
    monkeypatch.setattr(bouc_wen, "least_squares", spy)
    bouc_wen.build(data, {**OPTIONS, "z0": -0.5, "n_max": 1.2}, 0, lambda f: None)
    lo, hi = spy.calls[0].bounds
    assert (lo[3], hi[3]) == pytest.approx((-0.5 - 1e-9, -0.5 + 1e-9), abs=1e-12)
    assert hi[2] == 1.2
    for call in spy.calls:
        assert (call.x0 > lo).all()
        assert (call.x0 < hi).all()
    assert all(1 <= c.x0[2] <= 1.2 for c in spy.calls)
