"""Verdicts against limits and a baseline, and how a terminal shows them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.scenario import Result
from hystfmu.scenario.outcome.result import CaseResult, LoopFigures, Verdict
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
        found = run(folder)
        assert found.passed is good
        assert [line.partition(" against")[0] for line in found.failures()] == (
            [] if good else [f"loop/nominal: tracking = {value:.9g} changed"]
        )


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


def test_a_reference_at_rest_has_no_stroke(loop: Any, write: Any) -> None:
    del loop["metrics"]["tracking"]["stroke"]
    loop["units"]["reference"]["values"]["amplitude"] = 0.0
    with pytest.raises(InputError, match=r"scenario\.toml: case nominal: metrics\.tracking: the stroke is zero"):
        run(write(loop))


def test_a_changed_system_is_never_recorded(loop: Any, write: Any) -> None:
    folder = write(loop)
    with pytest.raises(InputError, match="--record"):
        run(folder, record=True, set={"pid.Kp": 2.0})
    assert not (folder / "baseline.toml").exists()


# ---- on a terminal ---------------------------------------------------------------------------------------------------
def cells(line: str) -> list[str]:
    return line.split()


# ---- on a terminal -------------------------------------------------------------------------------------------------
def shown(
    value: float, limit: float | None = 1.0, kind: str = "peak", name: str = "m", base: float | None = None
) -> Verdict:
    within = math.isfinite(value) and (limit is None or value <= limit)
    return Verdict(name, kind, value, limit, base, within, None)


def result(
    *verdicts: Verdict, scenario: str = "s", case: str = "c", lines: tuple[str, ...] = (), **more: Any
) -> CaseResult:
    system: Any = SimpleNamespace(case=SimpleNamespace(scenario=scenario, name=case, title=f"{scenario}/{case}"))
    return CaseResult(system, verdicts, lines, None, more.pop("seconds", 0.25), **more)


def test_the_decisive_metric_is_nearest_to_its_limit() -> None:
    low, near, over = shown(0.1), shown(1.8, 2.0), shown(1.2, 1.0)
    none, nan = shown(9.0, None), shown(math.nan, None)
    assert terminal.decisive(result(low, near, none)) is near
    assert terminal.decisive(result(low, near, over)) is over
    assert terminal.decisive(result(none, low)) is low
    assert terminal.decisive(result(none, shown(8.0, None))) is none
    assert terminal.decisive(result(over, nan)) is nan
    assert terminal.decisive(result()) is None
    zero, above_zero = shown(0.0, 0.0), shown(1e-9, 0.0)
    assert terminal.decisive(result(low, zero)) is low
    assert terminal.decisive(result(over, above_zero)) is above_zero


def test_several_scenarios_have_a_line_each() -> None:
    """With the case that is nearest to a limit, and the worst margins of their loops."""
    some = [
        result(shown(0.5), scenario="p", loop=LoopFigures(True, 2.5, 3.0)),
        result(shown(0.9), scenario="p", case="d", loop=LoopFigures(True, 1.5, math.inf), seconds=0.5),
        result(shown(0.1), scenario="q", loop=LoopFigures(False, None, None)),
        result(scenario="r", lines=("r/c: stopped",)),
    ]
    lines = terminal.verdicts(some).splitlines()
    assert cells(lines[0]) == cells(
        "scenario passed nearest to a limit metric value limit largest Ms dB least delay margin, steps seconds"
    )
    assert cells(lines[-5]) == cells("p 2 of 2 d m 0.9 1 2.5 3 0.75")
    assert cells(lines[-4]) == cells("q 1 of 1 c m 0.1 1 unstable unstable 0.25")
    assert cells(lines[-3]) == cells("r 0 of 1 c stopped 0.25")
    assert lines[-1] == "3 of 4 cases passed"
    plain = [replace(r, loop=None) for r in some]
    assert "Ms" not in terminal.verdicts(plain)
