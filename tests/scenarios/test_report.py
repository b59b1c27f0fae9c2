"""The report of a run: pages, their parts, the form for machines, two reports side by side."""

import json
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from engines import ready

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.report.explorer import Explored
from hystfmu.report.page import Section, Table
from hystfmu.report.plot import Line, Plot
from hystfmu.scenario import Cases, build, simulate
from hystfmu.scenario.outcome.result import CaseResult, Change, Verdict
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.report import cases, loops
from hystfmu.scenario.report import page as pages
from hystfmu.scenario.report.cases import case_plots, nearness, word_of
from hystfmu.scenario.report.compare import compare_reports
from hystfmu.scenario.report.loops import delay_budget
from hystfmu.scenario.report.page import write_report
from hystfmu.scenario.system.spec import MetricSpec, shipped_scenarios
from hystfmu.scenario.system.system import System


@pytest.fixture
def page(loop: Any, write: Any, tmp_path: Path) -> str:
    loop["text"] = "a <loop> & its friends"
    loop["delay"] = "as measured <at> the bench"
    loop["case"] = [{"name": "good"}, {"name": "bad", "limits": {"tracking": 1e-6}}]
    results = hy.run([write(loop)], engine="native")
    section = Section(
        "Identification",
        "how it went",
        [Table(["model", "rms"], [["pi", 0.25]])],
        [Plot("loop", "u", "y", [Line("measured", np.arange(5.0), np.arange(5.0) ** 2)])],
    )
    return write_report(results, tmp_path / "out", [section]).read_text()


def test_signals_are_drawn_by_their_units_of_measure(loop: Any, write: Any, tmp_path: Path) -> None:
    loop["units"]["plant"]["graph"]["outputs"][0]["unit"] = "um"
    results = hy.run([write(loop | {"record": ["plant.y", "pid.u"]})], engine="native")
    (drawn,) = (case_plots(r.system, r.trace) for r in results if r.trace is not None)
    signals = {p.y_label: [line.name for line in p.lines] for p in drawn if p.x_label == "t in s"}
    assert signals["value in um"] == ["plant.y"]
    assert signals["value"] == ["pid.u"]
    text = write_report(results, tmp_path / "out").read_text()
    assert all(f">{label}</text>" in text for label in signals)


def test_self_contained(page: str) -> None:
    assert "<script src" not in page
    assert not re.search(r"(src|href)\s*=\s*[\"']?(https?:|//)", page)
    assert "@import" not in page
    assert "url(" not in page.replace("url(#clip", "")  # of the same page
    assert len(page) < 200_000


def test_well_formed_and_escaped(page: str) -> None:
    body = page[page.index("<main>") : page.index("</main>") + 7]
    ET.fromstring(body)
    assert "a &lt;loop&gt; &amp; its friends" in page
    for word in (
        "Identification",
        "how it went",
        "order (Gauss-Seidel)",
        "Jacobi",
        "plant - reference - pid",
        "0.1 ms",
        "as measured &lt;at&gt; the bench",
    ):
        assert word in page
    assert "loop/bad: tracking (rms_percent of plant.y)" in page


def test_the_machine_form_says_the_same(page: str, tmp_path: Path) -> None:
    data = json.loads((tmp_path / "out" / "report.json").read_text())
    assert data["passed"] is False
    assert [r["case"] for r in data["results"]] == ["good", "bad"]
    metric = data["results"][1]["metrics"][0]
    assert metric["within"] is False
    assert metric["limit"] == 1e-6
    assert f"{metric['value']:.3g}" in page
    assert data["sections"][0]["tables"][0]["rows"] == [["pi", 0.25]]


def test_delay_budget_finds_hold_late_values_and_delay_blocks(loop: Any, write: Any) -> None:
    budget = delay_budget(ready(write(loop)))
    assert [(d.where, d.steps) for d in budget] == [("pid.u -> plant.u", 0.5)]  # the hold of the command

    loop["order"] = ["plant", "pid", "reference", "wait"]  # the controller now sees an old reference
    loop["units"]["wait"] = {"block": "delay", "dims": {"n": 3}}
    loop["connections"] |= {"wait.u": "pid.u", "plant.u": "wait.y"}
    budget = delay_budget(ready(write(loop)))
    assert {(d.where, d.steps) for d in budget} == {
        ("wait.y -> plant.u", 0.5),
        ("reference.r -> pid.y_d", 1.0),
        ("wait", 3.0),
    }


