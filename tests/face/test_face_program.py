"""One program from a measurement to a study: the nouns and verbs of the face, with a model chosen from the data."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from cheap_choice import among_cheap

import hystfmu as hy

ROOT = Path(__file__).parents[2]
PROGRAM = """
import hystfmu as hy

data  = hy.read("piezo.csv")                    # or hy.Dataset(t, u, y), arrays or columns of a data frame
model = hy.fit(data)                                # picks the model
print(model)                                        # one screen: kind, ports, parameters, errors, warnings
model.score(other); model.plot(other)               # errors; a figure (and _repr_html_ in a notebook)
inv = model.inverse()                               # a Model again
model.export("piezo.fmu"); inv.export("inverse.fmu", fmi=3); model.export_modelica("Piezo/")
unit = model.unit()                                 # co-simulation unit

loop = hy.Scenario("tracking", step=1e-4)           # what a scenario.toml says, from Python; the same object either way
loop.add("plant", model, fine=True); loop.add("inverse", inv); loop.add("pid", hy.blocks.Pid(Kp=1.2, Ki=9e3))
loop.connect("inverse.u", "plant.u")
loop.metric("tracking", "rms_percent", "plant.y", against="reference.r", limit=0.05)
result = loop.run(); result                         # a short repr; .trace, .plot(), .report("out")
loop.save("scenarios/mine")                         # scenario.toml
hy.run("scenarios/pid"); study = hy.study("mismatch.study.toml", workers=1)
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


@pytest.mark.stress
def test_the_program_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    measured("piezo", 1).to_csv(tmp_path / "piezo.csv")
    for part in ("pid", "models", "loops"):
        shutil.copytree(ROOT / "scenarios" / part, tmp_path / "scenarios" / part)
    (tmp_path / "mismatch.study.toml").write_text(STUDY)
    monkeypatch.chdir(tmp_path)
    among_cheap(monkeypatch, 0.2)  # the kinds that are solved by least squares
    names: dict[str, object] = {"other": measured("other", 2)}
    exec(compile(PROGRAM, "program", "exec"), names)
    model, result = names["model"], names["result"]
    assert isinstance(model, hy.Model)
    assert model.key in model.provenance["auto"]
    assert str(model) in capsys.readouterr().out
    assert repr(result).startswith("Result('tracking/nominal', passed, tracking = ")
    result.report("out")  # type: ignore[attr-defined]
    again = hy.run("scenarios/mine")
    assert again[0].verdicts[0].value == result.verdicts[0].value  # type: ignore[attr-defined]
    assert again.passed, "the first run of a scenario of one's own: its limits alone decide"
    assert again[0].notes[-1].startswith("tracking: no baseline")
    assert len(names["study"].rows) == 2  # type: ignore[attr-defined]
    written = ["piezo.fmu", "inverse.fmu", "Piezo/package.mo", "out/report.html", "mismatch/results.parquet"]
    assert [name for name in written if not Path(name).exists()] == []


# ---- wires that follow from the roles of units
def loop_of(*controllers: str) -> hy.Scenario:
    """The wires of the program, with these controllers."""
    plays = hy.blocks.PrandtlIshlinskii(w0=1.0, r=[0.1, 0.3], w=[0.5, 0.2])
    plant = hy.Model("prandtl_ishlinskii", plays.graph, 1e-3, provenance={"span_u": [-1.0, 1.0]})
    loop = hy.Scenario("wires", step=1e-3).add("plant", plant).add("inverse", plant.inverse("exact"))
    for name in controllers:
        loop.add(name, hy.blocks.Pid(Kp=0.1))
    return loop.connect("inverse.u", "plant.u").metric("tracking", "rms_percent", "plant.y", against="reference.r")


def wires_of(loop: hy.Scenario, folder: Path) -> dict[str, str]:
    found: dict[str, str] = tomllib.loads((loop.save(folder / "s") / "scenario.toml").read_text())["connections"]
    return found


def test_a_controller_without_wires_stands_in_the_path_to_the_plant(tmp_path: Path):
    forward = {"inverse.u": "reference.r_lead"}
    assert wires_of(loop_of(), tmp_path) == {"plant.u": "inverse.y", **forward}
    feedback = {"pid.u_ff": "inverse.y", "pid.y_d": "reference.r", "pid.y": "plant.y", "plant.u": "pid.u"}
    assert wires_of(loop_of("pid"), tmp_path) == {**feedback, **forward}


def test_wires_that_are_said_stay(tmp_path: Path):
    said = {"inverse.u": "reference.r", "pid.y": "plant.y"}
    loop = loop_of("pid")
    for target, source in said.items():
        loop.connect(source, target)
    assert wires_of(loop, tmp_path) == {"plant.u": "inverse.y", **said}


def test_of_two_controllers_without_wires_none_is_placed(tmp_path: Path):
    assert "pid.u" not in wires_of(loop_of("pid", "other"), tmp_path).values()
