"""Benchmarks and model selection: memory class from minor loops, warnings, oscillator, measured piezo stack."""

import json

import numpy as np
import plants
import pytest
from click.testing import CliRunner
from invoked import invoked

from hystfmu import Dataset, Graph, InputError, Model, Node, signals, synthetic
from hystfmu.cli import main
from hystfmu.data.reversals import turning_points
from hystfmu.identify import auto, fit
from hystfmu.identify.excitation.minor_loops import examine
from hystfmu.identify.race import AS_GOOD
from papers import boucwen_benchmark, dbo_piezo, reproduce, sums_of_plays

QUICK = ("prandtl_ishlinskii", "bouc_wen", "polynomial_narx")


def rms(x):
    return np.sqrt(np.mean(np.square(x)))


# ---- excitation ----------------------------------------------------------------------------------------------------
def test_turning_points_under_noise_and_on_plateaus():
    levels = [0.0, 1.0, -0.5, 0.7, 0.7, -1.0, 0.2]
    u = signals.ramps(levels, 0.01)
    np.testing.assert_allclose(u[turning_points(u, 1e-3)], [1.0, -0.5, 0.7, -1.0], atol=1e-12)
    noisy = u + 0.005 * np.random.default_rng(0).normal(size=len(u))
    np.testing.assert_allclose(noisy[turning_points(noisy, 0.05)], [1.0, -0.5, 0.7, -1.0], atol=0.02)


@pytest.mark.some(3)
@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize(("plant", "memory"), [
    (plants.prandtl_ishlinskii, "return-point"),
    (plants.asymmetric, "return-point"),
    (plants.bouc_wen, "no return-point"),
    (lambda u: plants.bouc_wen(u, b=0.3, n=2.0), "no return-point"),
])  # fmt: skip
def test_minor_loops_tell_the_class_of_memory(plant, memory, noise):
    u = signals.training(60, 1)
    y = plant(u)
    y = y + noise * np.ptp(y) * np.random.default_rng(1).normal(size=len(y))
    seen = examine(Dataset.from_signal(u, y))
    assert seen.memory == memory
    assert seen.loops >= 10
    assert seen.warnings == seen.coarse == ()
    assert (seen.gap > 1.5) if memory == "no return-point" else (seen.gap < 0.1)


def test_auto_prints_candidates_memory_and_warnings(tmp_path, monkeypatch):
    found = auto.candidates()
    monkeypatch.setattr(auto, "candidates", lambda: {key: found[key] for key in QUICK})
    u = signals.decaying_sine(5, 0.1, samples=40)
    path = tmp_path / "sine.csv"
    Dataset.from_signal(u, plants.prandtl_ishlinskii(u), 1e-3).to_csv(path)
    out = tmp_path / "m.model.toml"
    done = invoked(["fit", str(path), "--model", "auto", "-o", str(out)])
    for words in ("validation RMS", "parameters", "unknown", "warning: the input is one decaying", "40 samples"):
        assert words in done.output, words
    saved = Model.load(out)
    assert len(saved.fit["warnings"]) == 2
    best = min(saved.provenance["auto"].values())
    assert saved.provenance["auto"][saved.key] <= AS_GOOD * best
    assert {"inverse", "exact"} <= set(done.output.split())
    assert saved.provenance["auto_parameters"]["prandtl_ishlinskii"] == 42


# ---- oscillators ---------------------------------------------------------------------------------------------------
@pytest.mark.stress
def test_narx_network_on_an_oscillator_with_a_bouc_wen_force():
    """Trained on one multisine, run free on another; the plant is integrated by scipy."""
    h = 1 / 750
    force = [synthetic.multisine(1024, 5, 60, 60, seed) for seed in (1, 2)]
    y = [plants.bouc_wen_oscillator(u, h) for u in force]
    m = fit(Dataset.from_signal(force[0], y[0], h), "narx_network", lags=4, hidden=4, iterations=15)
    linear = fit(Dataset.from_signal(force[0], y[0], h), "polynomial_narx", n_u=4, n_f=0, n_y=4, q=1, n_k=0)
    errors = [rms((k.predict(force[1]) - y[1])[100:]) / rms(y[1]) for k in (m, linear)]
    assert errors[0] < 0.08
    assert errors[0] < 0.3 * errors[1]


