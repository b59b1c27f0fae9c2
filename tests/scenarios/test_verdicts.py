"""Verdicts against limits and baselines, tubes, final states, records, JUnit, two reports side by side."""

import json
import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from engines import ready
from invoked import invoked

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.scenario import Cases, Change, Result, build, simulate
from hystfmu.scenario.outcome.result import Baseline, CaseResult, Kept, LoopFigures, Record, Verdict, changes, compare
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.report import terminal
from hystfmu.scenario.report.compare import compare_reports
from hystfmu.scenario.report.page import write_junit
from hystfmu.scenario.running import Results


def run(folder: Path, **more: Any) -> Result:
    (result,) = hy.run([folder], engine="native", **more)
    return result


def test_without_any_baseline_the_limits_alone_decide_and_none_is_written(loop: Any, write: Any) -> None:
    folder = write(loop)
    result = run(folder)
    assert result.passed
    assert result.notes[-1].startswith("loop: no baseline")
    assert "no baseline: only" in terminal.verdicts([result])
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


@pytest.mark.parametrize("size", [1.0, 1e-9])  # um, or nm in m: rounding is relative to the reference
def test_the_tolerance_is_relative(loop: Any, write: Any, size: float) -> None:
    loop["units"]["reference"]["values"]["amplitude"], loop["units"]["pid"]["inputs"]["u_ff"] = size, 0.0
    loop["metrics"]["tracking"] = {"kind": "rms", "signal": "plant.y", "against": "reference.r", "limit": size}
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


@pytest.mark.parametrize(("file", "text", "words"), [
    ("baseline.toml", "case = 1\n", ["baseline.toml", "case"]),
    ("baseline.csv", "", ["baseline.csv", "empty"]),
    ("baseline.csv", "a,b\nnominal,0,x,1\n", ["baseline.csv", "line 1"]),
    ("baseline.csv", "case,t\r,u\n", ["baseline.csv", "first line"]),
    ("baseline.csv", "case,t,u\nnominal,0,nan\n", ["baseline.csv", "line 2", "2 numbers"]),
    ("baseline.csv", "case,t,reference.r,plant.y\nnominal,0,x,1\n", ["baseline.csv", "line 2", "'x'"]),
    ("baseline.csv", "case,t,reference.r,plant.y\nnominal,0,1\n", ["baseline.csv", "line 2", "3 numbers"]),
])  # fmt: skip
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
    html = Results(some)._repr_html_()
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in html.split("</tr>")]
    assert [len(row) for row in rows] == [0, 6, 6, 6, 6, 0]
    assert (rows[2], rows[4]) == (["p", "d", "m", "0.9", "1", "passed"], ["r", "c", "", "", "", "stopped"])
    assert html.endswith("<ul><li>r/c: stopped</li></ul>")
    assert repr(Results([])) == "Results([])"
    assert repr(Results(some)) == "Results(4 cases, 3 passed; failed: r/c)"
    plain = [replace(r, loop=None) for r in some]
    assert "Ms" not in terminal.verdicts(plain)


# ---- tubes -----------------------------------------------------------------------------------------------------------
H = 1e-4


def shifted(case: Any, late: float = 0.0, higher: float = 0.0) -> list[str]:
    """A sine of 50 Hz compared with a baseline that was recorded with it in time and without an offset."""
    t = H * np.arange(301)
    then = np.linspace(0, 300, 24).round() * H
    rows = np.column_stack([then, np.sin(100 * np.pi * then), np.zeros(24)])
    now = np.column_stack([np.sin(100 * np.pi * (t - late)) + higher, np.zeros(301)])
    baseline = Baseline({}, {"nominal": rows}, ("reference.r", "plant.y"), {})
    kept = Kept(build(case), baseline)
    for k in range(0, 301, 43):  # a run comes in blocks, and the tube needs some rows of each
        kept.add(Trace(t[k : k + 43], now[k : k + 43], {"reference.r": 0, "plant.y": 1}, 1, first=k))
    return compare(case, kept, baseline)


