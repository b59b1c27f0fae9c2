"""Network readout: scaling of features and output, limits, linear part; the graph gives the numbers of its equation."""

import numpy as np
import pytest

from hystfmu import Dataset
from hystfmu.graph import Node
from hystfmu.identify.network import readout
from hystfmu.identify.network.training import Network
from hystfmu.identify.solvers.trainers import TRAINERS

H = 1e-3
CHOSEN = {
    "hidden": 3, "activation": "tanh", "starts": 2, "iterations": 7, "decay": None, "trainer": "lbfgs", "margin": 0.1,
}  # fmt: skip


def test_columns_are_mapped_to_minus_one_and_one():
    v = np.array([[0.0, 5.0, 7.0], [4.0, 5.0, -1.0], [1.0, 5.0, 3.0]])
    middle, gain = readout.centre_and_gain(v)
    assert middle.tolist() == [2.0, 5.0, 3.0]
    assert gain.tolist() == [0.5, 0.0, 0.25]


@pytest.fixture
def made(monkeypatch):
    """Fit a readout on (u, a play of u[, a covariate]) with given network weights; return graph and calls."""

    def make(linear=False, covariate=False, chosen=CHOSEN, y=None, **more):
        rng = np.random.default_rng(3)
        u = 3 + np.cumsum(rng.normal(size=200)) / 4
        y = 7 + 2 * u**2 if y is None else y(u)
        T = {"T [degC]": np.linspace(20, 60, 200)} if covariate else None
        data = Dataset(H * np.arange(200), u, y, train=slice(20, 180), unit_u="V", unit_y="um", covariates=T)
        nodes = [Node("input", "scaling", {"n": 1}), Node("bank", "play_bank", {"n": 2}, {"r": [0.1, 0.4], "z0": u[0]})]
        front = readout.Features(nodes, [("input.y", "bank.u")], ["input.u"], ["input.y", "bank.z"], data)
        n, calls = 4 if covariate else 3, []
        net = Network(rng.normal(size=(3, n)), rng.normal(size=3), rng.normal(size=3), 0.4, "tanh")

        def train(*given):
            calls.append(given)
            return net, 0.01

        monkeypatch.setattr(readout, "train", train)
        return readout.fit_readout(front, data, chosen, 9, print, linear, **more), calls[0], net, front, data

    return make


def scaled(v):
    return (2 * v - v.max(axis=0) - v.min(axis=0)) / np.ptp(v, axis=0)


@pytest.mark.parametrize("linear", [False, True])
@pytest.mark.parametrize("covariate", [False, True])
def test_the_graph_is_the_network_between_its_scalings(made, linear, covariate):
    (graph, parameters, rms), call, net, front, data = made(linear, covariate)
    rows = data.train
    x, y = front.values[rows], data.y[rows]
    assert front.values.shape == (200, 4 if covariate else 3)
    assert front.values[:, 0] == pytest.approx(data.u)
    a = np.column_stack([scaled(x), np.ones(160)])
    weights = np.linalg.lstsq(a, y, rcond=None)[0] if linear else np.zeros(a.shape[1])
    rest = y - a @ weights
    assert call[0] == pytest.approx(scaled(x))
    assert call[1] == pytest.approx(scaled(rest), abs=1e-6)
    assert call[2:6] == (3, "tanh", 2, 7)
    assert call[6] == pytest.approx(readout.decay_for(call[1]))
    assert call[7] == 9
    assert (call[8] is None) is not linear
    assert linear is False or call[8] == pytest.approx(weights[:-1], rel=1e-6)
    assert call[9:] == (print, 3000, TRAINERS["lbfgs"])
    lo, hi = x.min(axis=0), x.max(axis=0)
    limited = np.clip(front.values, lo - 0.1 * (hi - lo), hi + 0.1 * (hi - lo))
    unit = (2 * limited - lo - hi) / (hi - lo)
    want = (rest.max() + rest.min()) / 2 + np.ptp(rest) / 2 * net(unit)
    if linear:
        plain = (2 * front.values - lo - hi) / (hi - lo)
        want = want + np.column_stack([plain, np.ones(200)]) @ weights
    u = np.column_stack([data.u, data.covariates.values])
    assert graph.run(u, H).reshape(-1) == pytest.approx(want, abs=1e-5)
    assert parameters == net.parameters + (len(weights) if linear else 0)
    driven = {end for _, end in graph.wires} | {end for port in graph.inputs for end in port.to}
    for node in graph.nodes:  # no input is left open
        if node.type in ("sum", "scaling", "mlp"):
            n = node.dims.get("n", node.dims.get("n_in"))
            assert n == 1 or {f"{node.name}.u[{k + 1}]" for k in range(n)} <= driven or f"{node.name}.u" in driven
    assert rms == pytest.approx(0.01 * np.ptp(rest) / 2, rel=1e-6)
    first, *others = graph.inputs
    assert (first.name, first.unit, first.start) == ("u", "V", data.u[0])
    assert graph.outputs[0].unit == "um"
    assert [i.name for i in others] == ["T"] * covariate
    assert [i.start for i in others] == pytest.approx(data.covariates.values[rows].mean(axis=0).tolist())


def test_given_decay_and_limits_of_rows(made):
    _, call, _, _, _ = made(chosen={**CHOSEN, "decay": 0.5}, most_rows=50)
    assert call[6] == 0.5
    assert call[10] == 50
    _, call, _, _, _ = made(least_decay=0.25)
    assert call[6] == 0.25


def test_what_the_linear_readout_explains_leaves_nothing(made):
    (graph, _, rms), call, _, _, data = made(y=lambda u: np.where(np.arange(200) < 20, u, 4.0))
    assert rms == 0.0
    assert call[1].tolist() == [0.0] * 160
    assert graph.run(data.u[20:], H).reshape(-1) == pytest.approx(np.full(180, 4.0))
