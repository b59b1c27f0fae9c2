"""Plays and G0(s): what is eliminated, which thresholds are kept, the least weight of the input."""

from __future__ import annotations

import numpy as np
import pytest

from hystfmu import Dataset
from hystfmu.identify.features.dynamics import Dynamics
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.methods import g0_bouc_wen, g0_prandtl_ishlinskii
from hystfmu.identify.solvers.nonnegative import nonnegative

H = 1e-3
G = Dynamics(60.0, 0.4, 2.3 * H)
BW = {"n_max": 6.0, "hold": "foh", "delay_max": 10.0, "zeta_max": 5.0}
PI = {"N": 4, "w0_min": 0.0, "u0": None, "hold": "foh", "delay_max": 10.0, "zeta_max": 5.0}
TRAIN = slice(30, 400)


@pytest.fixture
def data():
    rng = np.random.default_rng(3)
    u = 20 + 4 * np.interp(np.arange(450), 15 * np.arange(31), rng.uniform(-1, 1, 31))
    u[420:] += 30  # behind the training rows
    y = G.filter((3 * u + np.tanh(u - 20))[:, None], H, "foh")[:, 0] + 0.01 * rng.normal(size=450)
    return Dataset(H * np.arange(450), u, y, train=TRAIN, unit_u="V", unit_y="um")


def scaled(u, rows):
    return (2 * u - u[rows].max() - u[rows].min()) / np.ptp(u[rows])


def projected(data, columns, g, rows=TRAIN):
    a = np.column_stack([np.ones(len(data.u)), g.filter(columns, H, "foh")])
    c = np.linalg.lstsq(a[rows], data.y[rows], rcond=None)[0]
    return (a @ c - data.y)[rows], a @ c


@pytest.fixture
def search(monkeypatch):
    """Replace the search of the dynamics; return what it was asked."""
    asked = []

    def found(residuals, data, options, progress, near=None):
        progress(0.5)
        asked.append((residuals, near))
        return G

    for kind in (g0_bouc_wen, g0_prandtl_ishlinskii):
        monkeypatch.setattr(kind, "search", found)
    return asked


@pytest.mark.parametrize("least", [0.0, 0.5])
@pytest.mark.parametrize("u0", [None, 18.0])
def test_plays_of_finer_thresholds_in_two_rounds(monkeypatch, search, data, least, u0):
    told = []
    monkeypatch.setattr(
        g0_prandtl_ishlinskii, "uncertainty", lambda residuals, *more: np.array([np.ptp(residuals(G)), 0, 0])
    )
    graph, parameters, found = g0_prandtl_ishlinskii.build(data, {**PI, "w0_min": least, "u0": u0}, 0, told.append)
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
    for kind, options in ((g0_prandtl_ishlinskii, PI),):
        for n, rows in ((5000, 5000), (5001, 2501)):
            search.clear()
            kind.build(Dataset.from_signal(u[:n], 2 * u[:n] + 1, H, "long"), options, 0, lambda f: None)
            assert len(search[0][0](G)) == rows
