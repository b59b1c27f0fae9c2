"""Measured data to FMUs by protocol P1; output `in_range`: whether the input lies in that of the training rows."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import plants
import pytest
from fmpy.validation import validate_fmu
from invoked import invoked
from runners import run_by_fmpy, run_by_unit

import hystfmu as hy
from hystfmu import Model, signals
from hystfmu.model.coverage import trained_range

H = 1e-3


@pytest.fixture(scope="module")
def model() -> hy.Model:
    """Fitted to the rows with |u| <= 0.5; others of the record reach 1."""
    u = np.concatenate([0.5 * signals.training(12, 1, 0.05), signals.training(12, 2, 0.05)])
    first = len(signals.training(12, 1, 0.05))
    data = hy.Dataset.from_signal(u, plants.prandtl_ishlinskii(u), H, "plays").with_train((0, first))
    return hy.fit(data, "prandtl_ishlinskii", N=10, w0_min=0.1)


def test_the_range_is_that_of_the_training_rows(model: hy.Model) -> None:
    assert model.provenance["trained_u"] == [-0.5, 0.5]
    assert model.provenance["span_u"] == [-1.0, 1.0]
    u = np.array([0.0, 0.5, 0.5 + 1e-12, 0.9, -0.5, -0.500001, 0.1])
    y = model.with_in_range().predict(u)
    assert y[:, 1].tolist() == [1, 1, 0, 0, 1, 0, 1]
    assert y[:, 0].tobytes() == model.predict(u).tobytes()


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmus_of_the_command_have_the_output(model: hy.Model, fmi: int, tmp_path: Path) -> None:
    file, fmu = tmp_path / "m.model.toml", tmp_path / "m.fmu"
    model.save(file)
    invoked(["export", str(file), "--in-range", "--fmi", str(fmi), "-o", str(fmu)])
    u = signals.nested_reversals(4, 5, step=0.02)
    y = model.with_in_range().predict(u)
    assert 0 < np.mean(y[:, 1]) < 1
    assert run_by_fmpy(fmu, tmp_path / "run", u[:, None], H).tobytes() == y.tobytes()
    assert run_by_unit(model.with_in_range().graph, u[:, None], H).tobytes() == y.tobytes()


@pytest.mark.parametrize("method", ["exact", "implicit"])
def test_an_inverse_tells_it_of_the_command(model: hy.Model, method: str) -> None:
    """An implicit inverse stops at the end of its range, which is outside."""
    options = {"lo": -0.5, "hi": 0.5} if method == "implicit" else {}
    made = model.inverse(method, **options).with_in_range()
    least, most = model.predict([0.0, -0.5, 0.5])[1:]
    told = made.predict([0.0, 0.99 * least, 0.99 * most, most + 1, 0.0])
    assert told[:, 1].tolist() == [1, 1, 1, 0, 1]
    assert np.abs(told[[0, 1, 2, 4], 0]).max() < 0.5


def test_covariates_count_too() -> None:
    u = signals.training(8, 1, 0.05)
    load = np.linspace(2.0, 3.0, len(u))
    data = hy.Dataset(H * np.arange(len(u)), u, u + load, covariates={"load [N]": load})
    total = hy.Node("total", "sum", {"n": 2})
    inputs = [hy.Input("u", ("total.u[1]",)), hy.Input("load", ("total.u[2]",))]
    graph = hy.Graph([total], [], inputs, [hy.Output("y", "total.y")])
    made = hy.Model("loaded", graph, H, provenance=trained_range(data)).with_in_range()
    rows = np.array([[0.0, 2.5], [0.5, 3.1], [0.5, 2.0], [1.1, 2.5]])
    assert made.predict(rows)[:, 1].tolist() == [1, 0, 1, 0]


def test_a_model_that_does_not_know_its_range_says_so(model: hy.Model) -> None:
    with pytest.raises(hy.InputError, match=r"must state trained_u = \[least, largest\]"):
        hy.Model.of_block(hy.blocks.Creep()).with_in_range()
    with pytest.raises(hy.InputError, match="must have no output 'in_range' yet"):
        model.with_in_range().with_in_range()


# ---- P1 (Aye, Ang 2018, PICMA P-885.91, 200 Hz): rows 2000:4200 fitted, 3000:13800 the result ------------------------
PERIOD = 0.005
LIMITS = {"prandtl_ishlinskii": 0.48, "zhao_tan_mlp": 0.30}  # RMS in um


def hystfmu(key: str, *arguments: object) -> str:
    """Run a command: one fit in a shell, the other commands in this process."""
    words = list(map(str, arguments))
    if (key, words[0]) != ("prandtl_ishlinskii", "fit"):
        return invoked(words).stdout
    shell = [sys.executable, "-m", "hystfmu.cli", *words]
    done = subprocess.run(shell, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def csv(measured: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    raw = np.loadtxt(measured / "dbo_piezo" / "Test_Vi_Do_Di.dat")
    rows = np.c_[np.arange(len(raw) - 1) * PERIOD, raw[:-1, 0], raw[1:, 4]]
    path = tmp_path_factory.mktemp("measured") / "dbo.csv"
    np.savetxt(path, rows, delimiter=",", header="t,u,y", comments="", fmt="%.10g")
    return path


@pytest.mark.turn("FMUs in importers")
@pytest.mark.some(1)
@pytest.mark.parametrize("key", list(LIMITS))
def test_measured_data_to_fmu(csv: Path, tmp_path: Path, key: str) -> None:
    model = tmp_path / "m.model.toml"
    fitted = json.loads(hystfmu(key, "fit", csv, "--model", key, "--train", "2000:4200", "-o", model, "--json"))
    hystfmu(key, "predict", model, csv, "-o", tmp_path / "out.csv")
    measured, predicted = (np.loadtxt(p, delimiter=",", skiprows=1) for p in (csv, tmp_path / "out.csv"))
    rms = np.sqrt(np.mean((predicted[3000:13800, 2] - measured[3000:13800, 2]) ** 2))
    print(f"{key}: RMS {rms:.3f} um on rows 3000:13800 ({fitted['parameters']} parameters, {fitted['seconds']:.2f} s)")
    assert rms <= LIMITS[key]

    u = measured[:4000, 1]
    m = Model.load(model)
    native = m.predict(u)
    assert native.tobytes() == predicted[:4000, 2].tobytes(), "predict must write every digit"
    assert run_by_unit(m.graph, u[:, None], PERIOD).tobytes() == native.tobytes()
    for fmi in ("2", "3"):
        fmu = tmp_path / f"x{fmi}.fmu"
        hystfmu(key, "export", model, "--fmi", fmi, "-o", fmu)
        assert validate_fmu(str(fmu)) == []
        assert run_by_fmpy(fmu, tmp_path / f"x{fmi}", u[:, None], PERIOD).tobytes() == native.tobytes()
