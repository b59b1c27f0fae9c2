"""Studies that design controllers, and the study of a stage."""

import tomllib
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import stage_table
import tuned
from scripts import loaded

import hystfmu as hy
from hystfmu import Graph, Input, InputError, Node, Output, blocks
from hystfmu.design import loop_shaping
from hystfmu.design.feedforward import scan_feedforward, scan_harmonics
from hystfmu.design.linear import python_control
from hystfmu.scenario import Cases, build
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.studies.spec import Study, in_parallel
from hystfmu.studies.task import Asked, sampler

LOOPS = tuned.SCENARIOS / "loops" / "gains.toml"
PID = """extends = "gains.toml"
scenario = "SCENARIO"
n = 8
cases = ["sine_100"]
objective = { targets = { sine_100 = 0.02 } }
parameters = { "pid.Kd" = { range = [1e-5, 3e-3], log = true }, "pid.Ki" = { range = [1e3, 1e5], log = true } }
start = { "pid.Kd" = 0.0003, "pid.Ki" = 4000.0 }
"""


def write(folder: Path, *changes: tuple[str, str]) -> Path:
    """Write a small study of the scenario pid with changes."""
    text = PID.replace("SCENARIO", (tuned.SCENARIOS / "pid").as_posix())
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "gains.toml").write_text(LOOPS.read_text())
    path = folder / "small.study.toml"
    path.write_text(text)
    return path


def test_a_search_starts_from_quantities_of_a_block(tmp_path: Path) -> None:
    """A start value for each of them, also if a block is computed from several."""
    quantities = '"plant.g0" = { second_order = { gain = [0.8, 1.2], f_n = [400, 600], zeta = [0.5, 0.9] } }, "pid.Ki"'
    given = 'start = { "plant.g0.gain" = 0.9, "plant.g0.f_n" = 450.0, "plant.g0.zeta" = 0.6, "pid.Ki" = 4000.0 }'
    path = write(tmp_path, ('"pid.Kd" = { range = [1e-5, 3e-3], log = true }, "pid.Ki"', quantities))
    path.write_text(path.read_text().partition("start =")[0] + given)
    first = next(sampler(Study(path)).batches())[0]
    assert first == tomllib.loads(given)["start"]


def test_the_response_to_a_memory_is_that_of_the_scenario_without_it() -> None:
    angles = np.geomspace(1e-3, 3.0, 40)
    opened = {
        name: open_loop(build(next(c for c in Cases(tuned.SCENARIOS / name).cases if c.name == "up_400_10")), (1, 1))
        for name in ("internal_model", "repetitive")
    }
    for slope in (0.7, 1.4):
        L = opened["internal_model"].open_loop(slope, 0.0)(np.exp(1j * angles))
        assert opened["repetitive"].learnt(angles, slope) == pytest.approx(L / (1 + L), rel=1e-6)
    with pytest.raises(InputError, match="must have a memory of a period"):
        opened["internal_model"].learnt(angles, 1.0)


@pytest.mark.parametrize("sizes", [[7], [3, 4], [4, 3], [2, 5]])
def test_parts_in_parallel_add_up_and_keep_pairs_together(sizes: list[int]) -> None:
    """Poles in the order real, pair, real, pair, real: some cuts by speed would part a pair."""
    control = python_control()
    poles = np.array([-1.0, -3 + 4j, -3 - 4j, -20.0, -30 + 90j, -30 - 90j, -500.0])
    gains = np.array([2.0, 1 - 3j, 1 + 3j, -5.0, 4 + 1j, 4 - 1j, 70.0])
    s = 1j * np.geomspace(0.1, 1e4, 60)
    want = (gains / (s[:, None] - poles)).sum(axis=1)
    G = control.ss(control.tf(1, [1, 1])) * 0
    for p, g in zip(poles[[0, 3, 6]].real, gains[[0, 3, 6]].real, strict=True):
        G += control.ss([[p]], [[1.0]], [[g]], [[0.0]])
    for k in (1, 4):
        G += control.ss(control.tf([2 * gains[k].real, -2 * (gains[k] * poles[k + 1]).real], np.poly(poles[k : k + 2])))
    G = control.ss(G.A[1:, 1:], G.B[1:], G.C[:, 1:], G.D)  # without the term that it started from
    parts = in_parallel(G.A, G.B, G.C, sizes)
    assert [len(a) - 1 for _, a in parts] == sizes
    assert all(len(b) == len(a) - 1 and a[-1] == pytest.approx(1.0) for b, a in parts)
    assert sum(control.tf(b, a)(s) for b, a in parts) == pytest.approx(want, rel=1e-8)


