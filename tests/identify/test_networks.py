"""Networks: scalings and graph of the readout, training of a hidden layer, trainers, the sweep over hidden sizes."""

from dataclasses import replace

import numpy as np
import pytest

from hystfmu import Dataset, Node
from hystfmu.identify.network import readout, training
from hystfmu.identify.network import readout as sweep
from hystfmu.identify.network.training import Fit, Network, decay_for, start, train
from hystfmu.identify.solvers import trainers
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


# ---- training --------------------------------------------------------------------------------------------------------
SEED = int(np.random.default_rng().integers(1 << 31))


@pytest.fixture
def rng():
    print("seed", SEED)
    return np.random.default_rng(SEED)


def hidden_values(x, W1, b1, activation):
    a = x @ W1.T + b1
    return np.tanh(a) if activation == "tanh" else 1 / (1 + np.exp(-a))


@pytest.mark.parametrize(("activation", "size"), [("tanh", 1.4), ("sigmoid", 2.8)])
@pytest.mark.parametrize("along", [False, True])
def test_initial_weights_are_those_of_nguyen_and_widrow(rng, activation, size, along):
    x, y, hidden = rng.normal(size=(60, 3)), rng.normal(size=60), 7
    direction = np.array([1.0, -2.0, 0.5]) if along else None
    p = start(x, y, hidden, activation, rng, direction)
    net = Fit(x, y, hidden, activation).network(p)
    assert np.linalg.norm(net.W1, axis=1) == pytest.approx(size * hidden ** (1 / 3))
    passed = np.abs(x @ net.W1.T + net.b1).min(axis=0)  # each neuron is centred on a data point
    assert passed == pytest.approx(0, abs=1e-12)
    parallel = np.abs(net.W1 @ np.array([1.0, -2.0, 0.5])) / np.linalg.norm(net.W1, axis=1) / np.sqrt(5.25)
    assert (parallel[::2] == pytest.approx(1)) is along
    assert (parallel[1::2] < 0.9999).all()
    if along:
        signs = [np.sign(start(x, y, 40, activation, rng, direction)[:120:6]) for _ in range(3)]
        assert {-1.0, 1.0} == set(np.concatenate(signs).tolist())
    f = np.column_stack([hidden_values(x, net.W1, net.b1, activation), np.ones(60)])
    out = np.linalg.solve(f.T @ f + 60e-6 * np.eye(hidden + 1), f.T @ y)
    assert np.append(net.W2, net.b2) == pytest.approx(out, rel=1e-6, abs=1e-9)
    assert net(x) == pytest.approx(f[:, :-1] @ net.W2 + net.b2)
    assert net.parameters == len(p) == hidden * 5 + 1
    assert net.activation == activation


class Trainer:
    """Moves every weight by its number, and says which sums of squares it saw."""

    def __init__(self, costs):
        self.costs, self.calls = iter(costs), []

    def __call__(self, p, squares, iterations, progress):
        progress(0.0)
        progress(0.5)
        self.calls.append((np.array(p), squares, iterations))
        return p + 1, next(self.costs)


@pytest.mark.parametrize(("iterations", "first"), [(300, 30), (90, 10), (115, 11)])
def test_every_start_for_a_tenth_and_the_best_to_the_end(rng, iterations, first):
    x, y, told = rng.normal(size=(40, 2)), rng.normal(size=40), []
    trainer = Trainer([3.0, 1.0, 2.0, 10.0])
    net, rms = train(x, y, 4, "tanh", 3, iterations, seed=5, trainer=trainer, progress=told.append)
    assert [c[2] for c in trainer.calls] == [first] * 3 + [iterations]
    starts = [c[0] for c in trainer.calls]
    assert starts[3] == pytest.approx(starts[1] + 1)  # continues from the best
    again = np.random.default_rng(5)
    assert starts[0] == pytest.approx(start(x, y, 4, "tanh", again))
    assert starts[1] == pytest.approx(start(x, y, 4, "tanh", again))
    assert rms == pytest.approx(np.sqrt(10 / 40))
    assert net.W1.ravel() == pytest.approx(starts[1][:8] + 2)
    total = 3 * first + iterations
    parts = [(0, first), (first, first), (2 * first, first), (3 * first, iterations)]
    assert told == pytest.approx([(a + f * b) / total for a, b in parts for f in (0.0, 0.5)])


def test_a_single_start_is_trained_to_the_end_at_once(rng):
    x, y, told = rng.normal(size=(40, 2)), rng.normal(size=40), []
    trainer = Trainer([4.0])
    train(x, y, 3, "sigmoid", 1, 77, trainer=trainer, progress=told.append)
    assert [c[2] for c in trainer.calls] == [77]
    assert told == [0.0, 0.5]


def test_the_defaults_of_training(rng):
    x, y = rng.normal(size=(3001, 1)), rng.normal(size=3001)
    trainer = Trainer([1.0] * 5)
    net, _ = train(x, y, 2, trainer=trainer)
    assert [c[2] for c in trainer.calls] == [30] * 4 + [300]
    assert (
        len(trainer.calls[0][1].residuals(trainer.calls[0][0])[0]) == 1501 + 6
    )  # beyond 3000 rows every second, and the decay
    assert net.activation == "sigmoid"
    assert trainer.calls[0][0] == pytest.approx(start(x[::2], y[::2], 2, "sigmoid", np.random.default_rng(0)))
    train(x[:3000], y[:3000], 2, starts=1, trainer=(few := Trainer([1.0])))
    assert len(few.calls[0][1].residuals(few.calls[0][0])[0]) == 3000 + 6
    r, p = few.calls[0][1].residuals(few.calls[0][0])[0], few.calls[0][0]
    assert r[3000:] == pytest.approx(np.sqrt(1e-9 * 3000) * p[:-1])


