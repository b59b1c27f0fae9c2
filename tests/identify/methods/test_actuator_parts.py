"""Structured actuator: columns and rows of a fit, the graph of a structure against `bent_sum`, dead zones of a bend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import legendre

from hystfmu import Dataset
from hystfmu.identify.cuts import validation_rows, without_outermost
from hystfmu.identify.estimate.dynamics import Dynamics
from hystfmu.identify.features import bent_chain, bent_sum
from hystfmu.identify.features.bent_chain import Parts, dead_zones
from hystfmu.identify.features.bent_sum import BentSum
from hystfmu.identify.features.plays import plays
from hystfmu.identify.methods import actuator

H = 1e-3
OPTIONS = {
    "N": 3, "operator": None, "bend": None, "creep": None, "dynamics": None, "covariates": None,
    "w0_min": 0.01, "u0": None,
    "hold": "foh", "delay_max": 10.0, "zeta_max": 5.0,
}  # fmt: skip
TRAIN = slice(40, 560)


def record(n=600, covariates=0, train=TRAIN):
    rng = np.random.default_rng(8)
    u = 30 + 6 * np.interp(np.arange(n), 12 * np.arange(n // 12 + 1), rng.uniform(-1, 1, n // 12 + 1))
    beside = {f"T{j} [degC]": rng.uniform(10 * j, 10 * j + 5, n) for j in range(covariates)}
    y = 5 + 2 * u + rng.normal(size=n)
    return Dataset(H * np.arange(n), u, y, train=train, unit_u="V", unit_y="um", covariates=beside or None)


# ---- dead zones -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("q", [[0.3, -1.2, 0.1], [0.0, 1.0, 0.0, 0.02], np.r_[1.0, np.ones(19)]])
def test_dead_zones_interpolate_the_polynomial_on_as_few_knots_as_serve(q):
    q = np.asarray(q)
    v = np.linspace(-1.4, 1.4, 801)
    fine = np.linspace(-1, 1, 4001)
    curve, m = legendre.legval(fine, q), 4
    while 2 * m < 400 and np.abs(
        np.interp(fine, k := np.linspace(-1, 1, 2 * m), legendre.legval(k, q)) - curve
    ).max() > (1e-5 * np.ptp(curve)):
        m *= 2
    knots = np.linspace(-1, 1, 2 * m)
    at = legendre.legval(knots, q)
    w0, r, w, at_0 = dead_zones(q)
    assert r == pytest.approx(knots[1:-1])
    zones = np.where(r > 0, np.maximum(v[:, None] - r, 0), np.minimum(v[:, None] - r, 0))
    inside = np.interp(v, knots, at)
    ends = [(at[1] - at[0]) / (knots[1] - knots[0]), (at[-1] - at[-2]) / (knots[-1] - knots[-2])]
    straight = np.where(v < -1, ends[0] * (v + 1), np.where(v > 1, ends[1] * (v - 1), 0.0))
    assert at_0 + w0 * v + zones @ w == pytest.approx(inside + straight, abs=1e-10)


@pytest.mark.parametrize(("q", "w0"), [([3.0], 0.0), ([3.0, 2.5], 2.5)])
def test_a_straight_bend_has_one_dead_zone_without_weight(q, w0):
    slope, r, w, at_0 = dead_zones(np.array(q))
    assert (slope, r.tolist(), w.tolist(), at_0) == (w0, [1.0], [0.0], 3.0)


# ---- columns and rows -----------------------------------------------------------------------------------------------
@pytest.mark.parametrize("u0", [None, 28.0])
def test_columns_are_scaled_plays_and_stops_up_to_the_last_training_row(u0):
    data = record(covariates=2)
    f = bent_chain.Fitting(data, {**OPTIONS, "u0": u0})
    u = data.u[TRAIN]
    x = (2 * data.u[:560] - u.max() - u.min()) / np.ptp(u)
    x0 = x[0] if u0 is None else (2 * 28.0 - u.max() - u.min()) / np.ptp(u)
    r = 0.98 * np.arange(1, 4) / 3
    assert f.r == pytest.approx(r)
    assert f.plays == pytest.approx(np.column_stack([x, plays(x, r, x0)]))
    assert f.stops == pytest.approx(np.column_stack([x, x[:, None] - plays(x, r, x0)]))
    T = data.covariates.values[:560]
    lo, hi = T[TRAIN].min(axis=0), T[TRAIN].max(axis=0)
    assert f.theta == pytest.approx((2 * T - lo - hi) / (hi - lo))
    held = np.zeros(560, dtype=bool)
    held[TRAIN] = validation_rows(data.u[TRAIN])
    held[TRAIN] = without_outermost(data.u[TRAIN], held[TRAIN])
    assert f.held.tolist() == np.flatnonzero(held).tolist()
    assert f.kept.tolist() == [k for k in range(40, 560) if not held[k]]


@pytest.mark.parametrize(("n", "stride"), [(6000, 1), (6001, 2)])
def test_more_than_6000_rows_are_thinned(n, stride):
    f = bent_chain.Fitting(record(n, train=None), OPTIONS)
    assert f.all.tolist() == list(range(0, n, stride))


def fitted(f, parts, seed=0):
    """Some weights for a structure."""
    rng = np.random.default_rng(seed)
    columns, m = f.columns(parts.operator), len(parts.levels)
    w = rng.uniform(0.1, 1, columns.shape[1])
    w /= np.abs(columns @ w).max()
    q = np.r_[0.4, 1.0, 0.3 * rng.normal(size=parts.degree - 1)]
    c = np.zeros((m, len(q)))
    for j, level in enumerate(parts.levels):
        c[j, : {"none": 0, "bend": len(q)}.get(level, 1)] = 0.2 + 0.1 * j
    g = np.array([0.3 if level == "gain" else 0.0 for level in parts.levels])
    return BentSum(w, q, rng.uniform(0.1, 0.3, len(parts.T)), 0.0, g, c)


STRUCTURES = [
    Parts(),
    Parts("stops", degree=3),
    Parts("relays", degree=3, T=(0.02,)),
    Parts(degree=3, T=(0.02, 0.2)),
    Parts(g=Dynamics(60.0, 0.5, 0.0)),
    Parts(degree=3, T=(0.05,), g=Dynamics(60.0, 0.5, 2 * H)),
    Parts(degree=3, levels=("gain", "none", "bend")),
    Parts(degree=3, T=(0.05,), g=Dynamics(80.0, 0.5, H), levels=("bend", "offset", "bend")),
    Parts("stops", levels=("none", "gain", "gain")),
]


@pytest.mark.parametrize("parts", STRUCTURES)
def test_the_graph_of_a_structure_runs_as_bent_sum_does(parts):
    data = record(covariates=len(parts.levels))
    f = bent_chain.Fitting(data, OPTIONS)
    s = fitted(f, parts)
    graph = bent_chain.chain(f, parts, s)
    used = [j for j, level in enumerate(parts.levels) if level != "none"]
    inputs = np.column_stack([data.u, data.covariates.values[:, used]])[:560]
    want = bent_sum.model(f.problem(parts, np.arange(560)), s)
    assert graph.run(inputs, H).reshape(-1) == pytest.approx(want, abs=2e-4)
    assert [i.name for i in graph.inputs] == ["u", *(f"T{j}" for j in used)]
    assert (graph.inputs[0].unit, graph.inputs[0].start, graph.outputs[0].unit) == ("V", data.u[0], "um")
    if used:  # covariates are limited to 5 % beyond the training range
        T = data.covariates.values[TRAIN][:, used]
        for end in (1, -1):
            edge = T.max(axis=0) if end > 0 else T.min(axis=0)
            near, far = edge + end * 0.05 * np.ptp(T, axis=0), edge + end * 10 * np.ptp(T, axis=0)
            runs = [graph.run(np.column_stack([data.u, np.tile(v, (600, 1))]), H) for v in (near, far)]
            assert runs[0] == pytest.approx(runs[1])
            for share in (0.0, 0.045):
                inner = edge + end * share * np.ptp(T, axis=0)
                inner = graph.run(np.column_stack([data.u, np.tile(inner, (600, 1))]), H)
                assert np.abs(inner - runs[0]).max() > 1e-4


def test_a_structure_in_words():
    data = record(covariates=2)
    words = actuator._named(Parts("stops", 3, (0.1, 1.0), Dynamics(1.0, 1.0, 0.0), ("none", "gain")), data)
    assert words == "stops, bend of degree 3, gain that follows T1, creep with 2 lags, G0(s) with delay"
    assert actuator._named(Parts(levels=("none", "none")), data) == "plays"


def test_a_fit_grows_from_one_with_fewer_parts(monkeypatch):
    data, asked = record(covariates=2), []
    f = bent_chain.Fitting(data, OPTIONS)
    monkeypatch.setattr(bent_sum, "fit", lambda p, start, wanted=0.0: (asked.append((p, start)), start)[1])
    start = replace(fitted(f, Parts(degree=3)), k=np.zeros(0), g=np.array([0.5, 0.6]))
    grown = f.fit(Parts(degree=5, T=(0.1, 1.0), levels=("gain", "bend")), f.kept, start)
    assert grown.q.tolist() == [*start.q, 0, 0]
    assert grown.k.tolist() == [1e-3, 1e-3]
    assert grown.g.tolist() == [0.5, 0.0]
    assert grown.c.shape == (2, 6)
    shrunk = f.fit(Parts(degree=1), f.kept, replace(start, k=np.zeros(0), g=np.zeros(0)))
    assert shrunk.q.tolist() == start.q[:2].tolist()
    kept = f.fit(Parts(degree=3, T=(0.1,)), f.kept, replace(start, k=np.array([0.7]), g=np.zeros(0)))
    assert kept.k.tolist() == [0.7]
    straight = f.fit(Parts(), f.kept)
    assert len(straight.q) == 2
    p = asked[0][0]
    assert (p.least, p.h, p.T.tolist()) == (0.01, H, [0.1, 1.0])
    assert p.y.tolist() == data.y[f.kept].tolist()
    assert asked[1][0].following.levels == ()
    trial = f.tried(Parts(degree=3), replace(start, k=np.zeros(0), g=np.zeros(0)))
    e = bent_sum.model(f.problem(Parts(degree=3), f.held), trial.fit) - data.y[f.held]
    assert trial.error == pytest.approx(np.sqrt(np.mean(e**2)))
