"""Baselines, tubes, loop area, final states, JUnit, what a record would change, two reports side by side."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from engines import ready

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.scenario import Cases, Change, build, simulate
from hystfmu.scenario.outcome.result import (
    Baseline,
    Kept,
    Record,
    changes,
    compare,
)
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.report.compare import compare_reports
from hystfmu.scenario.report.page import write_junit

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
    done = CliRunner().invoke(main, ["run", str(folder), "--engine", "native", "--record"])
    assert done.exit_code == 0, done.output
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
        Change("s/c", "y", 2.0, None),
        Change("s/c", "z", None, 3.0),
        Change("s/c", "a.y at 0.5 s", 2.0, 1.25),
        Change("s/c", "final states of u", "1", "2"),
        Change("s/c", "final states of v", None, "3"),
        Change("s/gone", "x", 4.0, None),
    ]
    assert changes("s", None, {"c": Record({"x": 1.0}, rows, {})}) == [Change("s/c", "x", None, 1.0)]
    assert changes("s", old, {"c": Record({"x": 1.0, "y": 2.0}, rows[:1], {"u": "1"})}) == [
        Change("s/gone", "x", 4.0, None)
    ]
