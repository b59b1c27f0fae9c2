"""Bouc-Wen grey box: the shape in closed form, limits of the search, what the training rows decide."""

import numpy as np
import pytest

import hystfmu as hy
from hystfmu.identify.methods import bouc_wen


@pytest.fixture
def data():
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


def test_graph_and_limits(data):
    model = hy.fit(data, "bouc_wen", seed=5, starts=3, dead_band=0.0)
    g = model.graph
    scaled = g.node("input").value("gain")[0] * data.u[:300] + g.node("input").value("offset")[0]
    assert (scaled.min(), scaled.max()) == pytest.approx((-1.0, 1.0))
    assert [n.name for n in g.nodes] == ["input", "operator", "readout"]
    assert (g.inputs[0].unit, g.inputs[0].start, g.outputs[0].unit) == ("V", data.u[0], "um")
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
    c = np.linalg.lstsq(a, data.y[50:300], rcond=None)[0]
    assert [*g.node("readout").value("offset"), *g.node("readout").value("k")] == pytest.approx(c)


def test_a_given_z0_and_a_small_n_max_bound_the_search(data):
    model = hy.fit(data, "bouc_wen", z0=-0.5, n_max=1.2, dead_band=0.0)
    node = model.graph.node("operator")
    bound = (node.value("beta") + node.value("gamma")) ** (-1 / node.value("n"))
    assert node.value("z0") == pytest.approx(-0.5 * bound, rel=1e-5)
    assert 1.0 <= node.value("n")[0] <= 1.2


def test_more_starts_are_never_worse_and_a_seed_repeats(data):
    few, many, again = (hy.fit(data, "bouc_wen", starts=n, dead_band=0.0) for n in (1, 6, 6))
    assert many.fit["rms"] <= few.fit["rms"] * (1 + 1e-3)
    assert (many.predict(data.u) == again.predict(data.u)).all()
