"""Measured piezo data from the CSV file to the FMU: the errors of protocol P1, and equal bits in every engine.

Protocol P1 (Aye & Ang 2018, PICMA P-885.91, 200 Hz): u[k] = column 1 of row k, y[k] = column 5 of row k + 1; the model
runs free from row 0, residuals of rows 2000:4200 are fitted, rows 3000:13800 are the result.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from fmpy.validation import validate_fmu
from runners import run_by_fmpy, run_by_unit

from hystfmu import Model
from hystfmu.cli import main

H = 0.005
LIMITS = {"prandtl_ishlinskii": 0.48, "zhao_tan_mlp": 0.30}  # RMS in um


IN_A_SHELL = "prandtl_ishlinskii"  # the other kinds call the same commands in this process


def hystfmu(key: str, *arguments: object) -> str:
    words = list(map(str, arguments))
    if key != IN_A_SHELL:
        result = CliRunner().invoke(main, words)
        assert result.exit_code == 0, result.output
        return result.stdout
    shell = [sys.executable, "-m", "hystfmu.cli", *words]
    done = subprocess.run(shell, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def csv(measured: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    raw = np.loadtxt(measured / "dbo_piezo" / "Test_Vi_Do_Di.dat")
    rows = np.c_[np.arange(len(raw) - 1) * H, raw[:-1, 0], raw[1:, 4]]
    path = tmp_path_factory.mktemp("measured") / "dbo.csv"
    np.savetxt(path, rows, delimiter=",", header="t,u,y", comments="", fmt="%.10g")
    return path


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
    assert run_by_unit(m.graph, u[:, None], H).tobytes() == native.tobytes()
    for fmi in ("2", "3"):
        fmu = tmp_path / f"x{fmi}.fmu"
        hystfmu(key, "export", model, "--fmi", fmi, "-o", fmu)
        assert validate_fmu(str(fmu)) == []
        assert run_by_fmpy(fmu, tmp_path / f"x{fmi}", u[:, None], H).tobytes() == native.tobytes()
