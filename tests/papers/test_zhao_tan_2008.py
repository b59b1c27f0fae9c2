"""Zhao & Tan 2008: option of the trainer, KP model, inverse networks, networks of the user, figures of the paper."""

import numpy as np
import plants
import pytest
import reasons

import hystfmu as hy
from hystfmu import Dataset, InputError, Model, signals
from hystfmu.identify import fit
from hystfmu.identify.methods.weighted_sums import grid
from hystfmu.identify.solvers.trainers import TRAINERS
from papers import zhao_tan_2008
from papers.table import figure

rng = np.random.default_rng(2)


# ---- trainers ------------------------------------------------------------------------------------------------------
def test_trainer_is_an_option_of_the_network_methods():
    u = signals.decaying_sine(4, 0.1, 100)
    data = Dataset.from_signal(u, plants.prandtl_ishlinskii(u))
    fits = {t: fit(data, "zhao_tan_mlp", trainer=t, starts=1, iterations=100, range=2.0).fit for t in TRAINERS}
    assert max(f["rms_percent"] for f in fits.values()) < 1.0
    assert len({f["rms"] for f in fits.values()}) == 3  # three different algorithms
    with pytest.raises(InputError, match=r"trainer.*levenberg_marquardt, powell_beale, lbfgs"):
        fit(data, "zhao_tan_mlp", trainer="adam")


# ---- inverse operators ---------------------------------------------------------------------------------------------
@pytest.mark.turn("figures of papers")
def test_network_with_the_exact_inverse_operator_inverts_better():
    plant = zhao_tan_2008.actuator(3.0)
    record = zhao_tan_2008.experiment(plant)
    swapped = Dataset.from_signal(5 + 3 * record.y, record.u, train=record.train)  # any unit and rest
    r = 0.9 * record.u
    worst = {}
    for operator in ("zhao_tan_inverse", "zhao_tan_inverse_reconstructed"):
        m = fit(swapped, "zhao_tan_mlp", operator=operator)
        worst[operator] = np.abs(plant(m.predict(5 + 3 * r)) - r)[50:].max()
    assert worst["zhao_tan_inverse"] < 0.015
    assert worst["zhao_tan_inverse_reconstructed"] > 2 * worst["zhao_tan_inverse"]
    with pytest.raises(InputError, match=r"'zhao_tan_inverse' must be 'dominant'. Got 'last' instead"):
        fit(swapped, "zhao_tan_mlp", operator="zhao_tan_inverse", memory="last")


# ---- KP model ------------------------------------------------------------------------------------------------------
def kp_loop(u, a, p1, p2, k0):
    """Kernels from their definition: rising and falling told apart."""
    ridge = lambda x: max(-1.0, min(1.0, 2 * x / a - 1))  # noqa: E731
    k, last, out = list(k0), None, []
    for v in u:
        for i in range(len(k)):
            if last is None or v >= last:
                k[i] = max(k[i], ridge(v - p2[i]))
            if last is None or v <= last:
                k[i] = min(k[i], ridge(v - p1[i]))
        last = v
        out.append(list(k))
    return np.array(out)


def test_kp_weights_are_found_again():
    """A plant of the same kernels, written as a loop: the fit is exact, also on a held-out signal."""
    a, p1, p2 = grid(-1.0, 1.0, 8)
    w = np.random.default_rng(4).uniform(0, 1, len(p1)) * (np.random.default_rng(5).random(len(p1)) < 0.4)
    k0 = np.clip(2 * (-(p1 + p2) / 2) / a - 1, -1, 1)
    plant = lambda u: 0.3 + kp_loop(u, a, p1, p2, k0) @ w  # noqa: E731
    u, v = signals.training(60, 1), signals.nested_reversals(30, 9)
    m = fit(Dataset.from_signal(u, plant(u)), "krasnoselskii_pokrovskii", levels=8)
    np.testing.assert_allclose(m.predict(v), plant(v), atol=1e-10)


# ---- networks of the user ------------------------------------------------------------------------------------------
def networks():
    nn = pytest.importorskip("torch").nn
    return {
        "2-12-1 sigmoid": (2, nn.Sequential(nn.Linear(2, 12), nn.Sigmoid(), nn.Linear(12, 1))),
        "deep, mixed, two outputs": (
            3,
            nn.Sequential(
                nn.Linear(3, 20), nn.Tanh(), nn.Sequential(nn.Linear(20, 15, bias=False), nn.ReLU(), nn.Identity()),
                nn.Linear(15, 9), nn.Sigmoid(), nn.Linear(9, 2)),
        ),
        "activations at both ends": (4, nn.Sequential(nn.Tanh(), nn.Linear(4, 6), nn.Linear(6, 3), nn.ReLU())),
        "one Linear": (5, nn.Linear(5, 3)),
    }  # fmt: skip


