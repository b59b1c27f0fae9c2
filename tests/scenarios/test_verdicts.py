"""Two verdicts: against the limit (requirement) and against the baseline (change); nothing is recorded by itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.scenario import Result
from hystfmu.scenario.report import terminal


def run(folder: Path, **more: Any) -> Result:
    (result,) = hy.run([folder], engine="native", **more)
    return result


def test_without_any_baseline_the_limits_alone_decide_and_none_is_written(loop: Any, write: Any) -> None:
    folder = write(loop)
    result = run(folder)
    assert result.passed
    assert result.notes[-1].startswith("loop: no baseline yet")
    assert "no baseline yet" in terminal.verdicts([result])
    assert [p.name for p in folder.iterdir()] == ["scenario.toml"]
    loop["metrics"]["tracking"]["limit"] = 1e-9
    write(loop)
    assert not run(folder).passed
    assert not run(folder, record=True).notes


def test_without_baseline_and_limits_nothing_can_pass(loop: Any, write: Any) -> None:
    loop["metrics"]["tracking"].pop("limit")
    assert run(write(loop)).failures() == ["loop/nominal: no baseline: run with --record"]


def test_recorded_once_it_passes(loop: Any, write: Any) -> None:
    folder = write(loop)
    assert run(folder, record=True).passed
    assert sorted(p.name for p in folder.iterdir()) == ["baseline.csv", "baseline.toml", "scenario.toml"]
    assert (folder / "baseline.toml").read_text().startswith("# generated from scenario.toml")
    result = run(folder)
    assert result.passed, result.failures()
    assert result.verdicts[0].same is True
    assert result.verdicts[0].baseline == result.verdicts[0].value


def test_over_the_limit_names_scenario_metric_value_limit(loop: Any, write: Any) -> None:
    folder = write(loop)
    run(folder, record=True)
    value = run(folder).verdicts[0].value
    loop["metrics"]["tracking"]["limit"] = value * 0.99
    write(loop)
    (line,) = run(folder).failures()
    assert line == (f"loop/nominal: tracking (rms_percent of plant.y) = {value:.6g} exceeds the limit {value * 0.99:g}")


def test_a_run_over_its_limit_is_not_recorded(loop: Any, write: Any) -> None:
    loop["metrics"]["tracking"]["limit"] = 0.0
    folder = write(loop)
    assert not run(folder, record=True).passed
    assert not (folder / "baseline.toml").exists()


def test_twenty_percent_of_a_plant_parameter_fails(loop: Any, write: Any) -> None:
    folder = write(loop)
    run(folder, record=True)
    value = run(folder).verdicts[0].value
    loop["metrics"]["tracking"]["limit"] = 1.02 * value
    write(loop)
    assert run(folder).passed
    for key in ("plant.hysteresis_r", "plant.hysteresis_w", "plant.hysteresis_w0", "plant.g0_b"):
        loop["units"]["plant"]["set"] = {key.partition(".")[2]: "*1.2"}
        write(loop)
        lines = run(folder).failures()
        assert any("loop/nominal: tracking" in line and "changed against the baseline" in line for line in lines), key
    loop["units"]["plant"]["set"] = {"hysteresis_r": "*1.2"}
    write(loop)
    lines = run(folder).failures()
    assert any("loop/nominal: tracking" in line and "exceeds the limit" in line for line in lines)
    shown = terminal.verdicts([run(folder)])
    changed = sum("changed against" in line for line in lines)
    assert changed > 1
    assert shown.count("changed against the baseline") == 1, "the limits in full, of the changes the first"
    assert f"(and {changed - 1} more changed)" in shown
    assert "exceeds the limit" in shown


def test_with_an_override_the_limits_alone_decide(loop: Any, write: Any) -> None:
    folder = write(loop)
    run(folder, record=True)
    value = run(folder).verdicts[0].value
    for room, passed in ((100.0, True), (1.02, False)):
        loop["metrics"]["tracking"]["limit"] = room * value
        write(loop)
        found = run(folder, set={"plant.hysteresis_r": "*1.2"})
        assert found.passed == passed
        assert all("exceeds the limit" in line for line in found.failures())
        assert found.verdicts[0].same is False, "what changed is told, in JSON too"
        shown = terminal.verdicts([found])
        assert shown.count("changed against the baseline") == 1
        assert "more changed)" in shown
        assert "--record" not in shown


def test_a_guard_is_a_multiple_of_the_recorded_value(loop: Any, write: Any) -> None:
    """The smaller of limit and guard decides, with overrides and on a record too."""
    folder = write(loop)
    run(folder, record=True)
    old = run(folder).verdicts[0].value
    wider = {"plant.hysteresis_r": "*2"}
    value = run(folder, set=wider).verdicts[0].value
    assert value > 1.1 * old
    for guard, limit, passed in (
        (1.01 * value / old, 50.0, True),
        (0.99 * value / old, 50.0, False),
        (9.0, old, False),
    ):
        loop["guard"], loop["metrics"]["tracking"]["limit"] = guard, limit
        found = run(write(loop), set=wider)
        assert found.passed == passed
        assert found.verdicts[0].limit == pytest.approx(min(guard * old, limit))
        assert any("times the recorded value" in line for line in found.failures()) == (not passed and limit > old)
    loop["guard"], loop["metrics"]["tracking"]["limit"] = 0.99 * value / old, 50.0
    loop["units"]["plant"]["set"] = {"hysteresis_r": "*2"}
    before = (folder / "baseline.toml").read_text()
    assert not run(write(loop), record=True).passed
    assert (folder / "baseline.toml").read_text() == before
    (folder / "baseline.toml").unlink()
    assert run(folder, record=True).passed
    assert run(folder).passed


def test_a_case_keeps_a_value_of_its_own_unless_the_override_is_relative(loop: Any, write: Any) -> None:
    loop["case"] = [{"name": "nominal"}, {"name": "own", "set": {"pid.Kp": 0.25}}]
    folder = write(loop)
    for given, kept in ((2.0, 0.25), ("*2", 0.5)):
        for r in hy.run([folder], set={"pid.Kp": given}, engine="native"):
            value = {p.name: p for p in r.system.parts}["pid"].own.node("pid").value("Kp")[0]
            assert value == (kept if r.case == "own" else 2.0), "1 in the scenario"


def test_several_scenarios_are_shown_with_a_line_each(loop: Any, write: Any) -> None:
    folder = write(loop)
    run(folder, record=True)
    loop["units"]["plant"]["set"] = {"hysteresis_r": "*1.2"}
    one = run(write(loop))
    other = replace(one, system=replace(one.system, case=replace(one.system.case, scenario="other")), lines=())
    rows = [line.split() for line in terminal.verdicts([one, other, other]).splitlines()[2:4]]
    assert [row[:4] for row in rows] == [["loop", "0", "of", "1"], ["other", "2", "of", "2"]]
    assert terminal.verdicts([other]).splitlines()[2].split()[:3] == ["other", "nominal", "ok"]


def test_a_signal_that_changed_where_no_metric_looks_is_found(loop: Any, write: Any) -> None:
    """The metric counts rows after 0.01 s; a step disturbance that is gone by then shows in baseline.csv only."""
    folder = write(loop)
    run(folder, record=True)
    rows = (folder / "baseline.csv").read_text().splitlines()
    name, t, r, y = rows[5].split(",")
    rows[5] = ",".join([name, t, r, repr(float(y) + 1e-3)])
    (folder / "baseline.csv").write_text("\n".join(rows) + "\n")
    (line,) = run(folder).failures()
    assert line.startswith("loop/nominal: plant.y = ")
    assert "changed against the baseline" in line


def test_the_tolerance_is_relative(loop: Any, write: Any) -> None:
    folder = write(loop)
    run(folder, record=True)
    text = (folder / "baseline.toml").read_text()
    value = run(folder).verdicts[0].value
    for factor, good in ((1 + 1e-8, True), (1 + 1e-4, False)):
        (folder / "baseline.toml").write_text(text.replace(repr(value), repr(value * factor)))
        assert run(folder).passed is good


def test_an_unstable_loop_is_over_every_limit(loop: Any, write: Any, tmp_path: Path) -> None:
    """With a gain of 1e9 the values pass 1e154, so that their squares overflow: infinite is not within any limit."""
    loop["units"]["pid"]["values"]["Kp"] = 1e9
    loop["stop"] = 0.5
    loop["metrics"]["tracking"].pop("limit")
    result = run(write(loop), record=True, report=tmp_path / "report")
    assert result.failures()[0].endswith("is not finite")
    assert "Infinity" not in (tmp_path / "report" / "report.json").read_text()


def test_a_new_metric_or_case_needs_a_new_baseline(loop: Any, write: Any) -> None:
    folder = write(loop)
    run(folder, record=True)
    loop["metrics"]["peak"] = {"kind": "peak", "signal": "pid.u"}
    write(loop)
    assert run(folder).failures() == ["loop/nominal: no baseline: run with --record"]


@pytest.mark.parametrize(
    ("file", "text", "words"),
    [
        ("baseline.toml", "case = 1\n", ["baseline.toml", "case"]),
        ("baseline.csv", "", ["baseline.csv", "empty"]),
        ("baseline.csv", "a,b\nnominal,0,x,1\n", ["baseline.csv", "line 1"]),
        ("baseline.csv", "case,t\r,u\n", ["baseline.csv", "first line"]),
        ("baseline.csv", "case,t,u\nnominal,0,nan\n", ["baseline.csv", "line 2", "2 numbers"]),
        ("baseline.csv", "case,t,reference.r,plant.y\nnominal,0,x,1\n", ["baseline.csv", "line 2", "'x'"]),
        ("baseline.csv", "case,t,reference.r,plant.y\nnominal,0,1\n", ["baseline.csv", "line 2", "3 numbers"]),
    ],
)
def test_a_damaged_baseline_is_bad_input(loop: Any, write: Any, file: str, text: str, words: list[str]) -> None:
    folder = write(loop)
    run(folder, record=True)
    (folder / file).write_text(text)
    with pytest.raises(InputError) as caught:
        run(folder)
    for word in words:
        assert word in str(caught.value)


def test_a_changed_system_is_never_recorded(loop: Any, write: Any) -> None:
    folder = write(loop)
    with pytest.raises(InputError, match="--record"):
        run(folder, record=True, set={"pid.Kp": 2.0})
    assert not (folder / "baseline.toml").exists()


def test_progress_reaches_one(loop: Any, write: Any) -> None:
    seen: list[float] = []
    loop["case"] = [{"name": "a"}, {"name": "b", "stop": 0.01, "after": 0.0}]
    hy.run([write(loop)], engine="native", progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    assert len(seen) == 2
