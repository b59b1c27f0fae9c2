"""The report is one file without script or request, says every verdict, and its machine form says the same."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from engines import ready

import hystfmu as hy
from hystfmu.report.page import Section, Table
from hystfmu.report.plot import Line, Plot
from hystfmu.scenario.report.cases import case_plots, nearness, word_of
from hystfmu.scenario.report.loops import delay_budget
from hystfmu.scenario.report.page import write_report


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


def test_a_plot_shows_the_extremes_of_a_dense_signal() -> None:
    y = np.zeros(100_000)
    y[77_777] = 1.0
    plot = Plot("spike", "t", "e", [Line("e", np.arange(len(y)), y)], envelope=True)
    lines = [p for p in ET.fromstring(plot.svg()).iter("path") if p.get("class") == "line c0"]
    start, steps = lines[0].get("d", "")[1:].split("l")
    heights = np.cumsum([int(start.split()[1]), *(int(v) for v in steps.split()[1::2])])
    assert heights.min() < 0.2 * heights.max()  # y points downwards
    assert len(heights) <= 250


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
