"""Trainers by name and the sweep over hidden sizes: settings of the optimisers, shares of the processes, units."""

from __future__ import annotations

import io
from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
import scipy.optimize
import torch
from torch import nn

from hystfmu import InputError
from hystfmu.identify.network import hidden_sweep as sweep
from hystfmu.identify.network import torch_module
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


def test_lbfgs_stops_at_its_limits_only(monkeypatch):
    asked, told = [], []

    def minimize(function, p, jac, method, callback, options):
        asked.append((jac, method, options))
        for _ in range(7):
            callback(p)
        return SimpleNamespace(x=p + 1, fun=3)

    monkeypatch.setattr(scipy.optimize, "minimize", minimize)
    p, value = trainers.lbfgs(np.zeros(2), lambda p: (0.0, p), 5, told.append)
    assert asked == [(True, "L-BFGS-B", {"maxiter": 5, "maxfun": 100, "maxcor": 20, "ftol": 0.0, "gtol": 1e-12})]
    assert told == [0.2, 0.4, 0.6, 0.8, 1.0, 1.0, 1.0]
    assert (p.tolist(), value) == ([1.0, 1.0], 3.0)


# ---- modules of torch -----------------------------------------------------------------------------------------------
def linear(n_out=1):
    torch.manual_seed(0)
    return nn.Linear(4, n_out)


@pytest.mark.parametrize("trainer", ["levenberg_marquardt", "powell_beale", "lbfgs"])
def test_a_module_is_trained_in_place(trainer):
    module, told = linear(), []
    error = torch_module.train_module(module, A, B, trainer, 80, told.append)
    a = np.column_stack([A, np.ones(30)])
    best = np.linalg.lstsq(a, B, rcond=None)[0]
    assert module.weight.detach().numpy().ravel() == pytest.approx(best[:4], abs=1e-5)
    assert error == pytest.approx(np.sqrt(np.mean((a @ best - B) ** 2)))
    assert told == sorted(told)
    assert len(told) > 1


def test_a_module_with_two_outputs():
    y = np.column_stack([B, 2 * B + A[:, 0]])
    module = linear(2)
    error = torch_module.train_module(module, A, y)
    a = np.column_stack([A, np.ones(30)])
    left = y - a @ np.linalg.lstsq(a, y, rcond=None)[0]
    assert error == pytest.approx(np.sqrt(np.mean(left**2)))
    fit = torch_module.problem(module, A, y)
    p = nn.utils.parameters_to_vector(module.parameters()).detach().numpy()
    r, J = fit.residuals(p)
    assert (r.shape, J.shape) == ((60,), (60, 10))
    assert fit.errors(p) == pytest.approx(r)
    value, g = fit.gradient(p)
    assert value == pytest.approx(r @ r)
    assert g == pytest.approx(2 * J.T @ r)


@pytest.mark.parametrize(
    ("module", "x", "y", "trainer", "words"),
    [
        (linear(), A, B, "sgd", "must be one of levenberg_marquardt, powell_beale, lbfgs. Got 'sgd'"),
        (linear(), A[0], B, "lbfgs", r"Got \(4,\) and 30 rows"),
        (linear(), A, B[:9], "lbfgs", r"Got \(30, 4\) and 9 rows"),
        (nn.Identity(), A, B, "lbfgs", "must have weights to train"),
        (linear(2), A, B, "lbfgs", r"must give 1 values a row, as y has. Got \(2,\)"),
    ],
)
def test_what_a_module_must_be(module, x, y, trainer, words):
    with pytest.raises(InputError, match=words):
        torch_module.train_module(module, x, y, trainer)


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


@pytest.mark.parametrize("decay", [None, 0.01])
def test_few_small_networks_are_trained_here(monkeypatch, decay):
    monkeypatch.setattr(sweep, "_start", lambda: pytest.fail("no process is needed"))
    told = []
    found = sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (2, 1, 3), {**CHOSEN, "decay": decay}, progress=told.append)
    assert list(found) == [2, 1, 3]
    assert found == pytest.approx({n: error(n, decay) for n in (1, 2, 3)})
    assert told == pytest.approx([14 / 44, 25 / 44, 1.0])  # a size costs 10 + n^2
    again = sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (7,), CHOSEN, 4)  # 59
    assert again == pytest.approx({7: error(7, seed=4)})


class Process:
    """A process that runs `_work` when its input is closed."""

    started: ClassVar[list] = []

    def __init__(self, fails=False):
        self.fails, self.returncode = fails, 1 if fails else 0
        self.stdin, self.stderr = io.BytesIO(), io.BytesIO(b"first\nlast word\n" if fails else b"")
        self.stdin.close = self.run
        self.stdout = []
        self.started.append(self)

    def run(self):
        self.task = sweep._Task.read(io.BytesIO(self.stdin.getvalue()))
        if not self.fails:
            self.stdout = [f"{n} {self.task.score(n)!r}\n".encode() for n in self.task.counts]

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        return None


def test_more_are_shared_by_two_processes_the_longest_first(monkeypatch):
    Process.started = []
    monkeypatch.setattr(sweep, "_start", Process)
    found = sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (1, 2, 3, 4), CHOSEN, 2)  # 11 + 14 + 19 + 26 = 70
    assert found == pytest.approx({n: error(n, seed=2) for n in (1, 2, 3, 4)})
    assert list(found) == [1, 2, 3, 4]
    assert sorted(p.task.counts for p in Process.started) == [(3, 1), (4, 2)]
    task = Process.started[0].task
    assert task.options == {
        "activation": "tanh",
        "starts": 1,
        "iterations": 5,
        "decay": task.options["decay"],
        "seed": 2,
    }
    Process.started = []
    sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (8,), CHOSEN)
    assert [p.task.counts for p in Process.started] == [(8,)]


def test_a_process_that_fails_says_its_last_line(monkeypatch):
    monkeypatch.setattr(sweep, "_start", lambda: Process(fails=True))
    with pytest.raises(RuntimeError, match=r"training networks of \[8\] neurons: \['last word'\]"):
        sweep.hidden_sweep(X, Y, FITTED, VALIDATION, (8,), CHOSEN)


def test_a_process_prints_a_line_for_every_size(capsys):
    (x, _), (y, _) = scaled(X), scaled(Y)
    options = {"activation": "tanh", "starts": 1, "iterations": 3, "decay": 1e-6, "seed": 0}
    task = sweep._Task((x[FITTED], y[FITTED]), (x[VALIDATION], y[VALIDATION]), "lbfgs", options, ())
    content = io.BytesIO()
    task.write((2, 1), content)
    content.seek(0)
    sweep._work(content)
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [(int(n), float(e)) for n, e in lines] == [(n, task.score(n)) for n in (2, 1)]
    assert {f"{k}_NUM_THREADS": "1" for k in ("OMP", "OPENBLAS", "MKL")} == sweep.ONE_THREAD
