"""Training of a network with one hidden layer: initial weights, stages, decay, thinning of rows, reported fractions."""

import numpy as np
import pytest

from hystfmu.identify.network import training
from hystfmu.identify.network.training import Fit, Network, decay_for, start, train

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


@pytest.mark.parametrize("rows", [20, 41])
def test_decay_adds_the_squared_weights_but_that_of_the_output_bias(rng, rows):
    x, y, decay = rng.normal(size=(rows, 2)), rng.normal(size=rows), 0.03
    trainer = Trainer([1.0])
    train(x, y, 3, "tanh", 1, 5, decay, most_rows=40, trainer=trainer)
    kept = np.arange(0, rows, -(-rows // 40))
    p, squares, _ = trainer.calls[0]
    p = p + 0.1

    def wanted(q):
        net = Network(q[:6].reshape(3, 2), q[6:9], q[9:12], float(q[12]), "tanh")
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
