"""One program from a measurement to a study: the nouns and verbs of the face, with a model chosen from the data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hystfmu as hy
from hystfmu.identify import auto

PROGRAM = """
import hystfmu as hy

data  = hy.read_csv("piezo.csv")                    # or hy.Dataset(t, u, y), arrays or columns of a data frame
other = hy.read_csv("other.csv")
model = hy.fit(data)                                # picks the model
print(model)                                        # one screen: kind, ports, parameters, errors, warnings
print(model.score(other)); model.plot(other)        # errors; a figure (and _repr_html_ in a notebook)
inv = model.inverse()                               # a Model again
model.export("piezo.fmu"); inv.export("inverse.fmu", fmi=3); model.export_modelica("Piezo/")
unit = model.unit()                                 # co-simulation unit

loop = hy.Scenario("tracking", step=1e-4)           # what a scenario.toml says, from Python; the same object either way
loop.add("plant", model, fine=True); loop.add("inverse", inv); loop.add("pid", hy.blocks.Pid(Kp=1.2, Ki=9e3))
loop.connect("reference.r_lead", "inverse.u"); loop.connect("inverse.y", "pid.u_ff")
loop.connect("reference.r", "pid.y_d"); loop.connect("plant.y", "pid.y"); loop.connect("pid.u", "plant.u")
loop.metric("tracking", "rms_percent", "plant.y", against="reference.r", limit=0.05)
result = loop.run(); print(result)                  # a short repr: case, verdict, metrics
result.plot(); result.report("out")
loop.save("scenarios/mine")                         # scenario.toml
again = hy.run("scenarios/mine"); study = hy.study("mismatch.study.toml", workers=1)
"""
STUDY = """
name = "mismatch"
scenario = "scenarios/mine"
method = "grid"
[parameters]
"reference.amplitude" = { scale = [0.9, 1.1], steps = 2 }
"""


def measured(name: str, seed: int) -> hy.Dataset:
    """A stack of 0..100 V with noise of 1e-4 of the stroke, whose hysteresis is a sum of plays."""
    u = 50 * (1 + hy.signals.training(60, seed))
    y = hy.blocks.PrandtlIshlinskii(w0=0.12, r=[5.0, 15.0, 30.0], w=[0.03, 0.03, 0.02], u0=50.0)(u)
    return hy.Dataset(np.arange(len(u)) * 1e-3, u, y + 2e-3 * np.random.default_rng(seed).normal(size=len(u)), name)


def test_the_program_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    measured("piezo", 1).to_csv(tmp_path / "piezo.csv")
    measured("other", 2).to_csv(tmp_path / "other.csv")
    (tmp_path / "mismatch.study.toml").write_text(STUDY)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(auto, "BUDGET", 0.5)  # s of estimated work: the kinds that are solved by least squares
    names: dict[str, object] = {}
    exec(compile(PROGRAM, "program", "exec"), names)
    model, result, again = names["model"], names["result"], names["again"]
    assert isinstance(model, hy.Model)
    assert model.key in model.provenance["auto"]
    assert str(model) in capsys.readouterr().out
    assert repr(result).startswith("Result('tracking/nominal', passed, tracking = ")
    assert again[0].verdicts[0].value == result.verdicts[0].value  # type: ignore[index, attr-defined]
    assert again[0].lines == ("tracking/nominal: no baseline: run with --record",)  # type: ignore[index]
    assert len(names["study"].rows) == 2  # type: ignore[attr-defined]
    written = ["piezo.fmu", "inverse.fmu", "Piezo/package.mo", "out/report.html", "mismatch/results.parquet"]
    assert [name for name in written if not Path(name).exists()] == []