@pytest.mark.parametrize("time", [5.3e-4, 0.3e-4])  # more and less than a step
def test_a_tube_has_room_in_time(loop: Any, write: Any, time: float) -> None:
    """Where a sine is steep no room in value is needed; at its crest it needs 1 - cos(omega dt).

    Between two steps the signal is a straight line: (omega h)^2 / 8 below the sine.
    """
    room = 1 - np.cos(100 * np.pi * time) + (100 * np.pi * H) ** 2 / 8
    loop["tube"] = {"time": time, "value": 1.01 * room}
    (case,) = Cases(write(loop)).cases
    assert shifted(case, late=0.99 * time) == []
    assert shifted(case, late=-0.99 * time) == []
    (line,) = shifted(case, late=2 * time + 1e-4)
    assert line.startswith("loop/nominal: reference.r = ")
    assert f"the tube of {time:g} s" in line


def test_a_tube_has_room_in_value(loop: Any, write: Any) -> None:
    loop["tube"] = {"value": 0.01}
    (case,) = Cases(write(loop)).cases
    size = np.abs(np.sin(100 * np.pi * np.linspace(0, 300, 24).round() * H)).max()
    assert shifted(case, higher=0.0099 * size) == []
    assert len(shifted(case, higher=-0.0101 * size)) == 1
    assert len(shifted(case, late=1e-4)) == 1


def test_the_tolerance_follows_the_size_of_a_signal(loop: Any, write: Any) -> None:
    (case,) = Cases(write(loop)).cases
    for size in (1e-9, 1e9):
        rows = np.column_stack([np.arange(301) * H, np.full(301, size), np.zeros(301)])
        kept = Kept(build(case), Baseline({}, {"nominal": rows}, ("reference.r", "plant.y"), {}))
        now = np.column_stack([np.full(301, size * (1 + 2e-6)), np.zeros(301)])
        kept.add(Trace(H * np.arange(301), now, {"reference.r": 0, "plant.y": 1}, 1, first=0))
        found = compare(case, kept, Baseline({}, {"nominal": kept.rows() * [1, 1 / (1 + 2e-6), 1]}, case.record, {}))
        assert len(found) == 1, size
        assert compare(case, kept, Baseline({}, {"nominal": kept.rows()}, case.record, {})) == []
        (line,) = compare(case, kept, Baseline({}, {"nominal": kept.rows()[:-1]}, case.record, {}))
        assert "other rows or signals" in line


def test_a_run_within_its_tube_passes(loop: Any, write: Any) -> None:
    folder = write(loop)
    hy.run([folder], record=True, engine="native")
    text = (folder / "baseline.csv").read_text().splitlines()
    name, t, r, y = text[12].split(",")
    text[12] = f"{name},{t},{r},{float(y) + 0.004}"
    (folder / "baseline.csv").write_text("\n".join(text) + "\n")
    assert not hy.run([folder], engine="native")[0].passed
    loop["tube"] = {"time": 1e-4, "value": 0.01}
    assert hy.run([write(loop)], engine="native")[0].passed


# ---- final states ---------------------------------------------------------------------------------------------------
def test_final_states_are_the_same_in_every_engine(loop: Any, write: Any) -> None:
    loop["final_states"] = True
    hashes = []
    for kind in ("fmu2", "fmu3"):
        for unit in loop["units"].values():
            unit["as"] = kind
        system = ready(write(loop))
        hashes += [simulate(system, e).final_states for e in ("fmpy", "native")]  # type: ignore[arg-type]
    assert all(m == hashes[0] for m in hashes)
    assert set(hashes[0]) == {"plant", "reference", "pid"}
    assert len(set(hashes[0].values())) == 3


