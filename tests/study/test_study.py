"""Studies: closed-form results, sampling, invalid studies, and one table for all engines and numbers of workers."""

import itertools
import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import tomli_w
from invoked import invoked
from scipy.stats import qmc, spearmanr

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.studies import task
from hystfmu.studies.report import sensitivity
from hystfmu.studies.spec import Study
from hystfmu.studies.task import Asked, sampler

pq = pytest.importorskip("pyarrow.parquet")


def expected(row: dict[str, Any]) -> float:
    """step b (1 - exp(-T / 0.5)), exactly: the step occurs at t = 0 and the lag is discretised exactly."""
    stop = {"one": 1.0, "half": 0.5}[row["case"]]
    v = row["values"]
    return float(v["command.step"] * v["lag.b"] * (1 - math.exp(-stop / 0.5)))


def test_grid_against_the_closed_form(write: Any, tmp_path: Path) -> None:
    told: list[tuple[int, int, float]] = []
    outcome = hy.study(write(), tmp_path / "out", workers=2, progress=lambda *of: told.append(of))
    assert len(outcome.rows) == outcome.ran == 4 * 3 * 2
    assert [of[:2] for of in told] == [(k, 24) for k in range(1, 25)]
    # the rate is that of the rows until then
    assert all(0 < of[0] / of[2] <= outcome.seconds for of in told)
    assert not outcome.failed
    for row in outcome.rows:
        assert row["metrics"]["peak"] == row["values"]["command.step"]
        assert row["metrics"]["last"] == pytest.approx(expected(row), rel=1e-12)
    assert sorted({row["values"]["lag.b"] for row in outcome.rows}) == pytest.approx([0.5, 1.0, 2.0])
    table = pq.read_table(outcome.table)
    assert table.column("index").to_pylist() == list(range(24))
    assert table.column("metric:last").to_pylist() == [row["metrics"]["last"] for row in outcome.rows]
    page = outcome.report.read_text()
    assert "rank correlation" in page
    titles = "last over command.step", "distribution of last", "distribution of peak", "of the variations", "all 12"
    assert [title for title in titles if title not in page] == []
    sections = json.loads((tmp_path / "out" / "report.json").read_text())["sections"]
    assert [s["title"] for s in sections] == ["", "All variations", "Case one", "Case half"]
    assert len(sections[2]["tables"][-1]["rows"]) == 10  # of the worst
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
    told: list[int] = []
    study = write(method="sobol", n=16)
    more = hy.study(study, tmp_path / "out", workers=1, progress=lambda done, *of: told.append(done))
    assert told == list(range(17, 33))
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