# ---- tables --------------------------------------------------------------------------------------------------------
def test_static_plant_against_the_block_of_another_integrator():
    u = signals.nested_reversals(30, 2)
    p = boucwen_benchmark
    values = {"A": p.A, "beta": p.BETA, "gamma": p.GAMMA, "n": p.N}
    z = Graph.single(Node("z", "bouc_wen", {}, values)).run(u)[:, 1]
    np.testing.assert_allclose(p.response(u), p.OFFSET + p.LINEAR * u + p.WEIGHT * z, rtol=0, atol=1e-7)


@pytest.mark.turn("figures of papers")
def test_s5_turning_points_are_the_plain_loop():
    precision, *times = sums_of_plays.step_rows()
    assert precision.met
    assert precision.ours > 0
    assert all(r.ours > 1 for r in times), "nanoseconds"


@pytest.mark.stress
def test_s9_oscillators_on_the_benchmark(measured):
    pytest.importorskip("h5py")
    if not (measured / "boucwen_benchmark" / "test.h5").exists():
        pytest.skip("no boucwen_benchmark/test.h5")
    test = boucwen_benchmark.records(measured)
    assert test.official
    errors = boucwen_benchmark.grey_box(*boucwen_benchmark.training(), test)
    assert max(errors) <= 5e-7
    errors = boucwen_benchmark.duhem(*boucwen_benchmark.training(), test, lambda f: None)
    assert max(errors) <= 1e-6
    inside = boucwen_benchmark.records(measured / "boucwen_benchmark")
    np.testing.assert_array_equal(inside.sweep[0], test.sweep[0])


def test_benchmark_without_its_file_says_so(tmp_path):
    with pytest.raises(InputError, match=r"must hold boucwen_benchmark/test\.h5 or test\.h5"):
        reproduce("boucwen_benchmark", tmp_path)
    pytest.importorskip("h5py")
    (tmp_path / "test.h5").write_text("no HDF5")
    with pytest.raises(InputError, match="multisine and sinesweep"):
        reproduce("boucwen_benchmark", tmp_path)


@pytest.mark.stress
def test_s11_protocol_p1(measured):
    if not (measured / "dbo_piezo" / dbo_piezo.FILE).exists():
        pytest.skip("no dbo_piezo")
    run, _ = dbo_piezo.measured(measured)
    assert abs(dbo_piezo.line(run) - 1.99) < 0.005, "the figure of the straight line, measured elsewhere"
    for key in ("actuator", "preisach"):
        assert dbo_piezo.score(run, key)[0] <= dbo_piezo.LIMITS[key], key


def test_piezo_table_without_data_is_what_was_published(tmp_path):
    """Among all tables it states what is missing; requested by name it raises, because nothing is reproduced."""
    with pytest.MonkeyPatch.context() as m:
        m.setattr("papers.PAPERS", {"dbo_piezo": ""})
        done = CliRunner().invoke(main, ["reproduce", "--json"])
    assert done.exit_code == 0
    (report,) = json.loads(done.output)
    assert [(r["printed"], r["reported"]) for r in report["rows"]] == [
        (1.68, None), (0.58, None), (None, 0.316), (None, 0.285),
    ]  # fmt: skip
    assert "--data" in report["notes"][0]
    for more in ([], ["--data", str(tmp_path / "none")]):
        done = invoked(["reproduce", "dbo_piezo", *more], status=2)
        assert len(done.output.splitlines()) == 1
        assert "dbo_piezo" in done.output
    with pytest.raises(InputError, match="Test_Vi_Do_Di"):
        reproduce("dbo_piezo", tmp_path)
    (tmp_path / dbo_piezo.FILE).write_text("1 2 3\n")
    with pytest.raises(InputError, match="9 columns"):
        reproduce("dbo_piezo", tmp_path)


@pytest.mark.turn("figures of papers")
def test_own_records_stand_in_for_the_official_ones():
    test = boucwen_benchmark.records(None)
    assert not test.official
    assert [len(v) for v in (*test.multisine, *test.sweep)] == [8192, 8192, 153000, 153000]
    assert rms(test.multisine[0] - synthetic.multisine(8192, seed=boucwen_benchmark.SEED)) > 10, (
        "not the training signal"
    )