def test_another_state_with_the_same_outputs_is_found(loop: Any, write: Any) -> None:
    """A play without weight is not seen by any signal."""
    loop["final_states"] = True
    loop["units"]["plant"]["graph"]["blocks"][0]["values"]["w"] = [0.3, 0.2, 0.0]
    folder = write(loop)
    hy.run([folder], record=True, engine="native")
    assert hy.run([folder])[0].passed
    loop["units"]["plant"]["graph"]["blocks"][0]["values"]["r"] = [0.1, 0.2, 0.4]
    (result,) = hy.run([write(loop)], engine="native")
    (line,) = result.failures()
    assert line.startswith("loop/nominal: the final states of plant (")
    del loop["final_states"]
    assert hy.run([write(loop)], engine="native")[0].passed


# ---- records --------------------------------------------------------------------------------------------------------
def test_a_record_says_what_it_changes_and_asks(loop: Any, write: Any) -> None:
    folder = write(loop)
    seen: list[Change] = []

    def refuse(found: list[Change]) -> bool:
        seen[:] = found
        return False

    hy.run([folder], record=True, engine="native", confirm=refuse)
    assert not (folder / "baseline.toml").exists()
    assert [(c.title, c.what, c.old) for c in seen] == [("loop/nominal", "tracking", None)]
    hy.run([folder], record=True, engine="native")
    old = Baseline.load(folder)
    loop["units"]["pid"]["values"]["Kp"] = 1.1
    hy.run([write(loop)], record=True, engine="native", confirm=refuse)
    assert [c.what.split()[0] for c in seen] == ["tracking", "plant.y"]
    change = seen[0]
    assert change.old == old.metrics["nominal"]["tracking"]  # type: ignore[union-attr]
    assert isinstance(change.new, float)
    assert change.relative == pytest.approx(change.new / change.old - 1)
    before = (folder / "baseline.toml").read_bytes()
    hy.run([folder], record=True, engine="native")
    assert (folder / "baseline.toml").read_bytes() != before
    hy.run([folder], record=True, engine="native", confirm=refuse)
    assert seen == []


def test_the_command_shows_the_change_and_writes_in_a_pipe(loop: Any, write: Any) -> None:
    folder = write(loop)
    done = invoked(["run", str(folder), "--engine", "native", "--record"])
    assert "loop/nominal" in done.output
    assert "tracking" in done.output
    assert (folder / "baseline.toml").exists()
    done = CliRunner().invoke(main, ["run", str(folder), "--engine", "native", "--record", "--yes"])
    assert "the baseline does not change" in done.output


# ---- JUnit ----------------------------------------------------------------------------------------------------------
def test_junit_counts_failures_and_errors(loop: Any, write: Any, tmp_path: Path) -> None:
    loop["units"]["large"] = {"block": "sum", "dims": {"n": 1}, "values": {"k": [1e308]}}
    loop["order"].append("large")
    loop["metrics"]["tracking"].pop("limit")
    loop["connections"]["large.u"] = "reference.r"
    loop["case"] = [{"name": "good"}, {"name": "bad"}, {"name": "ends", "set": {"reference.amplitude": 1e6}}]
    folder = write(loop)
    results = hy.run([folder], engine="native")
    write_junit(results, tmp_path / "junit.xml")
    root = ET.parse(tmp_path / "junit.xml").getroot()
    assert root.tag == "testsuites"
    (suite,) = root
    assert suite.attrib["name"] == "loop"
    for of in (root, suite):
        assert (of.attrib["tests"], of.attrib["failures"], of.attrib["errors"]) == ("3", "2", "1")
    tests = {t.attrib["name"]: t for t in suite}
    assert [c.tag for c in tests["good"]] == ["failure", "system-out"]
    assert "no baseline" in tests["good"][0].attrib["message"]
    assert tests["ends"][0].tag == "error"
    assert "loop/ends: stopped" in (tests["ends"][0].text or "")


