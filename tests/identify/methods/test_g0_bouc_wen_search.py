"""Bouc-Wen and G0(s): what is eliminated, where the searches start, which delay is kept, the graph at rest."""

from __future__ import annotations

from itertools import repeat

import numpy as np
import pytest
from behind_g0 import BW, TRAIN, H, projected, scaled
from searches import Spy

from hystfmu.identify.features.dynamics import Dynamics
from hystfmu.identify.features.identifiable import correlation_time
from hystfmu.identify.methods import g0_bouc_wen
from hystfmu.identify.methods.bouc_wen import operator


def test_dynamics_by_a_bank_then_the_shape_then_everything(monkeypatch, search, data):
    spy, told = Spy(iter([0.3, 0.1, 0.2, 0.05, 0.05]), 1e-4), []
    monkeypatch.setattr(g0_bouc_wen, "least_squares", spy)
    graph, parameters, found = g0_bouc_wen.build(data, BW, 0, told.append)
    x = scaled(data.u, slice(0, 400))
    shapes = [(z, s, n) for z in (0.1, 0.3, 1, 3) for s in (0, 0.5) for n in (1, 2)]
    bank = [operator(x, np.array([np.log(z), s, n, 0.0]))[1] for z, s, n in shapes]
    want = projected(data, np.column_stack([x, *bank]), Dynamics(50.0, 0.6, H))[0]
    assert search[0][0](Dynamics(50.0, 0.6, H)) == pytest.approx(want, abs=1e-6)
    dynamics = [np.log(60.0), np.log(0.4), 2.3]
    starts = [[np.log(0.5), 0.5, 1.5, 0], [np.log(0.15), 0.2, 1.2, 0], [np.log(2), 0.5, 1.5, 0]]
    assert [c.x0 for c in spy.calls[:3]] == [pytest.approx(s, abs=1e-8) for s in starts]
    assert spy.calls[3].x0 == pytest.approx([*dynamics, *(np.array(starts[1]) + 1e-4)], abs=1e-6)
    lo, hi = spy.calls[3].bounds
    assert lo == pytest.approx([np.log(1 / 0.37), np.log(0.01), 0, np.log(1e-3), -1, 1, -1])
    assert hi == pytest.approx([np.log(500), np.log(5), 10, np.log(100), 1, 6, 1])
    for c in spy.calls[:3]:
        assert (c.bounds[0].tolist(), c.bounds[1].tolist()) == (lo[3:].tolist(), hi[3:].tolist())
        assert (c.words["ftol"], c.words["xtol"], c.words["max_nfev"]) == (1e-8, 1e-8, 15)
        assert c.words["x_scale"].tolist() == [0.3] * 4
    for c, kept in zip(spy.calls[3:], ([0, 1, 2, 3, 4, 5, 6], [0, 1, 3, 4, 5, 6]), strict=True):
        assert (c.words["jac"], c.words["ftol"], c.words["max_nfev"]) == ("3-point", 1e-12, 60)
        assert c.words["x_scale"].tolist() == np.array([0.1, 0.1, 0.3, 0.3, 0.3, 0.3, 0.3])[kept].tolist()
        assert c.bounds[0].tolist() == lo[kept].tolist()
    assert spy.calls[4].x0 == pytest.approx((spy.calls[3].x0 + 1e-4)[[0, 1, 3, 4, 5, 6]])
    assert told == pytest.approx([0.25, 0.6, 0.7, 0.8, 0.9])
    p = spy.calls[3].x0 + 0.01
    e, _ = projected(data, np.column_stack([x, operator(x, p[3:])[1]]), Dynamics.at(p, H))
    assert spy.calls[3].fun(p) == pytest.approx(e / np.ptp(data.y[TRAIN]) / np.sqrt(370), abs=1e-8)
    assert parameters == 9  # the delay gains nothing
    q = np.insert(spy.calls[4].x0 + 1e-4, 2, 0.0)
    g = Dynamics.at(q, H)
    y = projected(data, np.column_stack([x, operator(x, q[3:])[1]]), g)[1]
    assert graph.run(data.u, H).reshape(-1) == pytest.approx(y, abs=1e-5)
    assert (found["f_n"], found["zeta"], found["delay"]) == pytest.approx((g.f_n, g.zeta, 0.0))
    inner = graph.node("input").value("gain")[0] * data.u[:400] + graph.node("input").value("offset")[0]
    assert (inner.min(), inner.max()) == pytest.approx((-1.0, 1.0))
    assert set(found["bounded"]) == {"ln z_max", "gamma / (beta + gamma)", "n"}


@pytest.mark.parametrize("kept", [True, False])
def test_a_delay_stays_if_it_gains_more_than_the_logarithm_of_the_independent_rows(monkeypatch, search, data, kept):
    spy = Spy(repeat(1.0))
    monkeypatch.setattr(g0_bouc_wen, "least_squares", spy)
    g0_bouc_wen.build(data, BW, 0, lambda f: None)
    rows = 370 / correlation_time(spy.calls[3].fun(spy.calls[3].x0))
    ratio = np.exp(np.log(rows) / rows) * (1.001 if kept else 0.999)
    monkeypatch.setattr(g0_bouc_wen, "least_squares", Spy(iter([1.0, 1.0, 1.0, 1.0, ratio])))
    graph, parameters, found = g0_bouc_wen.build(data, BW, 0, lambda f: None)
    assert parameters == (10 if kept else 9)
    assert (found["delay"] > 0) is kept
    if kept:  # the delay block starts with what the hysteresis gives at the first input
        assert graph.node("delay").dims["n"] == 2
        first = graph.run(np.full(5, data.u[0]), H).reshape(-1)
        assert first == pytest.approx(np.full(5, first[-1]), rel=1e-9)


@pytest.mark.parametrize(("misfit", "starts"), [(2.99e-3, 1), (3.01e-3, 3)])
def test_a_small_misfit_ends_the_starts(monkeypatch, search, data, misfit, starts):
    spy = Spy(repeat(misfit**2 / 2))
    monkeypatch.setattr(g0_bouc_wen, "least_squares", spy)
    g0_bouc_wen.build(data, BW, 0, lambda f: None)
    assert len(spy.calls) == starts + 2
