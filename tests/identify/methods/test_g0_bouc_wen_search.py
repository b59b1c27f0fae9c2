"""Bouc-Wen and G0(s): what is eliminated, which delay is kept, the graph at rest."""

import numpy as np
import pytest
from behind_g0 import TRAIN, G, H, projected

import hystfmu as hy
from hystfmu.identify.estimate.dynamics import Dynamics


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