def test_junit_from_the_command_with_characters_that_xml_does_not_know(loop: Any, write: Any, tmp_path: Path) -> None:
    (result,) = hy.run([write(loop)], engine="native", record=True)
    object.__setattr__(result, "lines", ("a\x00b \x1b[31m <&>",))
    write_junit([result], tmp_path / "odd.xml")
    assert ET.parse(tmp_path / "odd.xml").find(".//failure").attrib["message"] == r"a\x00b \x1b[31m <&>"  # type: ignore[union-attr]
    path = tmp_path / "junit.xml"
    assert (
        CliRunner().invoke(main, ["run", str(write(loop)), "--engine", "native", "--junit", str(path)]).exit_code == 0
    )
    assert ET.parse(path).getroot().attrib["failures"] == "0"


# ---- two reports ----------------------------------------------------------------------------------------------------
def test_two_reports_side_by_side(loop: Any, write: Any, tmp_path: Path) -> None:
    folder = write(loop)
    hy.run([folder], engine="native", record=True, report=tmp_path / "a")
    loop["units"]["pid"]["values"]["Kp"] = 1.5
    hy.run([write(loop)], engine="native", report=tmp_path / "b")
    found = compare_reports(tmp_path / "a/report.json", tmp_path / "b", tmp_path / "diff.html")
    assert {c.what for c in found} == {"tracking", "Ms, dB", "delay margin, steps", "verdict"}
    assert (found[-1].old, found[-1].new) == ("ok", "failed")
    tracking = next(c for c in found if c.what == "tracking")
    assert isinstance(tracking.old, float)
    assert tracking.relative == pytest.approx(tracking.new / tracking.old - 1)  # type: ignore[operator]
    page = (tmp_path / "diff.html").read_text()
    ET.fromstring(page[page.index("<main>") : page.index("</main>") + 7])
    assert "3 of 3 figures differ" in page
    assert page.index("loop/nominal: the case of the largest change") < page.index("<table")  # the first figure
    assert page.count("<svg") == 2 + 2  # plant.y and its difference first; reference.r, plant.y
    assert page.count(">old</text>") == page.count(">new</text>") == 3  # both revisions in each
    assert page.index(">verdict<") < page.rindex(">tracking<")  # the largest change first
    signals = json.loads((tmp_path / "a/report.json").read_text())["results"][0]["signals"]
    system = ready(write(loop))
    assert signals["reference.r"] == pytest.approx(simulate(system, "native")["reference.r"].tolist(), abs=1e-6)
    command = ["compare", str(tmp_path / "a/report.json"), str(tmp_path / "a/report.json"), "-o", str(tmp_path / "x")]
    assert "the two reports are the same" in CliRunner().invoke(main, command).output


@pytest.mark.parametrize("text", ["", "[]", '{"version": "1", "results": [{}]}', "[" * 100_000])
def test_what_is_not_a_report_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "report.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"report\.json: not a report"):
        compare_reports(path, path, tmp_path / "diff.html")
    assert not (tmp_path / "diff.html").exists()


# ---- what a record would change ------------------------------------------------------------------------------------


def test_everything_that_a_record_would_change() -> None:
    rows = np.array([[0.0, 1.0, 5.0], [0.5, 2.0, 6.0]])
    old = Baseline({"c": {"x": 1.0, "y": 2.0}, "gone": {"x": 4.0}}, {"c": rows}, ("a.y", "b.y"), {"c": {"u": "1"}})
    new = rows + np.array([[0, 0.5, 0], [0, -0.75, 0]])
    assert changes("s", old, {"c": Record({"x": 1.0, "z": 3.0}, new, {"u": "2", "v": "3"})}) == [
        Change("s/c", "y", 2.0, None), Change("s/c", "z", None, 3.0), Change("s/c", "a.y at 0.5 s", 2.0, 1.25),
        Change("s/c", "final states of u", "1", "2"), Change("s/c", "final states of v", None, "3"),
        Change("s/gone", "x", 4.0, None),
    ]  # fmt: skip
    assert changes("s", None, {"c": Record({"x": 1.0}, rows, {})}) == [Change("s/c", "x", None, 1.0)]
    assert changes("s", old, {"c": Record({"x": 1.0, "y": 2.0}, rows[:1], {"u": "1"})}) == [
        Change("s/gone", "x", 4.0, None)
    ]
