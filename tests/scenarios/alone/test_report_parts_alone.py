"""Parts of the report of a run, from results made by hand: which case comes first, what a cell and a line say."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome.result import CHANGED, CaseResult, Change, LoopFigures, Verdict
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.report import cases, compare, page
from hystfmu.scenario.report.compare import compare_reports
from hystfmu.scenario.system.spec import MetricSpec

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


# ---- which case comes first ----------------------------------------------------------------------------------------
def test_the_metric_that_stands_for_a_case() -> None:
    peak, rms = verdict(3.0, "peak"), verdict(0.5)
    assert cases.main_verdict(result(peak, rms)) is rms
    assert cases.main_verdict(result(peak)) is peak
    assert cases.main_verdict(result()) is None


def test_how_near_a_case_is_to_its_limit() -> None:
    near = cases.nearness
    assert near(result(verdict(0.5, limit=2.0))) == (False, 0.25)
    assert near(result(verdict(0.5, limit=None))) == (False, 0.5)
    assert near(result(verdict(0.5, limit=0.0), lines=())) == (False, 0.5)
    assert near(result(verdict(0.5), lines=("failed",))) == (True, 0.5)
    assert near(result(verdict(math.inf, limit=None))) == (True, math.inf)
    assert near(result()) == (True, math.inf)


def test_the_verdict_on_a_case_in_a_word() -> None:
    word = cases.word_of
    assert word(result(verdict(0.5))) == "ok"
    assert word(result(lines=("x",))) == "stopped"
    assert word(result(verdict(2.0), lines=("x",))) == "failed"
    assert word(result(verdict(2.0), verdict(0.5), lines=(f"a {CHANGED} b",))) == "failed"
    assert word(result(verdict(0.5), lines=("x", f"a {CHANGED} b"))) == "changed"
    assert word(result(verdict(0.5), lines=("x",))) == "no baseline"


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


def test_what_is_said_of_a_case() -> None:
    said = cases._said
    assert said("Worst case:", result(verdict(0.5))) == (
        '<p><b>Worst case: s/c</b><br/>rms 0.5 % of the stroke, limit 1: <b class="ok">ok</b></p>'
    )
    assert said("", result(verdict(2.0, "peak", None), lines=(f"a {CHANGED} b",))) == (
        '<p><b>s/c</b><br/>peak 2: <b class="bad">changed</b></p>'
    )
    assert said("Best case:", result()) == '<p><b>Best case: s/c</b> <b class="bad">stopped</b></p>'
    assert cases.worst_and_best([result(verdict(0.5))]) == ""


# ---- cells ---------------------------------------------------------------------------------------------------------
def test_a_cell_links_to_its_case() -> None:
    good, bad = result(verdict(0.51234)), result(verdict(2.0), lines=("x",))
    assert cases.linked(good) == '<a class="ok" href="#s/c">0.512 ok</a>'
    assert cases.linked(bad) == '<a class="bad" href="#s/c">2 failed</a>'
    assert cases.linked(result(lines=("x",))) == '<a class="bad" href="#s/c">stopped</a>'
    assert cases.place(result(case="<c>")) == "s/&lt;c&gt;"


def test_the_curve_of_an_error() -> None:
    """From the lowest to the highest error of each piece, scaled to the largest; tenths in the path of a plot."""
    found = cases._curve(result(verdict(0.5), trace=run([0.0, 1.0, -2.0, 1.0])))
    d = "M1 10l23 -4 24 13 23 -13"  # (1, 10), (24, 6), (48, 19), (71, 6): steps in whole points
    assert found == f'<svg viewBox="0 0 72 20" aria-hidden="true"><path d="{d}"/></svg>'
    for trace in (None, run([0.0, 0.0]), run([0.0, np.inf])):
        assert cases._curve(result(verdict(0.5), trace=trace)) == ""
    many = cases._curve(result(verdict(0.5), trace=run(np.sin(np.arange(1000)))))
    assert many.partition("l")[2].count(" ") < 80


def test_value_and_limit_of_a_metric() -> None:
    def cell(v: Any, fails: bool = True) -> str:
        return cases._metric(v, fails)

    assert cell(None) == "<td></td>"
    assert cell(verdict(0.51234, limit=None)) == "<td>0.512</td>"
    assert cell(verdict(0.5)) == "<td>0.5 <small>≤ 1</small></td>"
    assert cell(verdict(2.0)) == '<td class="bad">2 <small>&gt; 1</small></td>'
    assert (
        cell(verdict(0.5, limit=None, same=False, baseline=0.25))
        == '<td class="bad">0.5<small class="was">was 0.25</small></td>'
    )
    assert cell(verdict(0.5, limit=None, same=True, baseline=0.5)) == "<td>0.5</td>"
    changed = cell(verdict(0.5, limit=None, same=False, baseline=0.25), fails=False)
    assert changed == '<td>0.5<small class="was">was 0.25</small></td>'


def test_a_row_of_a_case() -> None:
    row = cases._row
    good = result(verdict(0.5), text="why", loop=LoopFigures(True, 2.5, math.inf))
    assert row(good, ["peak", "rms"], False, False, True) == (
        '<tr><th scope="row">c</th><td><span class="ok">ok</span></td><td></td><td>0.5 <small>≤ 1</small></td></tr>'
    )
    assert row(good, [], True, False, False) == (
        '<tr id="s/c"><th scope="row">c <small>why</small></th><td><span class="ok">ok</span></td>'
        "<td>2.5</td><td>inf</td></tr>"
    )
    failed = row(result(verdict(2.0), lines=("x",)), ["rms"], True, False, True)
    assert '<span class="bad">failed</span>' in failed
    assert failed.endswith("<td></td><td></td></tr>")
    assert '<span class="bad">stopped</span>' in row(result(lines=("x",)), [], False, False, True)
    assert '<a class="ok" href="#s/c">' in row(good, [], False, True, True)


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


# ---- the page ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("names", "title"),
    [("", "Closed loops"), ("a", "Loop a"), ("aba", "Loops a, b"), ("abc", "Loops a, b, c"), ("abcd", "Closed loops")],
)
def test_the_title_of_a_page(names: str, title: str) -> None:
    assert page._title([result(scenario=n) for n in names]) == title


# ---- for machines --------------------------------------------------------------------------------------------------
def test_values_as_json() -> None:
    found = page._plain({1: (np.float64(0.5), np.int64(2), math.inf, [math.nan]), "a": {"b": None}})
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


def test_the_largest_changes_come_first() -> None:
    small, large, gone = Change("a", "x", 2.0, 2.2), Change("b", "x", 1.0, 0.5), Change("c", "x", 1.0, None)
    verdicts = [Change(t, "verdict", "ok", "failed") for t in "abc"]
    ordered = compare._largest_first([small, verdicts[0], large, verdicts[1], gone, verdicts[2]])
    assert ordered == [verdicts[2], verdicts[1], verdicts[0], gone, large, small]
    assert compare._largest_first([Change("d", "x", 1.0, math.inf), large])[0].title == "d"


def test_the_signal_that_changed_most_is_drawn() -> None:
    def made(**signals: list[float]) -> Any:
        told = case(
            "s/a", {}, signals={"t": [0.0, 1.0], **{k + ".y": v for k, v in signals.items()}}, units={"b.y": "um"}
        )
        return compare._Case.model_validate(told)

    a = made(a=[0.0, 10.0], b=[0.0, 1.0])
    drawn = compare._drawn("s/a", a, made(a=[0.0, 10.5], b=[0.0, 1.5]))
    assert "b.y in um" in drawn  # half of its span, the other a twentieth
    assert "a.y" not in drawn
    assert ">a.y</text>" in compare._drawn("s/a", a, made(a=[0.0, 20.0], b=[0.0, 1.0]))
    assert compare._drawn("s/a", a, a) == ""
    assert compare._drawn("s/a", a, None) == compare._drawn("s/a", None, a) == ""
    later = compare._Case.model_validate(case("s/a", {}, signals={"t": [0.0, 2.0], "b.y": [0.0, 9.0]}))
    assert compare._drawn("s/a", a, later) == ""
    assert [p.title for p in compare._plots(a, later)] == ["a.y", "b.y"]
    assert [len(p.lines) for p in compare._plots(a, later)] == [1, 2]
    assert compare._plots(None, None) == []


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
