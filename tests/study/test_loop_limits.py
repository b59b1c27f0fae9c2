"""Limits of the linearised loop as constraints of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from click.testing import CliRunner

from hystfmu.cli import main
from hystfmu.studies.report import best_variation
from hystfmu.studies.spec import Study
from hystfmu.studies.task import LoopLimits

ROOT = Path(__file__).parents[2]
FILE = ROOT / "scenarios/pid/gains.study.toml"


def test_three_times_the_derivative_gain_leaves_the_limits() -> None:
    study = Study(FILE)
    assert study.spec.objective is not None
    assert study.spec.objective.loop is not None
    gains = study.scenario_cases["sine_10"].units["pid"].values
    steep = {key: gains[key.partition(".")[2]] for key in study.parameters} | {"pid.Kd": 3 * gains["Kd"]}
    assert LoopLimits(study, study.spec.objective.loop).excess(steep)["radius"] > 0


def test_the_best_variation_is_within_the_limits_of_the_loop() -> None:
    study = Study(FILE)
    gains = study.scenario_cases["sine_10"].units["pid"].values
    shipped = {key: float(gains[key.partition(".")[2]]) for key in study.parameters}
    rows: list[dict[str, Any]] = []
    for variation, (factor, error) in enumerate(((1.0, 0.02), (3.0, 0.01))):
        values = shipped | {"pid.Kd": factor * shipped["pid.Kd"]}
        metrics = {"tracking": error, "variation": 1.0}
        rows += [{"variation": variation, "case": "sine_10", "values": values, "metrics": metrics, "status": "ok"}]
    best = best_variation(study, rows)
    assert best is not None
    assert best["variation"] == 0  # the other has the smaller error and an unstable corner


def test_a_case_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    text = FILE.read_text().replace('scenario = "."', f'scenario = "{FILE.parent.as_posix()}"')
    bad = tmp_path / "bad.study.toml"
    bad.write_text(text.replace("../loops/gains.toml", "gains.toml"))
    rules = (ROOT / "scenarios/loops/gains.toml").read_text()
    (tmp_path / "gains.toml").write_text(rules.replace('corners = ["up_400_10"', 'corners = ["up_999_10"'))
    result = CliRunner().invoke(main, ["study", str(bad), "-o", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "objective.loop: no case 'up_999_10'" in result.output