@pytest.mark.parametrize(("rows", "activation"), [(20, "tanh"), (41, "sigmoid")])
def test_decay_adds_the_squared_weights_but_that_of_the_output_bias(rng, rows, activation):
    x, y, decay = rng.normal(size=(rows, 2)), rng.normal(size=rows), 0.03
    trainer = Trainer([1.0])
    train(x, y, 3, activation, 1, 5, decay, most_rows=40, trainer=trainer)
    kept = np.arange(0, rows, -(-rows // 40))
    p, squares, _ = trainer.calls[0]
    p = p + 0.1

    def wanted(q):
        net = Network(q[:6].reshape(3, 2), q[6:9], q[9:12], float(q[12]), activation)
        return np.sum((net(x[kept]) - y[kept]) ** 2) + decay * len(kept) * np.sum(q[:-1] ** 2)

    r, J = squares.residuals(p)
    assert squares.errors(p) == pytest.approx(r)
    assert r @ r == pytest.approx(wanted(p))
    value, g = squares.gradient(p)
    assert value == pytest.approx(wanted(p))
    slopes = [(wanted(p + e) - wanted(p - e)) / 2e-6 for e in 1e-6 * np.eye(len(p))]
    assert g == pytest.approx(slopes, rel=1e-6, abs=1e-6)
    assert 2 * J.T @ r == pytest.approx(slopes, rel=1e-6, abs=1e-6)


def test_the_decay_is_a_tenth_of_the_noise_variance(rng):
    y = rng.normal(size=500)
    third = y[3:] - 3 * y[2:-1] + 3 * y[1:-2] - y[:-3]
    sigma = np.median(np.abs(third)) / 0.6745
    assert decay_for(y) == pytest.approx(sigma**2 / 20 / 10)
    assert decay_for(1e-6 * y) == 1e-9
    assert decay_for(1e-6 * y, 1e-7) == 1e-7
    assert decay_for(y[:3], 1e-7) == 1e-7
    assert training.LEAST_DECAY == 1e-9


# ---- trainers and sweep ----------------------------------------------------------------------------------------------
RNG = np.random.default_rng(3)
A, B = RNG.normal(size=(30, 4)), RNG.normal(size=30)
BEST = np.linalg.lstsq(A, B, rcond=None)[0]


def gradient(p):
    r = A @ p - B
    return float(r @ r), 2 * A.T @ r


SQUARES = trainers.Squares(lambda p: (A @ p - B, A), lambda p: A @ p - B, gradient)


@pytest.mark.parametrize("name", ["levenberg_marquardt", "powell_beale", "lbfgs"])
def test_every_trainer_ends_at_the_least_squares(name):
    told = []
    p, cost = trainers.TRAINERS[name](np.zeros(4), SQUARES, 60, told.append)
    assert p == pytest.approx(BEST, abs=1e-5)
    assert cost == pytest.approx(np.sum((A @ BEST - B) ** 2))
    assert told == sorted(told)
    assert all(0 <= f <= 1 for f in told)


@pytest.mark.parametrize("name", ["powell_beale", "lbfgs"])
def test_a_gradient_saves_the_jacobian(name):
    p, _ = trainers.TRAINERS[name](np.zeros(4), replace(SQUARES, residuals=None), 60, lambda f: None)
    assert p == pytest.approx(BEST, abs=1e-5)


# ---- sweep ----------------------------------------------------------------------------------------------------------
OF_SWEEP = {
    "activation": "tanh", "starts": 1, "iterations": 5, "trainer": "levenberg_marquardt", "decay": None, "extra": 1,
}  # fmt: skip
X = 5 + 2 * RNG.normal(size=(80, 2))
Y = 100 + 7 * np.tanh(X[:, 0] - 5) + X[:, 1]
FITTED, VALIDATION = slice(5, 60), slice(60, 80)


def scaled_to_fitted(v):
    lo, hi = v[FITTED].min(axis=0), v[FITTED].max(axis=0)
    return (2 * v - lo - hi) / (hi - lo), (hi - lo) / 2


def error(hidden, decay=None, seed=0):
    (x, _), (y, half) = scaled_to_fitted(X), scaled_to_fitted(Y)
    decay = decay_for(y[FITTED]) if decay is None else decay
    net, _ = train(x[FITTED], y[FITTED], hidden, "tanh", 1, 5, decay, seed)
    return half**2 * np.mean((net(x[VALIDATION]) - y[VALIDATION]) ** 2)


@pytest.mark.parametrize(("decay", "seed"), [(None, 0), (0.01, 0), (None, 4)])
def test_every_size_has_the_error_of_its_own_network(decay, seed):
    told = []
    chosen = {**OF_SWEEP, "decay": decay}
    found = sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (2, 1, 3, 8), chosen, seed, told.append)
    assert list(found) == [2, 1, 3, 8]
    assert found == pytest.approx({n: error(n, decay, seed) for n in (1, 2, 3, 8)})
    assert told == sorted(told)
    assert len(told) == 4
    assert told[-1] == 1.0


def test_the_progress_weights_a_size_by_its_cost():
    told = []
    sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (3,), OF_SWEEP, progress=told.append)
    assert told == [1.0]
    told.clear()
    sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (1, 8), OF_SWEEP, progress=told.append)
    assert told[0] in (pytest.approx(11 / 85), pytest.approx(74 / 85))  # a size costs 10 + n^2
