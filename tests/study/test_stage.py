"""The nanopositioning stage: its scenarios, their generated parts, and draws that no file knows."""

from __future__ import annotations

import importlib.util
import tomllib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import stage_table

import hystfmu as hy
from hystfmu.design.feedforward import scan_feedforward, scan_harmonics
from hystfmu.graph import Graph, Input, Node, Output, blocks
from hystfmu.scenario import Cases, build
from hystfmu.scenario.engine.native import Native
from hystfmu.studies.sampling import sampler
from hystfmu.studies.spec import Study

STAGE = Path(__file__).parents[2] / "scenarios" / "stage"
QUICK = ("irc_repetitive", "xy_raster")
FOLDERS = sorted(p.parent for p in STAGE.glob("*/scenario.toml"))


def made(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, STAGE / "models" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "folder",
    [pytest.param(p, id=p.name, marks=() if p.name in QUICK else pytest.mark.stress) for p in FOLDERS],
)
def test_every_case_meets_its_requirement(folder: Path) -> None:
    results = hy.run([folder], engine="native")
    assert [line for r in results for line in r.failures()] == []
    assert all(v.limit is not None for r in results for v in r.verdicts)


@pytest.mark.parametrize("turn", [0.1, 0.5, 1.0])
def test_the_harmonics_are_those_of_the_reference(turn: float) -> None:
    """Against the discrete Fourier transform of the block, whose aliases are below 1e-7 of the fundamental."""
    r = blocks.Reference(shape="triangle", turn=turn)(np.zeros((8192, 0)), 1 / 8192)[:, 0]
    found = -2 * np.fft.rfft(r).imag / 8192
    n = np.arange(1, 40)
    assert np.abs(found[n] - scan_harmonics(n, turn)).max() <= 1e-7
    assert np.abs(found[n[1::2]]).max() <= 1e-12  # even ones


def test_the_feedforward_of_a_scan_makes_the_dynamics_follow_it() -> None:
    """In the steady state, at the samples, with the delay and the hold of the command: what is left are cut tones."""
    f, h, steps = 100.0, 1e-4, 2
    modes = Node("g0", "modes", {"n": 2}, {"f_n": [500.0, 1600.0], "zeta": [0.05, 0.05], "k": [0.9, 0.1]})
    graph = Graph([modes], [], [Input("u", ("g0.u",))], [Output("y", "g0.y")])
    tones = scan_feedforward(graph, f, h, turn=0.2, phase=0.4, delay=steps, highest=2000.0)
    t = np.arange(6001) * h
    command = tones["a"] @ np.sin(2 * np.pi * np.outer(tones["f"], t) + tones["ph"][:, None])
    late = np.r_[np.zeros(steps + 1), command][
        : len(t)
    ]  # the block takes the value at the end of a step as held over it
    y = graph.run(late[:, None], h).ravel()
    r = blocks.Reference(shape="triangle", frequency=f, turn=0.2, phase=0.4)(np.zeros((len(t), 0)), h)[:, 0]
    assert np.abs(y - r)[5000:].max() <= 0.01
    beyond = np.arange(21, 400)
    assert np.abs(scan_harmonics(beyond, 0.2)).sum() <= 0.01  # of which the cut tones are the most


@pytest.mark.parametrize(("file", "limit", "median"), [("draws_5", 0.55, 0.36), ("draws_20", 2.0, 0.85)])
def test_draws_of_today_track(file: str, limit: float, median: float) -> None:
    """Eight stages that no file knows: the quantiles of 1000 draws, with room for the few."""
    study = Study(STAGE / "irc_repetitive" / f"{file}.study.toml")
    (rows,) = sampler(study).batches()
    values = []
    for row in rows[:8]:
        (case,) = [c for c in Cases(STAGE / "irc_repetitive", study.settings(row)).cases if c.name == "scan_100"]
        system = build(case)
        run = Native(system, ["plant.y", "reference.r"]).run()
        t, e = run.t, run["plant.y"] - run["reference.r"]
        place = (100 * t) % 0.5
        on = (t >= case.metrics["lines"].after) & (place > 0.03) & (place < 0.47)
        values.append(100 * float(np.sqrt(np.mean(e[on] ** 2))) / 20)
    assert max(values) <= limit, values
    assert np.median(values) <= median, values


@pytest.mark.stress
@pytest.mark.parametrize("name", ["scan_100", "low_100", "high_100", "two_steps_100"])
def test_nothing_grows_over_600_periods(name: str) -> None:
    (case,) = [c for c in Cases(STAGE / "irc_repetitive").cases if c.name == name]
    run = Native(build(replace(case, stop=6.0)), ["plant.y", "reference.r"]).run()
    e = run["plant.y"] - run["reference.r"]
    rms = [np.sqrt(np.mean(e[(run.t >= end - 0.05) & (run.t < end)] ** 2)) for end in (0.2, 3.0, 6.0)]
    assert rms[1] <= rms[0]
    assert rms[2] <= 1.001 * rms[1]


def test_the_generated_parts_are_what_their_scripts_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    models = made("make_models")
    monkeypatch.setattr(models, "HERE", tmp_path / "models")
    models.write_scans()
    assert (tmp_path / "scans.toml").read_text() == (STAGE / "scans.toml").read_text()


@pytest.mark.parametrize("name", ["irc", pytest.param("ppf", marks=pytest.mark.stress)])
def test_the_filters_of_the_repetitive_parts_are_their_design(name: str) -> None:
    """To the digits of the file; nothing grows from period to period."""
    found = made("make_repetitive").design(name)
    written = tomllib.loads((STAGE / f"{name}_repetitive" / "repetitive.toml").read_text())
    values = written["units"]["repetitive"]["values"]
    assert np.abs(found.q - values["q"]).max() <= 1e-6
    assert np.abs(found.l - values["l"]).max() <= 1e-6
    assert max(found.contraction) <= 1 + 1e-6
    for case in written["case"]:  # other periods, or at rest: the same filters
        if "units" in case:
            assert case["units"]["repetitive"]["values"] == values


@pytest.mark.parametrize(
    "name", ["irc", *(pytest.param(n, marks=pytest.mark.stress) for n in stage_table.CONTROLLERS if n != "irc")]
)
def test_recorded_margins_and_settling_are_those_of_the_scenarios(name: str) -> None:
    script, recorded = made("run_margins"), stage_table.recorded("loops")[name]
    assert script.margins(name) | {"settling_s": script.settling(name)} == pytest.approx(recorded, rel=1e-6)


def test_recorded_draws_meet_what_the_stage_is_asked_for() -> None:
    """Median and 95 % with modes known to 5 %, median and worst to 20 %; every controller has its 1000 draws."""
    recorded = stage_table.recorded("draws")
    assert set(recorded) == set(stage_table.recorded("loops")) == set(stage_table.CONTROLLERS)
    for name in ("irc_repetitive", "ppf_repetitive"):
        well, roughly = recorded[name]["known_to_5"], recorded[name]["known_to_20"]
        assert well["median"] <= 0.25
        assert well["p95"] <= 0.5
        assert roughly["median"] <= 0.6
        assert roughly["worst"] <= 2
        assert well["unstable"] == roughly["unstable"] == 0
        assert well["draws"] == roughly["draws"] == 1000
