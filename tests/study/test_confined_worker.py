"""A worker of a study with a foreign FMU has nothing of the process that started it, and can do nothing to it."""

import os
import sys
from pathlib import Path

import pytest
import tomli_w
from bad_fmu import LOOP, bad_fmu

import hystfmu as hy
from hystfmu import Graph, InputError, Node
from hystfmu.base.confine import unconfined
from hystfmu.model import Model

if unconfined():
    pytest.skip(f"foreign FMUs may {unconfined()} here: needs Landlock and seccomp", allow_module_level=True)

ATTEMPTS = Path(__file__).with_name("worker_attempts.c").read_text()
STUDY = {"name": "bad", "scenario": "loop", "method": "grid", "parameters": {"command.step": {"values": [0.0, 1.0]}}}


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))
    (tmp_path / "loop").mkdir()
    (tmp_path / "loop" / "scenario.toml").write_text(tomli_w.dumps(LOOP))
    path = tmp_path / "bad.study.toml"
    path.write_text(tomli_w.dumps(STUDY))
    return path


@pytest.mark.turn("foreign code")
def test_it_reaches_nothing_of_its_maker(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TOKEN", "words hidden")
    defect = "{ static double did = -1; if (did < 0) did = attempts(); y = did; return fmi2OK; }"
    bad_fmu(study.parent / "loop" / "bad.fmu", defect, -1.0, ATTEMPTS, f"-DMAKER={os.getpid()}")
    outcome = hy.study(study, study.parent / "out", workers=1)
    assert [(row["status"], row["metrics"]) for row in outcome.rows] == [("ok", {"last": 0.0})] * 2


def test_workers_that_cannot_begin_say_why(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bad_fmu(study.parent / "loop" / "bad.fmu")
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(InputError, match=r"^the workers of the study exit with status 1 before they begin; "):
        hy.study(study, study.parent / "out", workers=1)


@pytest.mark.turn("foreign code")
@pytest.mark.some(1)
@pytest.mark.parametrize("engine", ["native", "fmpy"])
def test_it_needs_no_file_of_the_scenario(study: Path, engine: str) -> None:
    """Where it builds the case anew: for the reference engine, and for another number of steps of a delay."""
    folder = study.parent / "loop"
    bad_fmu(folder / "bad.fmu")
    Model("gain", Graph.single(Node("gain", "sum", {"n": 1}, {"k": [2.0]})), 1e-3).save(folder / "gain.model.toml")
    units = {"late": {"block": "delay"}, "gain": {"model": "gain.model.toml"}}
    loop = LOOP | {
        "units": LOOP["units"] | units,
        "order": ["command", "late", "gain", "bad"],
        "connections": {"late.u": "command.d", "gain.u": "late.y", "bad.u": "gain.y"},
    }
    loop["units"]["command"] = {"block": "disturbance", "set": {"amplitude": 0.0}}
    (folder / "scenario.toml").write_text(tomli_w.dumps(loop))
    varied = {"command.step": {"values": [1.0]}, "late.n": {"values": [1, 4]}}
    study.write_text(tomli_w.dumps(STUDY | {"engine": engine, "parameters": varied}))
    outcome = hy.study(study, study.parent / "out", workers=1)
    assert [(row["status"], row["metrics"]) for row in outcome.rows] == [("ok", {"last": 2.0})] * 2
