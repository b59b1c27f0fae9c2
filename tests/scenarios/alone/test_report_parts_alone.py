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
from hystfmu.scenario.outcome.trace import Sweeps, Trace
from hystfmu.scenario.report import compare, junit, machine, matrix, page, worst_and_best
from hystfmu.scenario.report.compare import compare_reports
from hystfmu.scenario.system.spec import MetricSpec
from hystfmu.scenario.verdict.baseline import CHANGED, Change
from hystfmu.scenario.verdict.judge import Verdict
from hystfmu.scenario.verdict.result import LoopFigures, Result

SPECS = {
    "peak": MetricSpec.model_validate({"kind": "peak", "signal": "a.y"}),
    "rms": MetricSpec.model_validate({"kind": "rms_percent", "signal": "a.y", "against": "b.y", "stroke": 2.0}),
}


def verdict(value: float, name: str = "rms", limit: float | None = 1.0, **more: Any) -> Verdict:
    within = math.isfinite(value) and (limit is None or value <= limit)
    return Verdict(name, SPECS[name].kind, value, limit, more.pop("baseline", None), within, more.pop("same", None))


def result(
    *verdicts: Verdict, scenario: str = "s", case: str = "c", lines: tuple[str, ...] = (), **more: Any
) -> Result:
    told = SimpleNamespace(
        scenario=scenario, name=case, title=f"{scenario}/{case}", text=more.pop("text", ""), metrics=SPECS,
        record=("a.y",),
    )  # fmt: skip
    seconds, trace = more.pop("seconds", 0.25), more.pop("trace", None)
    return Result(SimpleNamespace(case=told, newton=False), verdicts, lines, trace, seconds, **more)  # type: ignore


def run(y: Any, r: Any = None) -> Trace:
    y = np.asarray(y, dtype=float)
    return Trace(
        np.arange(len(y)) * 0.5, np.column_stack([y, np.zeros(len(y)) if r is None else r]), {"a.y": 0, "b.y": 1}, 1
    )


# ---- which case comes first ----------------------------------------------------------------------------------------
def test_the_metric_that_stands_for_a_case() -> None:
    peak, rms = verdict(3.0, "peak"), verdict(0.5)
    assert worst_and_best.main_verdict(result(peak, rms)) is rms
    assert worst_and_best.main_verdict(result(peak)) is peak
    assert worst_and_best.main_verdict(result()) is None


def test_how_near_a_case_is_to_its_limit() -> None:
    near = worst_and_best.nearness
    assert near(result(verdict(0.5, limit=2.0))) == (False, 0.25)
    assert near(result(verdict(0.5, limit=None))) == (False, 0.5)
    assert near(result(verdict(0.5, limit=0.0), lines=())) == (False, 0.5)
    assert near(result(verdict(0.5), lines=("failed",))) == (True, 0.5)
    assert near(result(verdict(math.inf, limit=None))) == (True, math.inf)
    assert near(result()) == (True, math.inf)


def test_the_verdict_on_a_case_in_a_word() -> None:
    word = worst_and_best.word_of
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
        found = worst_and_best._around(zigzag, at)
        inside = [t for t in range(len(zigzag)) if found.start <= t < found.stop]
        assert at in inside
    middle = worst_and_best._around(zigzag, 25)
    assert 0 < middle.start < 25 < middle.stop < len(zigzag)
    assert len([t for t in turns if middle.start <= t < 25]) in (2, 3)
    assert len([t for t in turns if 25 < t < middle.stop]) in (2, 3)
    line = np.arange(9.0)
    assert worst_and_best._around(line, 4) == slice(0, 9)
    two = np.array([0.0, 1, 2, 1, 0, 1, 2, 1, 0, 1, 2, 1, 0, 1, 2])
    # turns begin with the steps 2, 4, 6, 8, 10, 12; of those before and behind row 7 three each
    assert worst_and_best._around(two, 7) == slice(2, 13)
    assert worst_and_best._around(two, 6) == slice(0, 13)
    assert worst_and_best._around(two, 8) == slice(2, 15)