@pytest.mark.parametrize("name", ["h_infinity", "stage/h_infinity"])
def test_the_robust_controller_of_a_scenario_is_that_of_its_weight(name: str) -> None:
    """Against the design by hand: dynamics from a data sheet, Pade approximant, weight written out."""
    control = python_control()
    study = tuned.study(name)
    assert study.spec.design is not None
    v = tuned.drawn(name)
    if name == "h_infinity":
        w = 2 * np.pi * 500
        G = control.tf([w**2], [1.0, 1.4 * w, w**2])
        K, K_1, K_2, T_z, T_p = (v[f"h_infinity.{k}"] for k in ("lead_K", "pi_1_Ki", "pi_2_Ki", "lead_T_z", "lead_T_p"))
        W = control.tf([T_z, 1], [T_p, 1]) * control.tf([K, K * K_1], [1, 0]) * control.tf([1, K_2], [1, 0])
        names = ["h_infinity.slow", "h_infinity.fast"]
    else:
        modes = ((500.0, 0.02, 0.9), (1600.0, 0.01, 0.1))
        first, second = (
            control.ss(control.tf([k * (w := 2 * np.pi * f) ** 2], [1, 2 * z * w, w**2])) for f, z, k in modes
        )
        G = (first + second) * control.ss(control.tf([1], [1 / (2 * np.pi * 1e4), 1]))  # amplifier
        W = control.tf([v["controller.integral_Ki"]], [v["controller.roll_off_a_1"], 1, 0])
        names = ["controller.slow", "controller.fast"]
    found = loop_shaping(G * control.ss(control.tf(*control.pade(1.5e-4, 2))), W)
    points = 1j * np.geomspace(10.0, 1e5, 50)
    parts = [control.tf(tuned.shipped(study, f"{n}_b"), tuned.shipped(study, f"{n}_a"))(points) for n in names]
    assert sum(parts) == pytest.approx(found.robust(points), rel=1e-4)
    assert found.b_opt > 0.25, "a weight that does not ask for too much"
    assert name != "h_infinity" or found.b_opt == pytest.approx(0.38, abs=0.005), "as its text says"


@pytest.mark.turn("designs of a study")
def test_the_first_trial_is_the_one_that_the_file_states(tmp_path: Path) -> None:
    (first, *others) = next(iter(Asked(Study(write(tmp_path))).batches()))
    assert first == {"pid.Kd": 0.0003, "pid.Ki": 4000.0}
    assert all(v != first for v in others)


@pytest.mark.turn("designs of a study")
def test_a_trial_outside_the_linear_limits_is_not_simulated(tmp_path: Path) -> None:
    """And a second call finds all rows; the first trial is inside."""
    pytest.importorskip("pyarrow")
    path = write(tmp_path)
    outcome = hy.study(path, tmp_path / "out", workers=1)
    left_out = [r for r in outcome.rows if r["status"] == "outside"]
    assert 0 < len(left_out) < len(outcome.rows) == 8
    assert outcome.ran == 8 - len(left_out)
    assert outcome.rows[0]["status"] == "ok"
    assert not outcome.failed
    limits = Asked(Study(path))._loop
    assert limits is not None
    for r in outcome.rows:
        excess = limits.excess(r["values"])
        broken = [k for k, v in excess.items() if v > 0]
        assert r["reason"] == (f"breaks a limit of the loop: {', '.join(broken)}" if broken else "")
    again = hy.study(path, tmp_path / "out", workers=1)
    assert (again.ran, again.rows) == (0, outcome.rows)
    assert f"{len(left_out)} left out by the limits of the loop" in outcome.report.read_text()


REPETITIVE = 'design = { method = "repetitive_filters", unit = "r", loops = [{ case = "sine_100" }] }\nn = 8'
REFUSED: list[tuple[Any, str]] = [
    (('"pid.Kd" = 0.0003, ', ""), "start: must name the parameters, each once. pid.Kd is in one of them only."),
    (("0.0003", "0.3"), "start: pid.Kd: must lie in its range. Got 0.3 instead."),
    (("n = 8", REPETITIVE), "design: no parameter 'design.cutoff'; there are pid.Kd, pid.Ki"),
    (("pid.Kd", "design.cutoff"), "parameters: 'design.cutoff' needs a table [design]"),
]


@pytest.mark.parametrize(
    ("change", "line"), REFUSED, ids=[line.split(":")[0] + str(k) for k, (_, line) in enumerate(REFUSED)]
)
def test_what_does_not_fit_is_refused_in_one_line(tmp_path: Path, change: tuple[str, str], line: str) -> None:
    with pytest.raises(InputError) as e:
        Study(write(tmp_path, change))
    assert line in str(e.value)
    assert "\n" not in str(e.value)


# ---- stage -----------------------------------------------------------------------------------------------------------
STAGE = Path(__file__).parents[2] / "scenarios" / "stage"
QUICK = ("irc_repetitive", "xy_raster")
FOLDERS = sorted(p.parent for p in STAGE.glob("*/scenario.toml"))


def made(name: str) -> ModuleType:
    return loaded(STAGE / "models" / f"{name}.py")


@pytest.mark.turn("designs of a study")
@pytest.mark.some(1)
@pytest.mark.parametrize(
    "folder", [pytest.param(p, id=p.name, marks=() if p.name in QUICK else pytest.mark.stress) for p in FOLDERS]
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


@pytest.mark.turn("designs of a study")
@pytest.mark.some(1)
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
