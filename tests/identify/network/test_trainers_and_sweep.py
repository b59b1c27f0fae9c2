"""Trainers by name and the sweep over hidden sizes: settings of the optimisers, shares of the processes, units."""

from dataclasses import replace

import numpy as np
import pytest

from hystfmu.identify.network import readout as sweep
from hystfmu.identify.network.training import decay_for, train
from hystfmu.identify.solvers import trainers

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
CHOSEN = {
    "activation": "tanh",
    "starts": 1,
    "iterations": 5,
    "trainer": "levenberg_marquardt",
    "decay": None,
    "extra": 1,
}
X = 5 + 2 * RNG.normal(size=(80, 2))
Y = 100 + 7 * np.tanh(X[:, 0] - 5) + X[:, 1]
FITTED, VALIDATION = slice(5, 60), slice(60, 80)


def scaled(v):
    lo, hi = v[FITTED].min(axis=0), v[FITTED].max(axis=0)
    return (2 * v - lo - hi) / (hi - lo), (hi - lo) / 2


def error(hidden, decay=None, seed=0):
    (x, _), (y, half) = scaled(X), scaled(Y)
    decay = decay_for(y[FITTED]) if decay is None else decay
    net, _ = train(x[FITTED], y[FITTED], hidden, "tanh", 1, 5, decay, seed)
    return half**2 * np.mean((net(x[VALIDATION]) - y[VALIDATION]) ** 2)


@pytest.mark.parametrize(("decay", "seed"), [(None, 0), (0.01, 0), (None, 4)])
def test_every_size_has_the_error_of_its_own_network(decay, seed):
    told = []
    chosen = {**CHOSEN, "decay": decay}
    found = sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (2, 1, 3, 8), chosen, seed, told.append)
    assert list(found) == [2, 1, 3, 8]
    assert found == pytest.approx({n: error(n, decay, seed) for n in (1, 2, 3, 8)})
    assert told == sorted(told)
    assert len(told) == 4
    assert told[-1] == 1.0


def test_the_progress_weights_a_size_by_its_cost():
    told = []
    sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (3,), CHOSEN, progress=told.append)
    assert told == [1.0]
    told.clear()
    sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (1, 8), CHOSEN, progress=told.append)
    assert told[0] in (pytest.approx(11 / 85), pytest.approx(74 / 85))  # a size costs 10 + n^2