def test_what_is_said_of_a_case() -> None:
    said = worst_and_best._said
    assert said("Worst case:", result(verdict(0.5))) == (
        '<p><b>Worst case: s/c</b><br/>rms 0.5 % of the stroke, limit 1: <b class="ok">ok</b></p>'
    )
    assert said("", result(verdict(2.0, "peak", None), lines=(f"a {CHANGED} b",))) == (
        '<p><b>s/c</b><br/>peak 2: <b class="bad">changed</b></p>'
    )
    assert said("Best case:", result()) == '<p><b>Best case: s/c</b> <b class="bad">stopped</b></p>'
    assert worst_and_best.worst_and_best([result(verdict(0.5))]) == ""


# ---- cells ---------------------------------------------------------------------------------------------------------
def test_a_cell_links_to_its_case() -> None:
    good, bad = result(verdict(0.51234)), result(verdict(2.0), lines=("x",))
    assert matrix.linked(good) == '<a class="ok" href="#s/c">0.512 ok</a>'
    assert matrix.linked(bad) == '<a class="bad" href="#s/c">2 failed</a>'
    assert matrix.linked(result(lines=("x",))) == '<a class="bad" href="#s/c">stopped</a>'
    assert matrix.place(result(case="<c>")) == "s/&lt;c&gt;"


def test_the_curve_of_an_error() -> None:
    """From the lowest to the highest error of each piece, scaled to the largest; tenths in the path of a plot."""
    found = matrix._curve(result(verdict(0.5), trace=run([0.0, 1.0, -2.0, 1.0])))
    d = "M1 10l23 -4 24 13 23 -13"  # (1, 10), (24, 6), (48, 19), (71, 6): steps in whole points
    assert found == f'<svg viewBox="0 0 72 20" aria-hidden="true"><path d="{d}"/></svg>'
    for trace in (None, run([0.0, 0.0]), run([0.0, np.inf])):
        assert matrix._curve(result(verdict(0.5), trace=trace)) == ""
    many = matrix._curve(result(verdict(0.5), trace=run(np.sin(np.arange(1000)))))
    assert many.partition("l")[2].count(" ") < 80


def test_value_and_limit_of_a_metric() -> None:
    def cell(v: Any, fails: bool = True) -> str:
        return matrix._metric(v, fails)

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
    row = matrix._row
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
    html = matrix.matrix(some)
    assert re.findall(r'<th scope="col">(\w+)</th>', html) == ["case", "q", "p"]
    assert re.findall(r'<th scope="row">(\w+)</th>', html) == ["a", "b", "c"]
    assert html.count("<td></td>") == 2
    assert "rms (RMS in % of the stroke)" in html
    turned = matrix.matrix(
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


def test_how_many_cases_passed() -> None:
    said = page._verdict([result(seconds=1.0), result(seconds=0.5)])
    assert '<b class="ok">2 of 2 cases passed</b>, 1.5 s of simulation.' in said
    assert "<ul" not in said
    bad = [result(lines=tuple(f"line {k}" for k in range(n))) for n in (3, 1)]
    assert '<b class="bad">0 of 2 cases passed</b>' in page._verdict(bad)
    assert page._verdict(bad[:1]).count("<li>") == 3
    assert "more</summary>" not in page._verdict(bad[:1])
    assert "<summary>1 more</summary><ul><li>line 0</li></ul>" in page._verdict(bad)


def test_the_drawings_that_fit_are_of_the_worst_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "case_plots", lambda system, trace: [system.case.title])
    monkeypatch.setattr(page, "figures", lambda plots: f"<{plots[0]}>")
    monkeypatch.setattr(page, "LEAST_DRAWN", 9)
    monkeypatch.setattr(page, "MOST_SHOWN", 0)
    some = [
        result(verdict(v), scenario=s, case=c, trace=run([0.0]))
        for s, c, v in [("p", "a", 0.1), ("p", "b", 0.3), ("q", "a", 0.2), ("q", "b", 0.9)]
    ]
    assert list(page._drawings(some)) == ["q/b", "p/b"]  # the worst of each scenario first: five characters each
    monkeypatch.setattr(page, "LEAST_DRAWN", 11)
    assert list(page._drawings(some)) == ["q/b", "p/b", "q/a"]
    monkeypatch.setattr(page, "MOST_SHOWN", 4 * page.PER_CASE + 12)
    assert list(page._drawings(some)) == ["q/b", "p/b", "q/a"]
    monkeypatch.setattr(page, "MOST_SHOWN", 4 * page.PER_CASE + 16)
    assert list(page._drawings(some)) == ["q/b", "p/b", "q/a", "p/a"]
    assert page._drawings([result(verdict(0.5))]) == {}