@pytest.mark.parametrize("values", [[0.0, 0.0], [5.0, 5.0], [1e-15, 2e-15], [-1e9, 1e9]])
def test_axes_of_flat_tiny_and_huge_signals(values: list[float]) -> None:
    svg = Plot("p", "x", "y", [Line("a", np.array([0.0, 1.0]), np.array(values))]).svg()
    ET.fromstring(svg)
    assert "nan" not in svg
    assert svg.count('class="grid"') >= 4


def test_the_worst_case_is_the_failed_one_that_exceeds_its_limit_most(loop: Any, write: Any, tmp_path: Path) -> None:
    limits = {"easy": 500.0, "near": 7.0, "over": 5.0, "far": 1.0, "farther": 0.5, "farthest": 0.1}
    loop["case"] = [{"name": name, "limits": {"tracking": limit}} for name, limit in limits.items()]
    folder = write(loop)
    hy.run([folder], engine="native", record=True)
    results = hy.run([folder], engine="native")
    value = results[0].verdicts[0].value
    assert 5.0 < value < 7.0
    found = sorted(results, key=nearness)
    assert [r.case for r in found] == list(limits)
    assert [nearness(r) for r in found] == [(limit < value, pytest.approx(value / limit)) for limit in limits.values()]
    assert [word_of(r) for r in found] == ["ok", "ok", *["failed"] * 4]
    text = write_report(results, tmp_path / "out").read_text()
    assert "Worst against its limit: loop/farthest" in text
    assert "Best: loop/easy" in text
    unfolded = re.findall(r'<details open="open"><summary><b class="bad">(\w+)</b>', text)
    assert unfolded == ["far", "farther", "farthest"]
    assert "1 more</summary>" in text  # failures above the first figure
    assert text.count('<a class="bad" href="#loop/') == 4


# ---- parts -----------------------------------------------------------------------------------------------------------
SPECS = {
    "peak": MetricSpec.model_validate({"kind": "peak", "signal": "a.y"}),
    "rms": MetricSpec.model_validate({"kind": "rms_percent", "signal": "a.y", "against": "b.y", "stroke": 2.0}),
}


def verdict(value: float, name: str = "rms", limit: float | None = 1.0, **more: Any) -> Verdict:
    within = math.isfinite(value) and (limit is None or value <= limit)
    return Verdict(name, SPECS[name].kind, value, limit, more.pop("baseline", None), within, more.pop("same", None))


def result(
    *verdicts: Verdict, scenario: str = "s", case: str = "c", lines: tuple[str, ...] = (), **more: Any
) -> CaseResult:
    told = SimpleNamespace(
        scenario=scenario, name=case, title=f"{scenario}/{case}", text=more.pop("text", ""), metrics=SPECS,
        record=("a.y",),
    )  # fmt: skip
    seconds, trace = more.pop("seconds", 0.25), more.pop("trace", None)
    return CaseResult(SimpleNamespace(case=told, newton=False), verdicts, lines, trace, seconds, **more)  # type: ignore


def run(y: Any, r: Any = None) -> Trace:
    y = np.asarray(y, dtype=float)
    return Trace(
        np.arange(len(y)) * 0.5, np.column_stack([y, np.zeros(len(y)) if r is None else r]), {"a.y": 0, "b.y": 1}, 1
    )


# ---- cells ---------------------------------------------------------------------------------------------------------


BELOW = " <small>≤ 1</small>"
WAS = f'{BELOW}<small class="was">was 0.25</small>'


@pytest.mark.parametrize(("value", "told", "fails", "bad", "after"), [
    (0.5, {}, True, False, BELOW),
    (0.5, {"limit": None}, True, False, ""),
    (1.5, {}, False, True, " <small>&gt; 1</small>"),
    (0.5, {"baseline": 0.25, "same": True}, True, False, BELOW),
    (0.5, {"baseline": 0.25, "same": False}, True, True, WAS),
    (0.5, {"baseline": 0.25, "same": False}, False, False, WAS),
    (0.5, {"same": False}, True, True, BELOW),
])  # fmt: skip
def test_the_cell_of_a_metric(value: float, told: dict[str, Any], fails: bool, bad: bool, after: str) -> None:
    """A changed value is marked only if the change fails the case."""
    assert cases._metric(verdict(value, **told), fails) == f"<td{cases.BAD * bad}>{value}{after}</td>"
    assert cases._metric(None, fails) == "<td></td>"


