"""The scenarios of the repository: complete, sharp limits, the tracking that is asked for, a broken plant noticed."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from click.testing import CliRunner

from hystfmu.cli import main
from hystfmu.data import Dataset
from hystfmu.data.signals import decaying_sine
from hystfmu.data.synthetic_ipmc import RATE, STROKE, sensor
from hystfmu.identify import fit
from hystfmu.model import Model
from hystfmu.scenario import Scenario, build, run_scenarios
from hystfmu.scenario.verdict.baseline import Baseline
from hystfmu.studies import Study

ROOT = Path(__file__).parents[2] / "scenarios"
FOLDERS = sorted(p.parent for p in ROOT.glob("*/scenario.toml"))
PAPERS = sorted(p.parent for p in ROOT.glob("papers/*/scenario.toml"))
ROBUST = ("pid_robust",)  # tuned for margins in all corners, with cases of their own
STUDIES = sorted(f for f in ROOT.glob("*/gains.study.toml") if f.parent.name not in ROBUST)
FEEDBACK = {f.parent.name for f in STUDIES}
COLUMNS = ("open_loop", "cascade", "sliding_mode_2005", "pid", "pid_observer")
CONTROLLERS = (*COLUMNS[2:], "sliding_mode", "lead_lag", "super_twisting", "iterative_learning")
BOTH_PLANTS = {f"{name}{rate}" for name in (*COLUMNS[:2], *CONTROLLERS) for rate in ("", "_1khz")}
NOMINAL = ("sine_10", "sine_50", "sine_100")


def recorded(name: str) -> dict[str, dict[str, float]]:
    baseline = Baseline.load(ROOT / name)
    assert baseline is not None
    return baseline.metrics


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda p: p.name)
def test_complete_with_sharp_limits(folder: Path) -> None:
    scenario = Scenario(folder)
    assert scenario.spec.name == folder.name
    baseline = recorded(folder.name)
    assert list(baseline) == [c.name for c in scenario.cases]
    for case in scenario.cases:
        build(case)
        assert case.metrics.keys() == baseline[case.name].keys()
        for name, m in case.metrics.items():
            value = baseline[case.name][name]
            assert m.limit is not None, f"{case.title}: {name} has no limit"
            # 1e-10 % is the stated accuracy of the exact cascade; else a limit hugs what the loop reaches
            assert value <= m.limit <= max(1.3 * value, 1e-10), f"{case.title}: {name} {value} {m.limit}"


def test_both_plants_and_a_delay_case_everywhere() -> None:
    assert {f.name for f in FOLDERS} >= FEEDBACK | {"open_loop", "cascade", "cascade_static", "cascade_learned"}
    assert {f.name for f in FOLDERS} >= BOTH_PLANTS | {"cascade_static_1khz", "cascade_learned_1khz"}
    of_bouc_wen = "_bouc_wen"  # these have an inverse of the class of that plant
    assert {f.name.replace(of_bouc_wen, "") for f in FOLDERS if of_bouc_wen in f.name} >= BOTH_PLANTS
    for folder in (f for f in FOLDERS if not f.name.startswith("example_")):
        cases = Scenario(folder).cases
        if of_bouc_wen in folder.name:
            assert {c.units["plant"].model for c in cases} == {"../models/bouc_wen_plant.model.toml"}, folder.name
            continue
        if folder.name in FEEDBACK:
            assert any("delay" in c.units for c in cases), folder.name
        if not folder.name.endswith("_1khz"):
            assert {("bouc_wen" in (c.units["plant"].model or "")) for c in cases} == {True, False}, folder.name


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_network_inverse_stands_in_the_loop_of_every_controller(name: str) -> None:
    cases = [c for folder in (name, f"{name}_bouc_wen") for c in Scenario(ROOT / folder).cases]
    assert any("learned_inverse" in (c.units["inverse"].model or "") for c in cases)


@pytest.mark.parametrize("file", STUDIES, ids=lambda f: f.parent.name)
def test_gains_are_those_that_their_study_would_take(file: Path) -> None:
    """Within its ranges and its limit on chattering; the recorded cases give the score that decides."""
    study = Study(file)
    objective = study.spec.objective
    assert objective is not None
    assert objective.limits == {"variation": 2.0}
    cases = {c.name for c in study.cases}
    assert cases >= {c for c in recorded("pid_observer") if c.startswith(("sine", "mismatch", "disturb", "noise"))}
    graphs = {p.name: p.graph for p in build(study.cases[0]).parts}
    for key, p in study.parameters.items():
        unit, name = key.split(".")
        (value,) = graphs[unit].nodes[0].value(name)
        assert p.bounds[0] <= value <= p.bounds[1], key
    rows = [{"case": c, "metrics": m} for c, m in recorded(file.parent.name).items() if c in cases]
    assert all(r["metrics"]["variation"] <= 2.0 for r in rows)
    # ours meets every target of its study; the law of 2005 misses them by an order of magnitude under a mismatch
    score = objective.score(rows)
    if file.parent.name in ("pid", "pid_observer", "pid_observer_1khz", "lead_lag", "sliding_mode"):
        assert score <= 1
    if file.parent.name == "sliding_mode_2005":
        assert score > 20


@pytest.mark.parametrize("name", ["pid", "sliding_mode", "pid_observer", "lead_lag"])
def test_tracking_at_10_khz(name: str) -> None:
    """RMS in percent of stroke, between samples included: nominal 0.05; 20 % mismatch 0.07 at 10 Hz, 0.75 at 100 Hz."""
    tracking = {case: metrics["tracking"] for case, metrics in recorded(name).items()}
    for case in tracking.keys() & {"sine_1", "sine_10", "sine_50", "sine_100", "decaying", "random", "disturbance_10"}:
        assert tracking[case] <= 0.05, case
    for case in ("mismatch_up", "mismatch_down"):
        assert tracking[f"{case}_10"] <= 0.07
        assert tracking[f"{case}_100"] <= 0.75
    assert tracking.get("delay_10", 0.0) <= 0.05
    # the law of 2005, without integral action, is far off under the same mismatch
    assert recorded("sliding_mode_2005")["mismatch_up_10"]["tracking"] > 20 * tracking["mismatch_up_10"]


@pytest.mark.parametrize("name", [*COLUMNS[1:], "sliding_mode", "lead_lag", "super_twisting"])
def test_tracking_on_bouc_wen_with_an_inverse_of_its_class(name: str) -> None:
    """RMS in percent of stroke: nominal 0.05 up to 100 Hz; with integral action the targets under 20 % mismatch."""
    tracking = {case: metrics["tracking"] for case, metrics in recorded(f"{name}_bouc_wen").items()}
    assert all(tracking[case] <= 0.05 for case in NOMINAL)
    for case in ("bouc_wen_up", "mismatch_down"):
        if name in ("pid", "pid_observer", "sliding_mode", "lead_lag"):
            assert tracking[f"{case}_10"] <= 0.07
            assert tracking[f"{case}_100"] <= 0.75
    if name not in ("cascade", "sliding_mode_2005"):  # these do not remove what a network inverse leaves
        assert tracking["network_10"] <= 0.05
    wrong_class = recorded("cascade")["bouc_wen_sine_10"]["tracking"]
    assert wrong_class > 50 * tracking["sine_10"]


@pytest.mark.parametrize("name", ROBUST)
def test_robust_loops_survive_every_corner(name: str) -> None:
    """Gain -+20 % with 400 and 600 Hz, a step of delay that the design knows, and one more that it does not."""
    found = recorded(name)
    corners = [f"{gain}_{f}" for gain in ("up", "down") for f in (400, 600)]
    for case in (f"{c}_{r}" for c in corners for r in ("10", "100", "random", "two_steps")):
        assert found[case]["tracking"] <= 2.0, case
    assert found["sine_10"]["tracking"] <= 0.03
    assert found["sine_100"]["tracking"] <= 0.02
    assert found["random"]["tracking"] <= 0.03
    for case in (f"{c}_{r}" for c in corners for r in ("random",)):
        assert found[case]["tracking"] <= 0.12, case


def test_learning_beats_feedback_where_the_reference_repeats() -> None:
    learnt, fed_back = recorded("iterative_learning"), recorded("pid_observer")
    for case in learnt.keys() & fed_back.keys():
        assert learnt[case]["tracking"] <= 0.01, case
        assert learnt[case]["tracking"] < fed_back[case]["tracking"], case
    learnt, fed_back = recorded("iterative_learning_1khz"), recorded("pid_observer_1khz")
    for case in learnt.keys() - {"sine_100"}:  # nominal, the ripple of the held command is what is left
        assert learnt[case]["tracking"] < 0.6 * fed_back[case]["tracking"], case


@pytest.mark.parametrize("plant", ["", "_bouc_wen"])
@pytest.mark.parametrize("name", [n for n in CONTROLLERS if n != "iterative_learning"])
def test_tracking_at_1_khz(name: str, plant: str) -> None:
    tracking = {case: metrics["tracking"] for case, metrics in recorded(f"{name}{plant}_1khz").items()}
    for case, percent in zip(NOMINAL, (0.3, 1.4, 3.0), strict=True):
        assert tracking[case] <= percent, case
    # feedback makes the nominal case worse than feed-forward alone, and the README says so
    assert tracking["sine_100"] > recorded(f"cascade{plant}_1khz")["sine_100"]["tracking"]


def test_the_exact_inverse_leaves_rounding_only() -> None:
    for case, metrics in recorded("cascade_static").items():
        if case.startswith("exact"):
            assert metrics["worst"] <= 1e-10, case  # percent of stroke: 1e-12 of it


@pytest.mark.parametrize(
    ("names", "case"),
    [
        (("cascade_static",), None),
        (("pid", "pid_bouc_wen"), "sine_10"),
        pytest.param(("pid", "cascade_static", "pid_bouc_wen"), None, marks=pytest.mark.stress),
    ],
)
def test_they_pass_on_real_fmus(tmp_path: Path, names: tuple[str, ...], case: str | None) -> None:
    results = run_scenarios([ROOT / name for name in names], report_dir=tmp_path, case=case)
    assert {r.scenario for r in results} == set(names)
    assert [line for r in results for line in r.failures()] == []
    assert (tmp_path / "report.html").exists()


@pytest.mark.parametrize("folder", PAPERS, ids=lambda p: p.name)
def test_papers_are_complete(folder: Path) -> None:
    scenario = Scenario(folder)
    assert scenario.spec.name == folder.name
    assert list(recorded(f"papers/{folder.name}")) == [c.name for c in scenario.cases]
    assert all(m.limit is not None for c in scenario.cases for m in c.metrics.values())
    assert all(unit.fmu is None and unit.graph is None for c in scenario.cases for unit in c.units.values())


@pytest.mark.parametrize(
    ("name", "metric", "printed"),
    [
        ("zhao_tan_2008", "worst", 100 * 0.0617 / 2),
        ("zhao_tan_2008_model", "worst", 100 * 0.026735 / 2),
        ("zhao_tan_2008_model", "error", 100 * 0.01027 / 2),
        ("ipmc_bfbnn", "worst", 0.014),
        ("ipmc_bfbnn", "worst_without_f", 0.14),
    ],
)
def test_the_limits_are_the_figures_of_the_papers(name: str, metric: str, printed: float) -> None:
    for case in Scenario(ROOT / "papers" / name).cases:
        assert case.metrics[metric].limit == pytest.approx(printed, rel=1e-3)
        assert recorded(f"papers/{name}")[case.name][metric] <= printed


def test_the_loop_of_2005_tracks_better_than_its_inverse_and_that_better_than_none() -> None:
    none, alone, loop = (recorded(f"papers/yu_alici_2005_smc{end}") for end in ("_open_loop", "_inverse", ""))
    for case in none:
        assert 2 * loop[case]["tracking"] < alone[case]["tracking"], case
        assert 2 * alone[case]["tracking"] < none[case]["tracking"], case


def test_the_experiments_of_the_papers_run_from_their_folder(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["run", str(ROOT / "papers"), "--report", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "report.html").exists()
    assert all(folder.name in result.output for folder in PAPERS)


@pytest.mark.parametrize("cases", [("--case", "exact_sine_10"), pytest.param((), marks=pytest.mark.stress)])
@pytest.mark.parametrize("parameter", ["hysteresis_w", "hysteresis_w0", "hysteresis_r", "g0_b"])
def test_a_plant_that_is_20_percent_off_fails_with_scenario_metric_value_limit(
    parameter: str, cases: tuple[str, ...]
) -> None:
    result = CliRunner().invoke(main, ["run", str(ROOT / "cascade"), *cases, "--set", f"plant.{parameter}=*1.2"])
    assert result.exit_code == 1, result.output
    lines = [line for line in result.output.splitlines() if line.startswith("cascade/exact_sine_10: tracking (")]
    assert any("exceeds the limit" in line for line in lines), result.output


@pytest.mark.parametrize(
    ("name", "setting", "said"),
    [
        ("example_tube", "lag.a_1=*1.1", None),
        ("example_tube", "lag.a_1=*2", "(the tube of 0.0004 s and 0.01 of its largest value)"),
        ("example_final_states", "plant.r_3=0.45", "example_final_states/nominal: the final states of plant ("),
    ],
)
def test_an_example_says_what_its_file_promises(name: str, setting: str, said: str | None) -> None:
    assert f"--set '{setting}'" in (ROOT / name / "scenario.toml").read_text()
    result = CliRunner().invoke(main, ["run", str(ROOT / name), "--engine", "native", "--set", setting])
    assert result.exit_code == (0 if said is None else 1), result.output
    assert said is None or (said in result.output and "exceeds the limit" not in result.output)


def test_examples_show_what_a_coupling_and_substeps_are_for() -> None:
    loop, jacobi = recorded("example_iterative"), recorded("example_jacobi")
    assert loop["late"]["residual"] > 1e-3
    assert all(m["residual"] < 1e-11 for case, m in loop.items() if case != "late")
    assert jacobi["in_order"] == recorded("pid")["sine_100"]
    assert jacobi["in_parallel"]["tracking"] > 100 * jacobi["in_order"]["tracking"]
    own, hold = recorded("example_substeps"), recorded("example_hold")
    assert own["one_step"]["error"] > 9 * own["ten_substeps"]["error"]
    assert hold["held"]["error"] > 30 * hold["on_a_line"]["error"]


def _make_models(name: str = "make_models") -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "models" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("plant", ["backlash", "bouc_wen"])
def test_the_plants_are_what_their_maker_says(plant: str) -> None:
    make = getattr(_make_models(), plant)
    for name, dynamics in ((f"{plant}_plant", True), (f"{plant}_static", False)):
        graph = Model.load(ROOT / "models" / f"{name}.model.toml").graph
        assert graph.to_bytes() == make(dynamics).to_bytes()


@pytest.mark.stress
@pytest.mark.parametrize(("script", "count"), [("make_models", 15), ("make_paper_models", 13)])
def test_the_scripts_make_the_models_again(
    script: str, count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(ROOT / "models")
    made = _make_models(script)
    monkeypatch.setitem(made.save.__globals__, "HERE", tmp_path)
    made.main()
    files = sorted(f.name for f in tmp_path.iterdir())
    assert len(files) == count
    t = np.linspace(0, 3, 1501)
    x = 0.9 * np.exp(-0.3 * t) * np.sin(2 * np.pi * t)
    for name in files:
        again, shipped = (Model.load(folder / name).graph for folder in (tmp_path, ROOT / "models"))
        u = np.column_stack([x / 2**k for k in range(again.n_inputs)])
        network = any(n.type in ("mlp", "polynomial_narx") for n in again.nodes)
        atol = 0.02 if network else 1e-6  # trained weights depend on the libraries of linear algebra
        np.testing.assert_allclose(again.run(u, 1e-4), shipped.run(u, 1e-4), rtol=0, atol=atol, err_msg=name)


@pytest.mark.parametrize(("plant", "percent"), [("backlash", 0.55), ("bouc_wen", 3.5)])
def test_the_identified_models_fit_data_they_have_not_seen(plant: str, percent: float) -> None:
    """A decaying sine through the plant; identified from random reversals with 1 % noise."""
    t = np.linspace(0, 6, 3000)
    u = 1.2 * np.exp(-0.3 * t) * np.sin(2 * np.pi * t)
    y = Model.load(ROOT / "models" / f"{plant}_static.model.toml").graph.run(np.column_stack([u, 0 * u]))
    error = Model.load(ROOT / "models" / f"{plant}_identified.model.toml").predict(u, 1.0) - y
    assert 100 * np.sqrt(np.mean(error**2)) / np.ptp(y) < percent


def test_the_bouc_wen_plant_is_identified_with_its_dynamics() -> None:
    """From one broadband record with 0.1 % noise; held out: two sines through the plant, held at 10 kHz."""
    model = Model.load(ROOT / "models" / "bouc_wen_g0_identified.model.toml")
    assert model.fit["f_n"] == pytest.approx(500, rel=0.005)
    assert model.fit["zeta"] == pytest.approx(0.7, rel=0.03)
    h, finer = 1e-4, 10
    t = np.arange(3001) * h
    u = 0.7 * np.sin(2 * np.pi * 17 * t) + 0.4 * np.sin(2 * np.pi * 71 * t)
    held = np.append(u[0], np.repeat(u[1:], finer))
    plant = Model.load(ROOT / "models" / "bouc_wen_plant.model.toml").graph
    wanted = plant.run(np.column_stack([held, 0 * held]), h / finer)[::finer]
    error = model.predict(u, h) - wanted
    assert 100 * np.sqrt(np.mean(error**2)) / np.ptp(wanted) <= 0.1


def test_the_models_of_the_papers_are_what_their_maker_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "models")
    made = _make_models("make_paper_models")
    for name, graph in (("zhao_tan_actuator", made.zhao_tan_actuator()), ("ipmc_sensor", made.ipmc_sensor())):
        assert Model.load(ROOT / "models" / f"{name}.model.toml").graph.to_bytes() == graph.to_bytes()
    record = made.zhao_tan_record()
    exchanged = Dataset.from_signal(record.y, record.u, record.h, train=record.train)
    whole = fit(exchanged, "zhao_tan_mlp", operator="zhao_tan_inverse", starts=1, iterations=5)
    operator, network = made.parts(whole, "operator", "network").values()
    x = operator.graph.run(record.y, record.h)
    assert np.array_equal(network.graph.run(x, record.h), whole.predict(record.y))


def test_the_sensor_is_that_of_the_data() -> None:
    """Blocks at 1 kHz against numpy with finer steps and another integrator."""
    x = decaying_sine(10, 0.15, 100)
    voltage = Model.load(ROOT / "models" / "ipmc_sensor.model.toml").graph.run(STROKE * x, 1 / RATE)
    assert np.abs(voltage - sensor(x)).max() <= 1e-3 * np.ptp(voltage)
