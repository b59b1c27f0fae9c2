"""Bouc-Wen, and operators in front of G0(s): what is eliminated, which delay is kept, limits of the search."""

import numpy as np
import pytest

import hystfmu as hy
from hystfmu import Dataset
from hystfmu.identify.estimate.dynamics import Dynamics
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.methods import bouc_wen, weighted_sums
from hystfmu.identify.methods.weighted_sums import g0_prandtl_ishlinskii
from hystfmu.identify.solvers.nonnegative import nonnegative

H = 1e-3
G = Dynamics(60.0, 0.4, 2.3 * H)
PI = {"N": 4, "w0_min": 0.0, "u0": None, "hold": "foh", "delay_max": 10.0, "zeta_max": 5.0}
TRAIN = slice(30, 400)


def scaled(u, rows):
    return (2 * u - u[rows].max() - u[rows].min()) / np.ptp(u[rows])


def projected(data, columns, g, rows=TRAIN):
    a = np.column_stack([np.ones(len(data.u)), g.filter(columns, H, "foh")])
    c = np.linalg.lstsq(a[rows], data.y[rows], rcond=None)[0]
    return (a @ c - data.y)[rows], a @ c


# ---- fixtures --------------------------------------------------------------------------------------------------------
@pytest.fixture
def data():
    rng = np.random.default_rng(3)
    u = 20 + 4 * np.interp(np.arange(450), 15 * np.arange(31), rng.uniform(-1, 1, 31))
    u[420:] += 30  # behind the training rows
    y = G.filter((3 * u + np.tanh(u - 20))[:, None], H, "foh")[:, 0] + 0.01 * rng.normal(size=450)
    return Dataset(H * np.arange(450), u, y, train=TRAIN, unit_u="V", unit_y="um")


@pytest.fixture
def search(monkeypatch):
    """Replace the search of the dynamics; return what it was asked."""
    asked = []

    def found(residuals, data, options, progress, near=None):
        progress(0.5)
        asked.append((residuals, near))
        return G

    monkeypatch.setattr(weighted_sums, "search", found)
    return asked


# ---- Bouc-Wen and G0 -------------------------------------------------------------------------------------------------
def responses(model, data):
    """The scaled input and z of the operator of a model."""
    g = model.graph
    x = g.node("input").value("gain")[0] * data.u + g.node("input").value("offset")[0]
    values = {k: g.node("operator").value(k)[0] for k in ("beta", "gamma", "n", "z0", "u0")}
    return np.column_stack([x, hy.blocks.BoucWen(**values)(x)[:, 1]])


@pytest.fixture(scope="module")
def device():
    """A device of the class, its record with a delay of 2.3 samples, and one without."""
    rng = np.random.default_rng(3)
    u = 20 + 4 * np.interp(np.arange(450), 15 * np.arange(31), rng.uniform(-1, 1, 31))
    u[420:] += 30  # behind the training rows
    x = 3 * u + 4 * hy.blocks.BoucWen(beta=0.5, gamma=0.2, n=1.5, u0=u[0])(u)[:, 1]
    noise = 0.01 * rng.normal(size=450)

    def record(g):
        y = g.filter(x[:, None], H, "foh")[:, 0] + noise
        return hy.Dataset(H * np.arange(450), u, y, train=TRAIN, unit_u="V", unit_y="um")

    return record(G), record(Dynamics(60.0, 0.4, 0.0))


@pytest.fixture(scope="module")
def late(device):
    return hy.fit(device[0], "g0_bouc_wen")


@pytest.mark.turn("parameters of a kind")
def test_the_dynamics_are_found_and_the_linear_part_is_that_of_least_squares(device, late):
    assert late.fit["f_n"] == pytest.approx(60.0, rel=0.01)
    assert late.fit["zeta"] == pytest.approx(0.4, rel=0.02)
    assert late.fit["delay"] == pytest.approx(2.3 * H, abs=0.1 * H)
    assert late.fit["parameters"] == 10
    g = Dynamics(late.fit["f_n"], late.fit["zeta"], late.fit["delay"])
    y = projected(device[0], responses(late, device[0]), g)[1]
    assert late.predict(device[0].u) == pytest.approx(y, abs=1e-5)
    assert set(late.fit["free"]) >= {"operator.beta", "operator.n", "hysteresis.k[2]", "readout.offset"}


def test_the_delay_block_starts_with_what_the_hysteresis_gives_at_the_first_input(device, late):
    assert [n.name for n in late.graph.nodes][-2:] == ["delay", "readout"]
    assert late.graph.node("delay").dims["n"] == 2
    first = late.graph.run(np.full(5, device[0].u[0]), H).reshape(-1)
    assert first == pytest.approx(np.full(5, first[-1]), rel=1e-9)


