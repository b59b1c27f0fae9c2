"""Studies: closed-form results, sampling, invalid studies, and one table for all engines and numbers of workers."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.stats import spearmanr

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.studies.report import sensitivity

pq = pytest.importorskip("pyarrow.parquet")


def expected(row: dict[str, Any]) -> float:
    """step b (1 - exp(-T / 0.5)), exactly: the step occurs at t = 0 and the lag is discretised exactly."""
    stop = {"one": 1.0, "half": 0.5}[row["case"]]
    v = row["values"]
    return float(v["command.step"] * v["lag.b"] * (1 - math.exp(-stop / 0.5)))


def test_grid_against_the_closed_form(write: Any, tmp_path: Path) -> None:
    outcome = hy.study(write(), tmp_path / "out", workers=2)
    assert len(outcome.rows) == 4 * 3 * 2
    assert not outcome.failed
    for row in outcome.rows:
        assert row["metrics"]["peak"] == row["values"]["command.step"]
        assert row["metrics"]["last"] == pytest.approx(expected(row), rel=1e-12)
    scales = sorted({row["values"]["lag.b"] for row in outcome.rows})
    assert scales == pytest.approx([0.5, 1.0, 2.0])
    table = pq.read_table(outcome.table)
    assert table.column("index").to_pylist() == list(range(24))
    assert table.column("metric:last").to_pylist() == [row["metrics"]["last"] for row in outcome.rows]
    page = outcome.report.read_text()
    assert "rank correlation" in page
    for title in ("last over command.step", "distribution of last", "distribution of peak"):
        assert title in page
    assert repr(outcome) == f"Outcome(24 rows, 0 failed, '{outcome.table}')"


def test_margins_of_a_case_that_does_not_run_are_refused(write: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"margins: no case 'three'"):
        hy.study(write(margins="three"), tmp_path / "out", workers=1)
    assert not (tmp_path / "out").exists()


def test_the_table_does_not_depend_on_workers_or_engine_and_no_unpacked_units_stay(
    write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setenv("TMPDIR", str(scratch))
    monkeypatch.setattr("tempfile.tempdir", None)
    tables = [
        hy.study(write(engine=engine), tmp_path / f"{engine}{n}", workers=n).table.read_bytes()
        for engine, n in (("native", 1), ("native", 2), ("fmpy", 1))
    ]
    assert tables[0] == tables[1] == tables[2]
    assert list(scratch.iterdir()) == []


def test_a_second_call_runs_nothing_and_a_larger_study_only_what_is_new(write: Any, tmp_path: Path) -> None:
    first = hy.study(write(method="sobol", n=8), tmp_path / "out", workers=1)
    assert first.ran == 16
    assert hy.study(write(method="sobol", n=8), tmp_path / "out", workers=1).ran == 0
    more = hy.study(write(method="sobol", n=16), tmp_path / "out", workers=1)
    assert more.ran == 16
    assert [r["id"] for r in more.rows[:16]] == [r["id"] for r in first.rows]


def test_a_repeated_variation_runs_once(write: Any, tmp_path: Path) -> None:
    path = write(parameters={"command.step": {"values": [1.0, 2.0, 1.0]}})
    outcome = hy.study(path, tmp_path / "out", workers=1)
    assert outcome.ran == 4
    assert sorted((r["values"]["command.step"], r["case"]) for r in outcome.rows) == [
        (1.0, "half"), (1.0, "one"), (2.0, "half"), (2.0, "one"),
    ]  # fmt: skip
    assert hy.study(path, tmp_path / "out", workers=1).ran == 0


def test_latin_hypercube_has_one_point_in_every_stratum(write: Any, tmp_path: Path) -> None:
    outcome = hy.study(write(method="latin_hypercube", n=10, seed=3), tmp_path / "out", workers=1)
    x = sorted({row["values"]["command.step"] for row in outcome.rows})
    assert [int((v - 1.0) / 0.3) for v in x] == list(range(10))


def test_a_refused_variation_is_a_row_with_its_reason(write: Any, tmp_path: Path) -> None:
    path = write(parameters={"lag.a": {"values": [1.0, 0.0]}, "command.step": {"values": [1.0]}})
    outcome = hy.study(path, tmp_path / "out", workers=1)
    bad = [r for r in outcome.rows if r["values"]["lag.a"] == 0.0]
    assert {r["status"] for r in bad} == {"refused"}
    assert all("a" in r["reason"] for r in bad)
    assert {r["status"] for r in outcome.rows if r["values"]["lag.a"] == 1.0} == {"ok"}


def test_a_parameter_that_no_unit_has_is_refused_before_anything_runs(write: Any, tmp_path: Path) -> None:
    path = write(parameters={"comand.step": {"values": [1.0]}})
    with pytest.raises(InputError, match=r"study\.toml: parameters: no case has a unit .* 'comand\.step'"):
        hy.study(path, tmp_path / "out", workers=1)
    assert not (tmp_path / "out").exists()


def test_optuna_finds_the_smallest_within_the_limits(write: Any, tmp_path: Path) -> None:
    """The result is close to the lower bound and does not depend on the number of workers."""
    pytest.importorskip("optuna")
    study = {"method": "optuna", "n": 24, "seed": 1, "objective": {"metric": "last", "limits": {"peak": 3.0}}}
    outcome = hy.study(write(**study), tmp_path / "a", workers=2)
    again = hy.study(write(**study), tmp_path / "b", workers=1)
    assert outcome.table.read_bytes() == again.table.read_bytes()
    best = min(r["metrics"]["last"] for r in outcome.rows if r["case"] == "one")
    assert best < 0.6  # of a range from 0.43 to 7
    assert "best variation" in outcome.report.read_text()


def test_a_variation_that_diverges_leaves_a_report(write: Any, tmp_path: Path) -> None:
    """Numbers beyond the range of an axis stand in the table, not in the plots."""
    study = {"parameters": {"command.step": {"values": [1.0, 1e300, 1e308]}, "lag.b": {"values": [1.0, 2.0, 5.0]}}}
    outcome = hy.study(write(**study), tmp_path / "out", workers=1)
    assert max(row["metrics"].get("peak", 0.0) for row in outcome.rows) == 1e308
    assert "rank correlation" in outcome.report.read_text()


def test_the_report_shows_units_of_measure_and_marks_factors(write: Any, tmp_path: Path) -> None:
    """Units of measure: of a parameter from the C table, of a metric from its kind, of a signal from the model."""
    graph = {
        "blocks": [
            {"name": "lag", "type": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": {"a": [0.5, 1.0]}}
        ],
        "inputs": [{"name": "u", "to": ["lag.u"]}],
        "outputs": [{"name": "y", "source": "lag.y", "unit": "um"}],
    }
    metrics = {
        "last": {"kind": "final", "signal": "lag.y"},
        "error": {"kind": "max_percent", "signal": "lag.y", "against": "command.d", "stroke": 1.0},
        "calm": {"kind": "variation_ratio", "signal": "lag.y", "against": "command.d"},
    }
    of_scenario = {"units": {"lag": {"graph": graph}, "command": {"block": "disturbance"}}, "metrics": metrics}
    parameters = {"command.t_step": {"range": [0.1, 0.2], "steps": 2}, "lag.b": {"scale": [0.5, 2.0], "steps": 2}}
    outcome = hy.study(write(of_scenario=of_scenario, parameters=parameters), tmp_path / "out", workers=1)
    overview, _, case = json.loads((tmp_path / "out" / "report.json").read_text())["sections"][:3]
    assert [row[0] for row in overview["tables"][0]["rows"]] == ["command.t_step in s", "lag.b as a factor"]
    assert list(case["tables"][-2]["head"]) == [
        *("row", "command.t_step in s", "lag.b as a factor", "last in um", "error in %", "calm")
    ]
    page = outcome.report.read_text()
    assert ">last in um</text>" in page
    assert ">lag.b as a factor</text>" in page


def test_sensitivity_is_spearmans() -> None:
    rng = np.random.default_rng(4)
    x, y = rng.integers(0, 9, (40, 3)).astype(float), rng.normal(size=(40, 2))  # with ties
    y[:, 0] += x[:, 1] ** 3
    ours = sensitivity(x, y)
    for i in range(3):
        for j in range(2):
            assert ours[i, j] == pytest.approx(spearmanr(x[:, i], y[:, j]).statistic, abs=1e-12)
    assert sensitivity(np.ones((5, 1)), y[:5])[0].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cases": ["two"]}, "no case 'two'; there are one, half"),
        ({"method": "optuna"}, "objective: must be given for the method 'optuna' only"),
        ({"parameters": {"lag": {"range": [0, 1]}}}, "must read 'unit.variable'"),
        ({"parameters": {"lag": {"second_order": {"gain": [1, 1], "f_n": [1, 2], "zeta": [1, 2]}}}}, "gain must rise"),
        ({"limits": {"two": {}}}, "no case 'two'; there are one, half"),
        ({"limits": {"one": {"Ms_db": 6.0}}}, "limits.one: no metric 'Ms_db'; there are last, peak"),
        ({"extends": "/etc/study.toml"}, "must be a path relative to the scenario"),
        ({"method": "optuna", "objective": {"metric": "last", "targets": {"two": 1.0}}}, "targets: no case 'two'"),
        ({"method": "optuna", "objective": {"metric": "worst"}}, "no metric 'worst'; there are last, peak"),
    ],
)
def test_bad_studies_are_one_line(write: Any, tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = write(**change)
    result = CliRunner().invoke(main, ["study", str(path), "-o", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert message in result.output
    assert len(result.output.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_grid_of_more_than_ten_million_points_is_refused(write: Any, tmp_path: Path) -> None:
    steps = {"command.step": 10**5, "lag.b": 101}
    with pytest.raises(InputError, match="the grid must have at most 10000000 points"):
        hy.study(write(parameters={k: {"range": [0.1, 1.0], "steps": n} for k, n in steps.items()}), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_folder_of_another_study_is_refused(write: Any, tmp_path: Path) -> None:
    hy.study(write(), tmp_path / "out", workers=1)
    path = write(parameters={"command.step": {"range": [1, 2]}})
    with pytest.raises(InputError, match="contains the table of a study with other parameters"):
        hy.study(path, tmp_path / "out", workers=1)


def test_the_command_line_prints_the_outcome(write: Any, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["study", str(write()), "-o", str(tmp_path / "out"), "-j", "1", "--json"])
    assert result.exit_code == 0
    facts = json.loads(result.output)
    assert (facts["rows"], facts["ran"], facts["failed"]) == (24, 24, 0)