@pytest.mark.some(1)
@pytest.mark.parametrize(
    "name", ["2-12-1 sigmoid", "deep, mixed, two outputs", "activations at both ends", "one Linear"]
)
def test_from_torch_against_torch(name, tmp_path):
    torch = pytest.importorskip("torch")

    torch.manual_seed(0)
    n, module = networks()[name]
    model = hy.Model.from_torch(module, step=1e-3)
    x = rng.normal(size=(300, n))
    with torch.no_grad():
        expected = module.double()(torch.as_tensor(x)).numpy()
    got = model.predict(x).reshape(expected.shape)
    assert np.abs(got - expected).max() <= 1e-14 * np.abs(expected).max()
    model.save(tmp_path / "n.model.toml")
    assert (Model.load(tmp_path / "n.model.toml").predict(x).reshape(got.shape) == got).all()


def test_from_torch_refuses_what_it_cannot_do():
    nn = pytest.importorskip("torch").nn

    bad = nn.Sequential(nn.Linear(2, 3), nn.Tanh(), nn.Linear(3, 1))
    bad[0].weight.data[0, 0] = float("nan")
    for module, words in (
        (nn.Sequential(nn.Linear(2, 3), nn.Sequential(nn.GELU())), ("layer 1.0 (GELU)", "Sigmoid, Tanh, ReLU")),
        (nn.LSTM(2, 3), ("layer 0 (LSTM)",)),
        (
            nn.Sequential(nn.Linear(2, 3), nn.Tanh(), nn.Linear(4, 1)),
            ("layer 2 (Linear) must take the 3 values", "Got 4 instead."),
        ),
        (nn.Sequential(nn.Tanh()), ("must have a Linear layer",)),
        (bad, ("The weights of layer 0 (Linear) must be finite. Got nan instead.",)),
    ):
        with pytest.raises(InputError) as e:
            hy.Model.from_torch(module)
        for w in words:
            assert w in str(e.value)


# ---- the paper -----------------------------------------------------------------------------------------------------
@pytest.mark.stress  # its figures are also rows of the page of papers
def test_the_replica_is_of_the_papers_order():
    """463 Powell-Beale iterations of the 2-12-1 network: printed max 0.026735, RMS 0.01027 on another actuator."""
    data = zhao_tan_2008.experiment(zhao_tan_2008.actuator())
    assert (len(data.u), data.h, np.abs(data.u).max(), np.abs(data.y).max()) == (1200, 1e-3, 1.0, 1.0)
    fits = [fit(data, "zhao_tan_mlp", s, memory="last", **zhao_tan_2008.REPLICA).fit for s in range(3)]
    assert fits[0]["parameters"] == 49
    assert 0.026735 / 2 < np.median([f["max"] for f in fits]) < 2 * 0.026735
    assert 0.01027 / 2 < np.median([f["rms"] for f in fits]) < 2 * 0.01027


def test_the_actuator_is_the_one_of_the_tests():
    u = signals.nested_reversals(20, 1)
    r = np.linspace(0.1, 1, 10) / 2
    z = plants.plays(u, r).sum(axis=1) + 3 * u
    np.testing.assert_allclose(zhao_tan_2008.actuator(3.0)(u), z / (13 - r.sum()), atol=1e-14)


@pytest.mark.stress
def test_table_with_one_seed_and_less_data(monkeypatch):
    """The whole table runs in `make papers`; what needs much data is S2 of tests/identify/test_keys_heldout.py."""
    from papers import nested_loops, reproduce

    def short(data, key, *seed, **options):
        """Train banks of plays briefly; other tests check their errors."""
        return fit(data, key, *seed, **options, **({"starts": 1, "iterations": 5} if key == "play_bank_mlp" else {}))

    monkeypatch.setattr(nested_loops, "fit", short)
    monkeypatch.setattr(zhao_tan_2008, "SEEDS", 1)
    monkeypatch.setattr(zhao_tan_2008, "REVERSALS", 30)
    monkeypatch.setattr(zhao_tan_2008, "DECAYS", (0.01, 0.02))
    monkeypatch.setattr(zhao_tan_2008, "SPLITS", (1200,))
    fractions = []
    report = reproduce("zhao_tan_2008", progress=fractions.append)
    needs_data = ("operator and network", "the same", "bank of plays", "implicit", "training of")
    missed = [
        f"{r.quantity}: {r.verdict()}" for r in report.rows if not r.quantity.startswith(needs_data) and r.met is False
    ]
    assert not missed
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1
    scanned = {r.printed: r.scanned for r in report.rows if r.scanned}
    assert scanned.keys() == {0.026735, 0.01027, 0.0363, 0.013, 0.0617}
    assert {of for _, of in scanned.values()} == {2}, "two decays, or one other decay for each"
    assert len([r for r in report.rows if r.where == "scan"]) == 6
    assert {figure(d) for d in report.drawings} == {f"fig. {n}" for n in (1, 2, 5, 6, 7, 8, 9, 10, 12, 13)}
    reasons.check(report)