def test_the_curve_of_an_error() -> None:
    """From the lowest to the highest error of each piece, scaled to the largest; tenths in the path of a plot."""
    found = cases._curve(result(verdict(0.5), trace=run([0.0, 1.0, -2.0, 1.0])))
    d = "M1 10l23 -4 24 13 23 -13"  # (1, 10), (24, 6), (48, 19), (71, 6): steps in whole points
    assert found == f'<svg viewBox="0 0 72 20" aria-hidden="true"><path d="{d}"/></svg>'
    for trace in (None, run([0.0, 0.0]), run([0.0, np.inf])):
        assert cases._curve(result(verdict(0.5), trace=trace)) == ""
    many = cases._curve(result(verdict(0.5), trace=run(np.sin(np.arange(1000)))))
    assert many.partition("l")[2].count(" ") < 80


def test_the_longer_side_of_a_matrix_goes_downwards() -> None:
    some = [result(verdict(0.5), scenario=s, case=c) for s, c in [("p", "a"), ("q", "a"), ("q", "b"), ("q", "c")]]
    html = cases.matrix(some)
    assert re.findall(r'<th scope="col">(\w+)</th>', html) == ["case", "q", "p"]
    assert re.findall(r'<th scope="row">(\w+)</th>', html) == ["a", "b", "c"]
    assert html.count("<td></td>") == 2
    assert "rms (RMS in % of the stroke)" in html
    turned = cases.matrix(
        [result(verdict(0.5), scenario=c, case=s) for s, c in [("p", "a"), ("q", "a"), ("q", "b"), ("q", "c")]]
    )
    assert re.findall(r'<th scope="col">(\w+)</th>', turned) == ["scenario", "q", "p"]
    assert re.findall(r'<th scope="row">(\w+)</th>', turned) == ["a", "b", "c"]


# ---- for machines --------------------------------------------------------------------------------------------------
def test_values_as_json() -> None:
    found = pages._plain({1: (np.float64(0.5), np.int64(2), math.inf, [math.nan]), "a": {"b": None}})
    assert found == {"1": [0.5, 2, "inf", ["nan"]], "a": {"b": None}}
    assert json.dumps(found)


# ---- two runs ------------------------------------------------------------------------------------------------------
def report(folder: Path, name: str, cases: list[dict[str, Any]]) -> Path:
    path = folder / f"{name}.json"
    path.write_text(json.dumps({"version": name, "results": cases}))
    return path


def case(title: str, metrics: dict[str, Any], passed: bool = True, **more: Any) -> dict[str, Any]:
    scenario, name = title.split("/")
    listed = [{"metric": k, "value": v} for k, v in metrics.items()]
    return {"scenario": scenario, "case": name, "passed": passed, "metrics": listed} | more


def test_the_changes_between_two_reports(tmp_path: Path) -> None:
    old = report(tmp_path, "1", [case("s/a", {"x": 1.0, "y": 2.0}), case("s/b", {"x": 1.0}, False)])
    new = report(tmp_path, "2", [case("s/a", {"x": 1.0, "y": 3.0}), case("s/c", {"x": "inf"})])
    found = compare_reports(old, new, tmp_path / "out.html")
    assert found == [
        Change("s/a", "y", 2.0, 3.0),
        Change("s/b", "x", 1.0, None), Change("s/b", "verdict", "failed", "missing"),
        Change("s/c", "x", None, math.inf), Change("s/c", "verdict", "missing", "ok"),
    ]  # fmt: skip
    text = (tmp_path / "out.html").read_text()
    assert "3 of 4 figures differ, 1 of them are larger; 2 verdicts changed, 1 to failed or missing." in text
    assert compare_reports(old, old, tmp_path / "same.html") == []
    assert "All 3 figures are the same." in (tmp_path / "same.html").read_text()


def test_margins_are_compared_where_both_reports_have_them(tmp_path: Path) -> None:
    """A loop that became unstable has no peak and no delay margin: they count as the worst there are."""
    calm = {"margins": {"stable": True, "Ms_db": 3.0, "delay_steps": None}}
    wild = {"margins": {"stable": False, "Ms_db": None, "delay_steps": None}}
    plain = report(tmp_path, "1", [case("s/a", {"x": 1.0})])
    old, new = (report(tmp_path, n, [case("s/a", {"x": 1.0}, **more)]) for n, more in (("2", calm), ("3", wild)))
    assert compare_reports(old, new, tmp_path / "out.html") == [
        Change("s/a", "Ms, dB", 3.0, math.inf), Change("s/a", "delay margin, steps", math.inf, 0.0)
    ]  # fmt: skip
    assert compare_reports(plain, new, tmp_path / "out.html") == compare_reports(old, old, tmp_path / "out.html") == []