@pytest.mark.parametrize(("method", "points"), [
    ("random", lambda: np.random.default_rng(7).random((12, 2))),
    ("sobol", lambda: qmc.Sobol(2, seed=7).random(16)[:12]),
    ("latin_hypercube", lambda: qmc.LatinHypercube(2, seed=7).random(12)),
    ("grid", lambda: np.array(list(itertools.product([0, 1], [0])))),
])  # fmt: skip
def test_the_variations_of_a_method(write: Any, method: str, points: Any) -> None:
    parameters = {"command.step": {"range": [1.0, 4.0], "steps": 2}, "lag.b": {"scale": [0.5, 2.0], "steps": 1}}
    made = sampler(Study(write(method=method, n=12, seed=7, parameters=parameters)))
    (rows,) = made.batches()
    want = [1.0, 0.5] + [3.0, 1.5] * points()
    assert np.array([list(r.values()) for r in rows]) == pytest.approx(want, rel=1e-12)
    assert (made.n, list(rows[0]), made.outside(0)) == (len(want), list(parameters), "")


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
    assert [r["variation"] for r in outcome.rows] == [k // 2 for k in range(48)]  # over three batches
    assert "best variation" in outcome.report.read_text()


def test_optuna_is_told_what_failed_and_what_breaks_a_limit(write: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("optuna")
    made = SimpleNamespace(excess=lambda values: {"Ms_db": values["command.step"] - 3.0, "radius": -1.0})
    monkeypatch.setattr(task, "LoopLimits", lambda study, loop: made)
    objective = {"metric": "last", "limits": {"peak": 2.0}, "loop": {"case": "one"}}
    study = {"method": "optuna", "n": 20, "objective": objective, "parameters": {"command.step": {"range": [1, 4]}}}
    asked, sizes = Asked(Study(write(**study))), list[int]()
    for batch in asked.batches():
        steps = [values["command.step"] for values in batch]
        sizes.append(len(batch))
        assert [asked.outside(k) for k in range(len(batch))] == ["Ms_db" if v > 3 else "" for v in steps]
        metrics = [({"last": v, "peak": v / 2}, {"last": v, "peak": v}) if v > 1.5 else ({}, {}) for v in steps]
        asked.tell([[{"case": c, "metrics": m} for c, m in zip(("one", "half"), of, strict=True)] for of in metrics])
    assert sizes == [8, 8, 4]
    found = set()
    for trial in asked._asker.trials:
        v = trial.params["command.step"]
        state = "PRUNED" if v > 3 else "COMPLETE" if v > 1.5 else "FAIL"
        peak = {"PRUNED": {}, "COMPLETE": {"peak": v - 2}, "FAIL": {"peak": math.inf}}[state]
        assert (trial.state.name, trial.value) == (state, v if state == "COMPLETE" else None)
        assert trial.constraints == {"Ms_db": v - 3.0, "radius": -1.0} | peak
        found.add(state)
    assert len(found) == 3


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


@pytest.mark.parametrize(("change", "message"), [
    ({"cases": ["two"]}, "no case 'two'; there are one, half"),
    ({"method": "optuna"}, "objective: must be given for the method 'optuna' only"),
    ({"parameters": {"lag": {"range": [0, 1]}}}, "must read 'unit.variable'"),
    ({"parameters": {"lag": {"second_order": {"gain": [1, 1], "f_n": [1, 2], "zeta": [1, 2]}}}}, "gain must rise"),
    ({"limits": {"two": {}}}, "no case 'two'; there are one, half"),
    ({"limits": {"one": {"Ms_db": 6.0}}}, "limits.one: no metric 'Ms_db'; there are last, peak"),
    ({"extends": "study.toml"}, "extends: at most 8 files may extend each other"),
    ({"extends": "/etc/study.toml"}, "must be a path relative to the scenario"),
    ({"method": "optuna", "objective": {"metric": "last", "targets": {"two": 1.0}}}, "targets: no case 'two'"),
    ({"method": "optuna", "objective": {"metric": "worst"}}, "no metric 'worst'; there are last, peak"),
])  # fmt: skip
def test_bad_studies_are_one_line(write: Any, tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = write(**change)
    result = invoked(["study", str(path), "-o", str(tmp_path / "out")], status=2)
    assert message in result.output
    assert len(result.output.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_tables_merge_along_a_chain_of_eight_files(write: Any) -> None:
    path = write()
    for k in range(7):
        (path.parent / f"{k}.toml").write_text(path.read_text())
        own = (
            {"extends": f"{k}.toml", "limits": {"one": {"last": float(k)}}} if k != 3 else {"n": k, "extends": "3.toml"}
        )
        path.write_text(tomli_w.dumps(own | {"parameters": {f"lag.a{k}": {"values": [1.0]}}}))
    spec = Study(path).spec
    assert (spec.n, spec.limits) == (3, {"one": {"last": 6.0}})
    assert list(spec.parameters) == ["command.step", "lag.b", *(f"lag.a{k}" for k in range(7))]


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
    result = invoked(["study", str(write()), "-o", str(tmp_path / "out"), "-j", "1", "--json"])
    facts = json.loads(result.output)
    assert (facts["rows"], facts["ran"], facts["failed"]) == (24, 24, 0)
