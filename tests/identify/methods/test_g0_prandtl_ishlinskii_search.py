"""Plays and G0(s): what is eliminated, which thresholds are kept, the least weight of the input."""

import numpy as np
import pytest
from behind_g0 import PI, TRAIN, G, H, scaled

from hystfmu import Dataset
from hystfmu.identify.estimate.dynamics import Dynamics
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.methods import weighted_sums
from hystfmu.identify.methods.weighted_sums import g0_prandtl_ishlinskii
from hystfmu.identify.solvers.nonnegative import nonnegative


@pytest.mark.parametrize("least", [0.0, 0.5])
@pytest.mark.parametrize("u0", [None, 18.0])
def test_plays_of_finer_thresholds_in_two_rounds(monkeypatch, search, data, least, u0):
    told = []
    monkeypatch.setattr(weighted_sums, "uncertainty", lambda residuals, *more: np.array([np.ptp(residuals(G)), 0, 0]))
    graph, parameters, found = g0_prandtl_ishlinskii(data, {**PI, "w0_min": least, "u0": u0}, 0, told.append)
    x, half = scaled(data.u, TRAIN), np.ptp(data.u[TRAIN]) / 2
    x0 = x[0] if u0 is None else (2 * u0 - data.u[TRAIN].max() - data.u[TRAIN].min()) / np.ptp(data.u[TRAIN])

    def solved(r, g=G):
        filtered = g.filter(np.column_stack([x, plays(x, r, x0)]), H, "foh")
        w, (offset,) = nonnegative(
            filtered[TRAIN], data.y[TRAIN] - least * half * filtered[TRAIN, 0], np.ones((370, 1))
        )
        w[0] += least * half
        return w, filtered @ w + offset

    first = thresholds(x[TRAIN], 4)
    g = Dynamics(50.0, 0.6, H)
    assert search[0][0](g) == pytest.approx((solved(first, g)[1] - data.y)[TRAIN], abs=1e-9)
    assert search[0][1] is None
    assert len(search) == 3
    assert [near for _, near in search[1:]] == [G, G]
    fine = thresholds(x[TRAIN], 32)
    kept = fine[solved(fine)[0][1:] > 0]
    w, y = solved(kept)
    assert graph.node("hysteresis").value("r") == pytest.approx(kept)
    assert graph.node("hysteresis").value("w0")[0] == pytest.approx(w[0])
    assert w[0] >= least * half
    assert graph.run(data.u, H).reshape(-1)[2:] == pytest.approx(y[2:], abs=1e-7)
    assert parameters == len(kept) + 5
    inner = graph.node("input").value("gain")[0] * data.u + graph.node("input").value("offset")[0]
    assert inner == pytest.approx(x)
    assert told == pytest.approx([0.25, 0.75, 1.0])
    assert (found["f_n"], found["zeta"], found["delay"]) == (G.f_n, G.zeta, G.delay)
    assert len(found["warnings"]) == 1  # a standard error of the size of y
    rest = graph.run(np.full(5, data.u[0]), H).reshape(-1)
    if u0 is None:
        assert rest == pytest.approx(np.full(5, rest[-1]), rel=1e-9)


def test_more_than_5000_rows_are_thinned(search):
    u = 3 * np.sin(np.arange(5001) / 30)
    for n, rows in ((5000, 5000), (5001, 2501)):
        search.clear()
        g0_prandtl_ishlinskii(Dataset.from_signal(u[:n], 2 * u[:n] + 1, H, "long"), PI, 0, lambda f: None)
        assert len(search[0][0](G)) == rows