def test_a_delay_that_gains_nothing_is_left_out(device):
    model = hy.fit(device[1], "g0_bouc_wen")
    assert model.fit["parameters"] == 9
    assert model.fit["delay"] == 0.0
    assert [n.name for n in model.graph.nodes if n.type == "delay"] == []
    assert model.fit["f_n"] == pytest.approx(60.0, rel=0.01)


def test_the_training_rows_alone_are_scaled_and_fitted(device, late):
    inner = late.graph.node("input")
    x = inner.value("gain")[0] * device[0].u[:400] + inner.value("offset")[0]
    assert (x.min(), x.max()) == pytest.approx((-1.0, 1.0))


# ---- plays and G0 ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("least", [0.0, 0.5])
@pytest.mark.parametrize("u0", [None, 18.0])
def test_plays_of_finer_thresholds_in_two_rounds(monkeypatch, search, data, least, u0):
    told = []
    monkeypatch.setattr(
        weighted_sums, "uncertainty", lambda plays, *more: np.array([np.ptp(plays.project(G)[0]), 0, 0])
    )
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
    assert search[0][0].project(g)[0] == pytest.approx((solved(first, g)[1] - data.y)[TRAIN], abs=1e-9)
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
        assert len(search[0][0].project(G)[0]) == rows


# ---- Bouc-Wen alone --------------------------------------------------------------------------------------------------
@pytest.fixture
def steep():
    rng = np.random.default_rng(2)
    u = 40 + 10 * np.sin(np.arange(400) / 9) * np.linspace(1, 0.4, 400)
    u[350:] += 100  # behind the training rows
    y = 3 * u + 20 * np.tanh(u - 40) + rng.normal(size=400)
    return hy.Dataset(1e-3 * np.arange(400), u, y, train=slice(50, 300), unit_u="V", unit_y="um")


def test_the_shape_rises_to_its_bound_as_an_exponential():
    u = np.linspace(0, 3, 301)
    for p, found in (
        ([np.log(0.5), 0.3, 1.0, 0.0], (1.4, 0.6, 1.0, 0.0)),
        ([np.log(0.5), 0.25, 2.0, 1.0], (3, 1, 2, 0.5)),
    ):
        values = bouc_wen.shape(np.array(p), "h")
        assert tuple(values[f"h.{k}"] for k in ("beta", "gamma", "n", "z0")) == pytest.approx(found, rel=1e-5)
    z = hy.blocks.BoucWen(beta=1.4, gamma=0.6, n=1.0)(u)[:, 1]
    assert z == pytest.approx(0.5 * -np.expm1(-u / 0.5), rel=1e-6, abs=1e-9)


def test_graph_and_limits(steep):
    model = hy.fit(steep, "bouc_wen", seed=5, starts=3, dead_band=0.0)
    g = model.graph
    scaled = g.node("input").value("gain")[0] * steep.u[:300] + g.node("input").value("offset")[0]
    assert (scaled.min(), scaled.max()) == pytest.approx((-1.0, 1.0))
    assert [n.name for n in g.nodes] == ["input", "operator", "readout"]
    assert (g.inputs[0].unit, g.inputs[0].start, g.outputs[0].unit) == ("V", steep.u[0], "um")
    assert model.fit["parameters"] == 7
    assert set(model.fit["free"]) == {
        *(f"operator.{k}" for k in ("beta", "gamma", "n", "z0")),
        *("readout.k[1]", "readout.k[2]", "readout.offset"),
    }
    # no linear combination of the same responses is closer
    x, z = scaled, np.asarray(g.node("operator").value("z0"))
    values = {k: g.node("operator").value(k)[0] for k in ("A", "beta", "gamma", "n", "u0")}
    z = hy.blocks.BoucWen(**values, z0=z[0])(x)[:, 1]
    a = np.column_stack([np.ones(250), x[50:], z[50:]])
    c = np.linalg.lstsq(a, steep.y[50:300], rcond=None)[0]
    assert [*g.node("readout").value("offset"), *g.node("readout").value("k")] == pytest.approx(c)


def test_a_given_z0_and_a_small_n_max_bound_the_search(steep):
    model = hy.fit(steep, "bouc_wen", z0=-0.5, n_max=1.2, dead_band=0.0)
    node = model.graph.node("operator")
    bound = (node.value("beta") + node.value("gamma")) ** (-1 / node.value("n"))
    assert node.value("z0") == pytest.approx(-0.5 * bound, rel=1e-5)
    assert 1.0 <= node.value("n")[0] <= 1.2


@pytest.mark.turn("dynamics of a fit")
def test_more_starts_are_never_worse_and_a_seed_repeats(steep):
    few, many, again = (hy.fit(steep, "bouc_wen", starts=n, dead_band=0.0) for n in (1, 6, 6))
    assert many.fit["rms"] <= few.fit["rms"] * (1 + 1e-3)
    assert (many.predict(steep.u) == again.predict(steep.u)).all()