def test_what_is_to_be_seen_of_a_case(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "loop_rows", lambda system: [["order", "a"]])
    usual = [["order", "a"]]
    assert page._case(result(verdict(0.5)), "", usual, set()) == ""
    assert page._case(result(verdict(0.5), text="why"), "<svg/>", usual, set()) == (
        '<details><summary><b class="ok">c</b> - why</summary><div id="s/c"><svg/></div></details>'
    )
    failed = page._case(result(lines=("a < b",)), "", usual, {"s/c"})
    assert failed == (
        '<details open="open"><summary><b class="bad">c</b></summary>'
        '<div id="s/c"><ul><li class="bad">a &lt; b</li></ul></div></details>'
    )
    assert page._case(result(lines=("a",)), "", usual, {"s/other"}).startswith("<details><summary>")
    swept = page._case(result(verdict(0.5), counted=Sweeps(7, 5, 2)), "", usual, set())
    assert "<p>3.5 sweeps per step, at most 5 (Aitken relaxation)</p>" in swept
    assert "of this case" in page._case(result(verdict(0.5)), "", [["order", "b"]], set())


def test_several_scenarios_have_a_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "matrix", lambda results: "matrix")
    monkeypatch.setattr(
        page,
        "_scenario",
        lambda group, drawings, unfolded, curves: f"{group[0].scenario} {len(group)} {sorted(unfolded)} {curves}",
    )
    p, q = result(verdict(0.5), scenario="p"), result(verdict(0.5), scenario="q")
    assert page._scenarios([p, p]) == ["p 2 [] True"]
    all_cases = f"<section><h2>All cases</h2><details><summary>{page.ALL}</summary>matrix</details></section>"
    assert page._scenarios([p, q, p]) == [all_cases, "p 2 [] False", "q 1 [] False"]
    bad = [result(verdict(float(k)), case=f"c{k}", lines=("over",)) for k in (2, 5, 3, 4)]
    assert page._scenarios([p, *bad])[1:] == [
        "p 1 ['s/c3', 's/c4', 's/c5'] False",
        "s 4 ['s/c3', 's/c4', 's/c5'] False",
    ]


# ---- for machines --------------------------------------------------------------------------------------------------
def test_values_as_json() -> None:
    found = machine._plain({1: (np.float64(0.5), np.int64(2), math.inf, [math.nan]), "a": {"b": None}})
    assert found == {"1": [0.5, 2, "inf", ["nan"]], "a": {"b": None}}
    assert json.dumps(found)


def test_some_rows_of_the_recorded_signals(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "unit_of", lambda system, end: "um" if end == "a.y" else "")
    monkeypatch.setattr(machine, "MOST_ROWS", 3)
    found = machine._signals(result(trace=run([1 / 3, 2.0, 3.0, 4.0, 5.0])))
    assert found == {"signals": {"t": [0.0, 1.0, 2.0], "a.y": [0.3333333, 3.0, 5.0]}, "units": {"a.y": "um"}}
    assert machine._signals(result()) == {}


def test_junit_counts() -> None:
    some = [
        result(trace=run([0.0])), result(trace=run([0.0]), lines=("x",), seconds=1.0), result(lines=("y",)),
    ]  # fmt: skip
    assert junit._counts(some) == {"tests": "3", "failures": "1", "errors": "1", "time": "1.500"}


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


def test_the_answer_of_a_comparison() -> None:
    worse, better, gone = Change("a", "x", 1.0, 2.0), Change("a", "y", 2.0, 1.0), Change("a", "z", 1.0, None)
    assert compare._answer([worse, better, gone], [worse]) == "3 of 4 figures differ, 1 of them are larger."
    one = compare._answer([worse, Change("a", "verdict", "failed", "ok")], [])
    assert one == "1 of 1 figures differ, 1 of them are larger; 1 verdict changed, 0 to failed or missing."
    assert [compare._cells(c) for c in (worse, gone)] == [[1.0, 2.0, "+100"], [1.0, "", ""]]


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