@pytest.mark.parametrize(
    ("signals", "good"),
    [({}, True), ({"t": [0.0], "y": [1.0]}, True), ({"y": [1.0]}, False), ({"t": [0.0], "y": [1.0, 2.0]}, False)],
)
def test_signals_have_equal_lengths(tmp_path: Path, signals: dict[str, list[float]], good: bool) -> None:
    path = report(tmp_path, "1", [case("s/a", {}, signals=signals)])
    if good:
        assert compare_reports(path, path, tmp_path / "out.html") == []
    else:
        with pytest.raises(InputError, match="must be lists of equal length that include the times 't'"):
            compare_reports(path, path, tmp_path / "out.html")


def test_the_rows_around_the_largest_error() -> None:
    """Three turns of the reference on each side; a turn is where it begins to go back, and a rest is none."""
    zigzag = np.concatenate([np.arange(5.0) if k % 2 == 0 else 4 - np.arange(5.0) for k in range(10)])
    turns = [k for k in range(1, len(zigzag) - 1) if zigzag[k] != zigzag[k - 1] and zigzag[k] in (0.0, 4.0)]
    for at in (0, 12, 25, 33, 49):
        found = cases._around(zigzag, at)
        inside = [t for t in range(len(zigzag)) if found.start <= t < found.stop]
        assert at in inside
    middle = cases._around(zigzag, 25)
    assert 0 < middle.start < 25 < middle.stop < len(zigzag)
    assert len([t for t in turns if middle.start <= t < 25]) in (2, 3)
    assert len([t for t in turns if 25 < t < middle.stop]) in (2, 3)
    line = np.arange(9.0)
    assert cases._around(line, 4) == slice(0, 9)
    two = np.array([0.0, 1, 2, 1, 0, 1, 2, 1, 0, 1, 2, 1, 0, 1, 2])
    # turns begin with the steps 2, 4, 6, 8, 10, 12; of those before and behind row 7 three each
    assert cases._around(two, 7) == slice(2, 13)
    assert cases._around(two, 6) == slice(0, 13)
    assert cases._around(two, 8) == slice(2, 15)


# ---- loops that a reader moves ---------------------------------------------------------------------------------------
def shipped_cases(name: str, *wanted: str) -> list[System]:
    return [build(c) for c in Cases(shipped_scenarios() / name).cases if c.name in wanted]


def shown(systems: list[System]) -> list[Explored]:
    found = loops.loop_explorer(systems)
    assert found is not None
    assert found.explorer is not None
    return list(found.explorer.models)


def test_the_range_is_that_of_the_run_and_the_inverse_that_of_the_loop() -> None:
    (system,) = shipped_cases("pid", "sine_10")
    (plant,) = shown([system])
    u = simulate(system, "native")["delay.y"]
    assert (plant.lo, plant.hi) == (u.min(), u.max())
    units = {p.name: p.own for p in system.parts}
    assert plant.name == "plant"
    assert plant.graph.file == units["plant"].to_bytes()
    assert plant.inverse is not None
    assert plant.inverse.file == units["inverse"].to_bytes()
    assert plant.sliders[0].name == "d"


def test_a_plant_with_other_blocks_is_a_model_of_its_own_one_with_other_values_is_not() -> None:
    systems = shipped_cases("pid", "sine_10", "up_400_10", "bouc_wen_sine_10")
    assert [m.name for m in shown(systems)] == ["plant", "plant of pid/bouc_wen_sine_10"]


def test_axes_carry_the_units_of_measure_of_the_loop() -> None:
    found = loops.loop_explorer(shipped_cases("stage/open_loop", "scan_100"))
    assert found is not None
    assert found.explorer is not None
    assert (found.explorer.u_label, found.explorer.y_label) == ("input in V", "output in um")
    (plant,) = found.explorer.models  # through converter and delay
    assert plant.inverse is not None


def test_an_inverse_that_reads_more_than_the_wanted_output_is_not_in_front() -> None:
    (plant,) = shown(shipped_cases("adaptive", "nominal_10"))
    assert plant.inverse is None


def test_loops_without_hysteresis_and_unstable_ones_have_none(loop: Any, write: Any) -> None:
    (plant,) = shown([ready(write(loop))])
    assert plant.inverse is None
    loop["units"]["pid"]["values"]["Kp"] = 1e9
    assert loops.loop_explorer([ready(write(loop))]) is None
    loop["units"]["pid"]["values"]["Kp"] = 1.0
    loop["units"]["plant"]["graph"]["blocks"][0] |= {"type": "scaling", "dims": {"n": 1}, "values": {"gain": [0.5]}}
    assert loops.loop_explorer([ready(write(loop))]) is None
