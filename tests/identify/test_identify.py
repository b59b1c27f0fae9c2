"""Identification: every method recovers plants of its class, records provenance, refuses invalid data."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import plants
import pytest
from scipy.optimize import nnls

from hystfmu import Dataset, InputError, Model, signals
from hystfmu.identify import METHODS, fit, options
from hystfmu.identify.features.plays import thresholds
from hystfmu.identify.network.training import train
from hystfmu.identify.solvers.nonnegative import nonnegative


@pytest.fixture(scope="module")
def small():
    u = signals.training(30, 3)[::2]
    return Dataset.from_signal(u, plants.prandtl_ishlinskii(u), 1e-3, "ten plays")


QUICK = {
    **{key: {"iterations": 20, "starts": 1} for key in ("zhao_tan_mlp", "play_bank_mlp")},
    "preisach": {"n": 12, "widths": 8, "means": 3},
    "narx_network": {"iterations": 10},
}


KEYS = [k for k in METHODS if k != "auto" and not k.endswith("_oscillator")]  # no oscillator here


@pytest.mark.some(3)
@pytest.mark.parametrize("key", KEYS)
def test_every_method_reports_what_its_saved_model_does(key, small, tmp_path):
    data = small.with_train("100:900")
    fractions = []
    m = fit(data, key, seed=3, progress=fractions.append, **QUICK.get(key, {}))
    m.save(tmp_path / "m.model.toml")
    y = Model.load(tmp_path / "m.model.toml").predict(data.u)
    e = (y - data.y)[100:900]
    span = np.ptp(data.y[100:900])
    expected = [
        np.sqrt(np.mean(e**2)), np.abs(e).max(), 100 * np.sqrt(np.mean(e**2)) / span, 100 * np.abs(e).max() / span,
    ]  # fmt: skip
    got = [m.fit[k] for k in ("rms", "max", "rms_percent", "max_percent")]
    np.testing.assert_allclose(got, expected, rtol=1e-12)
    assert m.fit["parameters"] > 0
    assert m.fit["seconds"] >= 0
    p = m.provenance
    assert (p["data"], p["sha256"], p["rows"], p["train"], p["seed"]) == (
        "ten plays", data.sha256, len(y), "100:900", 3,
    )  # fmt: skip
    assert set(p["options"]) <= {o.name for o in options(key)}
    assert {"hystfmu", "numpy", "scipy", "python"} <= set(p["versions"])
    assert all(0 <= f <= 1 for f in fractions)
    assert ([i.name for i in m.graph.inputs], [o.name for o in m.graph.outputs]) == (["u"], ["y"])


@pytest.mark.parametrize("key", ["zhao_tan_mlp", pytest.param("bouc_wen", marks=pytest.mark.stress)])
def test_the_same_seed_gives_the_same_model(key, small):
    first, second = (fit(small, key, seed=4, **QUICK.get(key, {})) for _ in range(2))
    assert first.graph.to_bytes() == second.graph.to_bytes()


def test_rows_outside_train_do_not_change_the_weights(small):
    y = small.y.copy()
    y[:100] += 7
    a = fit(small.with_train("100:"), "prandtl_ishlinskii")
    b = fit(small.with_output(y).with_train("100:"), "prandtl_ishlinskii")
    assert a.graph.to_bytes() == b.graph.to_bytes()


@pytest.mark.parametrize(("key", "given", "words"), [
    ("nothing", {}, ("The model must be one of", "prandtl_ishlinskii", "bouc_wen", "Got 'nothing' instead.")),
    ("prandtl_ishlinskii", {"n": 5}, ("Got 'n' instead.", "N (an int in [1, 100000])")),
    ("prandtl_ishlinskii", {"N": 0}, ("'N'", "[1, 100000]", "0")),
    ("prandtl_ishlinskii", {"N": 2.5}, ("'N'", "an int", "2.5")),
    ("prandtl_ishlinskii", {"N": True}, ("'N'", "an int", "True")),
    ("zhao_tan_mlp", {"memory": "first"}, ("'memory'", "dominant, last", "first")),
    ("zhao_tan_mlp", {"decay": float("nan")}, ("'decay'", "nan")),
])  # fmt: skip
def test_wrong_keys_and_options_name_the_legal_ones(key, given, words, small):
    with pytest.raises(InputError) as e:
        fit(small, key, **given)
    for w in words:
        assert w in str(e.value)


@pytest.mark.turn("imports")
def test_nothing_heavy_is_imported():
    code = (
        "import sys, hystfmu.identify\nfrom hystfmu.identify.methods import bouc_wen, weighted_sums;"
        "sys.exit(any(m in sys.modules for m in ('torch', 'scipy.signal', 'plotly')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# ---- columns and least squares -------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [200, 2500])  # 2500: more columns than are solved at once
def test_nonnegative_meets_the_conditions_of_an_optimum(n):
    u = signals.decaying_sine(5, 0.1, 100)
    A, F = plants.plays(u, thresholds(u, n)), np.ones((len(u), 1))
    b = plants.prandtl_ishlinskii(u) + 0.01 * np.random.default_rng(n).normal(size=len(u))
    x, v = nonnegative(A, b, F)
    r = b - A @ x - F @ v
    gradient = A.T @ r / np.linalg.norm(A, axis=0) / np.linalg.norm(b)
    assert (x >= 0).all()
    assert abs(r.sum()) < 1e-9
    assert np.abs(gradient[x > 0]).max() < 1e-9
    assert gradient.max() < 1e-9, "a column left out would reduce the error"


@pytest.mark.parametrize("plant", ["dense", "sparse", "noisy"])
def test_nonnegative_against_scipy(plant):
    u = signals.decaying_sine(5, 0.1, 100)
    r = thresholds(u, 600)
    A, F, rng = plants.plays(u, r), np.ones((len(u), 1)), np.random.default_rng(7)
    w = rng.uniform(0, 1, 600) if plant == "dense" else np.where(np.arange(600) % 60 == 30, 1.0, 0.0)
    b = A @ w - 0.3 + (0.01 * rng.normal(size=len(u)) if plant == "noisy" else 0.0)
    x, v = nonnegative(A, b, F)
    residual = b - A @ x - F @ v
    both, _ = nnls(np.column_stack([A, F, -F]), b, maxiter=100000)
    least = np.linalg.norm(b - np.column_stack([A, F, -F]) @ both)
    assert (x >= 0).all()
    assert np.linalg.norm(residual) <= least * (1 + 1e-9) + 2e-13 * np.linalg.norm(b)
    # optimality conditions, up to rounding of the residual
    gradient = A.T @ residual / np.linalg.norm(A, axis=0)
    assert gradient.max() < 1e-12 * np.linalg.norm(b)
    assert abs(gradient @ x) < 1e-12 * np.linalg.norm(b) * x.sum()


@pytest.mark.stress
def test_a_dense_sum_of_5000_plays_is_fitted_exactly():
    u = signals.decaying_sine(10, 0.1)[:2000]
    r = thresholds(u, 5000)
    w = np.random.default_rng(1).uniform(0, 1 / 5000, 5000)
    y = 0.4 * u + plants.plays(u, r) @ w - 0.7
    m = fit(Dataset.from_signal(u, y), "prandtl_ishlinskii", N=5000)
    v = signals.decaying_sine(3, 0.2)
    assert np.abs(m.predict(u) - y).max() < 1e-12 * np.ptp(y)
    assert np.abs(m.predict(v) - (0.4 * v + plants.plays(v, r) @ w - 0.7)).max() < 1e-5 * np.ptp(y)


@pytest.mark.parametrize("n", [100, 400])
def test_weights_on_the_grid_are_recovered_exactly(n):
    c = np.arange(2000) / 200
    u = np.exp(-0.1 * c) * np.sin(2 * np.pi * c)
    r, w = thresholds(u, n), np.random.default_rng(n).uniform(0, 1 / n, n)
    y = 0.4 * u + plants.plays(u, r) @ w - 0.7
    m = fit(Dataset.from_signal(u, y), "prandtl_ishlinskii", N=n)
    assert m.fit["max_percent"] < 1e-11
    assert abs(m.graph.node("hysteresis").value("w0")[0] - 0.4) < 1e-6


# ---- training ------------------------------------------------------------------------------------------------------
def test_a_network_learns_a_network():
    rng = np.random.default_rng(2)
    x = rng.uniform(-1, 1, size=(500, 2))
    y = np.tanh(2 * x[:, 0] - x[:, 1]) + 0.5 * np.tanh(x[:, 1] + 0.3)
    network, rms = train(x, y, 2, "tanh", starts=4, iterations=200, decay=0.0)
    assert rms < 1e-6
    assert np.abs(network(x) - y).max() < 1e-5
    assert network.parameters == 9


def test_a_network_is_not_asked_outside_its_training_range(small):
    m = fit(small, "zhao_tan_mlp", **QUICK["zhao_tan_mlp"])
    inside = m.predict(np.linspace(0, 1.05, 500))
    beyond = m.predict(np.concatenate([np.linspace(0, 1.05, 500), np.linspace(1.05, 50, 500)]))
    assert np.abs(beyond).max() < 1.2 * np.abs(inside).max()


# ---- grey box ------------------------------------------------------------------------------------------------------
def test_a_model_of_a_removed_kind_still_runs(small, tmp_path):
    model = fit(small, "prandtl_ishlinskii")
    replace(model, key="prandtl_ishlinskii_asym").save(tmp_path / "old.model.toml")
    loaded = Model.load(tmp_path / "old.model.toml")
    assert loaded.key == "prandtl_ishlinskii_asym"
    assert loaded.predict(small.u).tobytes() == model.predict(small.u).tobytes()


def test_bouc_wen_parameters_up_to_their_redundancy():
    u = signals.training(40, 1)
    data = Dataset.from_signal(50 + 20 * u, plants.bouc_wen(u), 1e-3)
    m = fit(data, "bouc_wen")
    assert m.fit["max_percent"] < 1e-4
    v = m.graph.node("operator").values
    # with z = 1.3 z', A = 1: the exponent and gamma/beta stay as they are, (beta + gamma) 1.3^(n-1) is the new sum
    np.testing.assert_allclose(v["n"], 1.4, rtol=1e-4)
    np.testing.assert_allclose(v["gamma"] / v["beta"], 0.6 / 1.1, rtol=1e-4)
    np.testing.assert_allclose(v["beta"] + v["gamma"], 1.7 * 1.3**0.4, rtol=1e-4)
