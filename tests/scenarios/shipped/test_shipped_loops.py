"""Shipped loops: adaptive inverse, internal model, rod, switching."""

import shlex
import tomllib
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import switching_table
import tuned
from click.testing import CliRunner
from scripts import loaded
from tracking_table import baseline

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.data import Dataset
from hystfmu.data.signals import training
from hystfmu.design import repetitive_filters
from hystfmu.identify import fit
from hystfmu.identify.estimate.dynamics import hysteresis
from hystfmu.inverse import inverse
from hystfmu.scenario import Cases, build
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import open_loop

# ---- adaptive --------------------------------------------------------------------------------------------------------
ROOT = Path(__file__).parents[3] / "scenarios"
FACTOR = 1.2  # error after a change, of that with a model identified anew
OF_DRAWS = 1.5  # the same for drawn changes: noise makes some models identified anew better than others
CASES = ("load_10", "load_100", "load_random")


def tracking(scenario: str, case: str, **settings: Any) -> float:
    """RMS error in percent of the stroke in the window of the case."""
    given = {name.replace("__", "."): value for name, value in settings.items()}
    (result,) = hy.run(ROOT / scenario, engine="native", case=case, set=given)
    return next(v.value for v in result.verdicts if v.metric == "tracking")


def identified_anew(gain: float, weights: float, seed: int) -> dict[str, Any]:
    """Settings of an inverse that does not learn, from a record of the changed plant with 1 % noise."""
    u = 1.3 * training(100, seed)
    r = np.linspace(0.05, 0.5, 10)
    z, y = np.zeros(10), np.empty(len(u))
    for k, now in enumerate(u):
        z = np.maximum(now - r, np.minimum(now + r, z))
        y[k] = gain * (0.3 * now + weights * 0.1 * z.sum())
    y += 0.01 * np.abs(y).max() * np.random.default_rng(seed).normal(size=len(y))
    model = fit(Dataset.from_signal(u, y, 0.01, "changed"), "prandtl_ishlinskii", N=20)
    block = inverse(model, "adaptive")
    made = block.graph.node("adaptive")
    offset = block.graph.node("ports").value("offset").tolist()
    values = {f"inverse__adaptive_{k}": made.value(k).tolist() for k in ("r", "w")}
    return {
        **values, "inverse__adaptive_w0": float(made.value("w0")[0]), "inverse__adaptive_w0_min": 1e-3,
        "inverse__adaptive_sd": [0.0] * 21, "inverse__ports_offset": offset, "gain__t_step": 0.0,
        "weights__t_step": 0.0,
    }  # fmt: skip


def changed(gain: float, weights: float) -> dict[str, float]:
    return {"gain__step": gain - 1, "weights__step": weights - 1}


@pytest.mark.turn("shipped loops")
def test_after_a_load_change_it_is_as_good_as_a_model_identified_anew() -> None:
    """Gain and weights +20 %: third period at 10 and 100 Hz; random reversals from 0.2 s after the change."""
    anew = identified_anew(1.2, 1.2, 3)
    for case in CASES:
        learned, offline = (tracking("adaptive", case, **changed(1.2, 1.2), **s) for s in ({}, anew))
        print(f"{case}: {learned:.4f} % of the stroke, identified anew {offline:.4f}, factor {learned / offline:.2f}")
        assert learned <= FACTOR * offline


@pytest.mark.stress
def test_after_any_change_it_meets_the_requirement() -> None:
    """Gain and weights drawn from 0.8 to 1.2.

    The third period at 100 Hz, 30 ms after the change, may be behind a model made anew.  There a change of gain and
    weights that nearly cancel stays below `change` and is learned as a drift: one in twenty is 0.06 to 0.106.
    """
    seed = int(np.random.default_rng().integers(1 << 31))
    print(f"seed {seed}")
    rng, limits = np.random.default_rng(seed), dict(zip(CASES, (0.05, 0.12, 0.05), strict=True))
    for gain, weights in [(1.2, 1.0), (1.0, 1.2), (0.8, 1.0), (1.0, 0.8), *rng.uniform(0.8, 1.2, (8, 2))]:
        anew = identified_anew(gain, weights, int(rng.integers(1 << 31)))
        for case in CASES:
            learned, offline = (tracking("adaptive", case, **changed(gain, weights), **s) for s in ({}, anew))
            print(f"gain {gain:.2f} weights {weights:.2f} {case}: {learned:.4f}, factor {learned / offline:.2f}")
            assert learned <= limits[case]
            assert case == "load_100" or learned <= OF_DRAWS * offline


def test_beside_a_feedback_nothing_is_lost() -> None:
    """With a reference that was drawn at run time; the same loop with an inverse that does not learn."""
    seed = int(np.random.default_rng().integers(1, 1 << 31))
    settings: dict[str, Any] = {"reference__seed": seed}
    learns, fixed = (tracking("adaptive_pid", f"nominal_random{end}", **settings) for end in ("", "_fixed"))
    print(f"seed {seed}: {learns:.5f} % of the stroke, does not learn {fixed:.5f}")
    assert learns <= 1.02 * fixed


def test_without_feedback_and_change_it_is_better_than_the_model_it_began_with() -> None:
    still = {"inverse__adaptive_sd": [0.0] * 21}
    assert tracking("adaptive", "nominal_10") <= 0.7 * tracking("adaptive", "nominal_10", **still)


@pytest.mark.turn("shipped loops")
@pytest.mark.parametrize("f_n", [400.0, 600.0])
def test_dynamics_that_are_20_percent_off_do_less_harm_than_without_learning(f_n: float) -> None:
    omega, still = 2 * np.pi * f_n, {"inverse__adaptive_sd": [0.0] * 21, **changed(1.0, 1.0)}
    plant = {"plant__g0_b": [omega**2], "plant__g0_a": [1.0, 1.4 * omega, omega**2]}
    for case in ("nominal_10", "load_100"):
        assert tracking("adaptive", case, **plant) <= 0.5 * tracking("adaptive", case, **plant, **still)


# ---- internal model --------------------------------------------------------------------------------------------------
SLOPES = (0.68, 1.64)  # of plant over inverse in the corners
LEARNT_AT = (0.8, 1.38)  # slopes for which the filters are designed


def opened(name: str, case: str) -> OpenedLoop:
    cases = {c.name: c for c in Cases(ROOT / name).cases}
    return open_loop(build(cases[case]), SLOPES)


def test_filters_of_the_scenario_are_those_of_the_design() -> None:
    """Of the loop without them, which is the scenario internal_model."""
    asked = tuned.recorded()["repetitive"]["values"]
    loops = [opened("internal_model", "sine_10").open_loop(1.0, 0.0)]
    corners = [opened("internal_model", f"up_{f}_10") for f in (400, 600)]
    loops += [c.open_loop(slope, 0.0) for c in corners for slope in LEARNT_AT]
    found = repetitive_filters(loops, cutoff=asked["design.cutoff"], gain=asked["design.gain"], n_q=9, n_l=40)
    assert max(found.contraction) < 0.85
    values = Cases(ROOT / "repetitive").spec.units["repetitive"].values
    assert values["q"] == pytest.approx(found.q, rel=1e-4, abs=1e-7)
    assert values["l"] == pytest.approx(found.l, rel=1e-3, abs=1e-6)


@pytest.mark.turn("shipped loops")
@pytest.mark.parametrize("name", ["internal_model", "repetitive"])
def test_loop_is_stable_in_all_corners_with_two_steps(name: str) -> None:
    assert opened(name, "sine_10").margins().Ms_db <= 6.0
    for f in (400, 600):
        corner = opened(name, f"up_{f}_10")
        assert all(corner.stable(slope, delay) for slope in SLOPES for delay in (0.0, 1.0)), f


def test_a_clipped_sine_costs_the_clipping_only_if_the_model_knows_the_limits() -> None:
    """With u up to 0.94 the plant reaches 1.3 u - 0.1 sum r_i: what the sine exceeds that by cannot be tracked."""
    reach = 1.3 * 0.94 - 0.1 * np.linspace(0.05, 0.5, 10).sum()
    r = np.sin(2 * np.pi * np.linspace(0, 1, 100001))
    clipping = 50 * np.sqrt(np.mean((np.clip(r, -reach, reach) - r) ** 2))
    found = baseline("internal_model")
    assert found["saturation_10"]["tracking"] == pytest.approx(clipping, rel=0.01)
    assert found["windup_10"]["tracking"] > 3 * clipping
    assert baseline("repetitive")["saturation_10"]["tracking"] == pytest.approx(clipping, rel=0.01)


def test_what_repeats_is_learnt_in_every_corner() -> None:
    """Periodic references: 10 Hz 0.02, corners 0.03; 100 Hz 0.015, corners 0.2; with two steps as well."""
    found = baseline("repetitive")
    assert found["sine_10"]["tracking"] <= 0.02
    assert found["sine_100"]["tracking"] <= 0.015
    corners = [f"{gain}_{f}" for gain in ("up", "down") for f in (400, 600)]
    for f, limit in (("10", 0.03), ("100", 0.2)):
        assert max(found[f"{c}_{steps}{f}"]["tracking"] for c in corners for steps in ("", "two_steps_")) <= limit


def test_what_the_amplifier_cannot_reach_does_not_fill_the_memory() -> None:
    """In two seconds of clipped sines the corrections stay; without the gate they grow from period to period."""
    largest = []
    for gate in ("*1", "*10"):
        scenario = Cases(ROOT / "repetitive").changed({"within.lo": gate, "within.hi": gate}, None)
        case = next(c for c in scenario.cases if c.name == "saturation_10")
        trace = Native(build(replace(case, stop=2.0)), ["repetitive.r", "reference.r"]).run()
        w = np.abs(trace["repetitive.r"] - trace["reference.r"])[1:].reshape(20, -1).max(axis=1)
        largest.append(w[-1])
        assert w[-1] > 1.5 * w[9] or gate == "*1"
    assert largest[0] < 0.01 < 0.1 < largest[1]


@pytest.mark.stress
def test_six_hundred_periods_in_the_worst_corner_do_not_grow() -> None:
    cases = {c.name: c for c in Cases(ROOT / "repetitive").cases}
    trace = Native(build(replace(cases["up_400_two_steps_10"], stop=60.0)), ["plant.y", "reference.r"]).run()
    error = 50 * (trace["plant.y"] - trace["reference.r"])
    rms = np.sqrt(np.mean(error[1:].reshape(600, -1) ** 2, axis=1))
    assert rms[20:].max() <= 0.03
    assert rms[-100:].mean() <= 1.01 * rms[20:120].mean()


# ---- rod -------------------------------------------------------------------------------------------------------------
REPOSITORY = Path(__file__).parents[3]
ROD = REPOSITORY / "scenarios" / "magnetostrictive"
LOOPS = ("open_loop", "cascade", "pid")
CORNERS = [f"{gain}_{f}" for gain in ("up", "down") for f in (400, 600)]
maker = loaded(ROD / "models" / "make_models.py", "make_rod")


def model(name: str) -> hy.Model:
    return hy.Model.load(ROD / "models" / f"{name}.model.toml")


def kept(loop: str) -> dict[str, float]:
    return {case: of["tracking"] for case, of in baseline(f"magnetostrictive/{loop}").items()}


def held(u: np.ndarray, h: float = 1e-4, finer: int = 10) -> np.ndarray:
    """Output of the plant for rows of u, each held for a step."""
    fine = np.append(u[0], np.repeat(u[1:], finer))
    return np.asarray(model("plant").graph.run(np.column_stack([fine, 0 * fine]), h / finer))[::finer].ravel()


def test_plant_and_record_are_what_their_maker_says() -> None:
    assert model("plant").graph.to_bytes() == maker.plant().to_bytes()
    data, shipped = maker.record(), hy.read(ROD / "record.csv")
    np.testing.assert_allclose(
        np.column_stack([shipped.t, shipped.u, shipped.y]), np.column_stack([data.t, data.u, data.y]), atol=1.1e-5
    )
    rest = shipped.y - held(shipped.u)
    assert np.std(rest) == pytest.approx(0.001 * np.ptp(shipped.y), rel=0.1), "noise of 0.1 % of the span"


@pytest.mark.stress
def test_the_stated_fit_makes_the_shipped_model_of_the_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It finds pinning and dynamics of a plant that is not of its class: the lag stands before the operator."""
    (line,) = (p for p in maker.__doc__.replace("\\\n", " ").splitlines() if p.strip().startswith("hystfmu fit"))
    words = shlex.split(line)[1:]
    words[words.index("-o") + 1] = str(tmp_path / "again.model.toml")
    monkeypatch.chdir(REPOSITORY)
    assert CliRunner().invoke(main, words).exit_code == 0
    again, shipped = hy.Model.load(tmp_path / "again.model.toml"), model("identified")
    assert again.key == shipped.key == "g0_jiles_atherton"
    t = np.arange(3001) * 1e-4
    u = 0.8 * np.sin(2 * np.pi * 17 * t) + 0.4 * np.sin(2 * np.pi * 71 * t)
    want = held(u)
    np.testing.assert_allclose(again.predict(u, 1e-4), shipped.predict(u, 1e-4), rtol=0, atol=1e-5 * np.ptp(want))
    error = shipped.predict(u, 1e-4) - want
    assert 100 * np.sqrt(np.mean(error**2)) / np.ptp(want) <= 0.05
    scale = maker.SWING / shipped.graph.node("input").value("gain")[0]  # from fields of the fit to those of the plant
    assert scale * shipped.graph.node("operator").value("k")[0] == pytest.approx(maker.MAGNET["k"], rel=0.02)
    assert again.fit["f_n"] == pytest.approx(500, rel=0.01)
    assert again.fit["zeta"] == pytest.approx(maker.ZETA, rel=0.02)
    assert again.fit["delay"] == pytest.approx(maker.EDDY, abs=1e-5)


def test_the_loops_take_what_is_identified() -> None:
    static = hysteresis(model("identified")).inverse("implicit")
    assert model("inverse").graph.to_bytes() == static.graph.to_bytes()
    for name in LOOPS[1:]:
        units, found = Cases(ROD / name).cases[0].units, model("identified").fit
        assert units["feedforward"].values["f_n"] == pytest.approx(found["f_n"], rel=1e-3)
        assert units["feedforward"].values["zeta"] == pytest.approx(found["zeta"], rel=1e-3)
        assert units["reference"].values["lead"] == pytest.approx(1.5e-4 + found["delay"], rel=1e-3)


def test_feedback_beats_the_inverse_and_that_no_compensation() -> None:
    none, alone, loop = (kept(name) for name in LOOPS)
    for case in alone.keys() & loop.keys():
        assert loop[case] < alone[case] < none[case], case
    for corner in CORNERS:
        assert 30 * loop[f"{corner}_10"] < alone[f"{corner}_10"], corner
        for f in ("10", "100"):
            assert loop[f"{corner}_two_steps_{f}"] <= 3 * loop[f"{corner}_{f}"] + 0.1, "stable with a step more"


def test_the_page_says_by_how_much_the_corners_are_missed() -> None:
    asked = tomllib.loads((REPOSITORY / "scenarios" / "loops" / "feedback.toml").read_text())["conditions"]
    found = kept("pid")
    misses = {
        f: max(found[f"{corner}_{f}"] for corner in CORNERS) / asked[f"corner_{f}"]["limits"]["tracking"]
        for f in ("10", "100", "broadband")
    }
    said = "by a factor of {:.2g} at 10 Hz, {:.2g} at 100 Hz and {:.2g} for the broadband reference".format(
        *misses.values()
    )
    assert said in " ".join((REPOSITORY / "python" / "docs" / "tracking.md").read_text().split())


@pytest.mark.turn("shipped loops")
@pytest.mark.parametrize("corner", ["up_400", "down_400"])
def test_the_gains_without_the_lag_of_the_field_are_unstable(corner: str) -> None:
    given, own = (Cases(REPOSITORY / "scenarios" / name) for name in ("pid", "magnetostrictive/pid"))
    gains = {f"pid.{name}": value for name, value in given.cases[0].units["pid"].values.items()}
    for scenario, stable in ((own, True), (own.changed(gains, None), False)):
        loop = open_loop(build(next(c for c in scenario.cases if c.name == f"{corner}_two_steps_10")))
        assert loop.margins().stable == stable


@pytest.mark.some(1)
@pytest.mark.parametrize("name", LOOPS)
def test_they_run_as_fmus_with_the_bits_of_the_core(name: str) -> None:
    loop = hy.Scenario.load(ROD / name)
    fmus, core = (loop.run("up_400_100", engine=engine).trace for engine in ("fmpy", "native"))
    assert fmus is not None
    assert core is not None
    assert fmus["plant.y"].tobytes() == core["plant.y"].tobytes()


@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["pid", *(pytest.param(name, marks=pytest.mark.stress) for name in LOOPS[:2])])
def test_every_case_meets_limit_and_baseline(name: str) -> None:
    results = hy.run([ROD / name], engine="native")
    assert [line for r in results for line in r.failures()] == []
    assert all(v.limit is not None for r in results for v in r.verdicts)


@pytest.mark.stress  # the corners without the lag of the field: above
def test_the_margins_hold() -> None:
    """Peak at most 6 dB, and every corner stable with one more step, for slopes from 0.54 to 1.64."""
    assert CliRunner().invoke(main, ["margins", str(ROD / "pid")]).exit_code == 0


# ---- switching -------------------------------------------------------------------------------------------------------
LAWS = ("sliding_mode_2005", "sliding_mode", "super_twisting")


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return loaded(REPOSITORY / "scenarios" / "models" / "run_switching.py")


@pytest.mark.some(2)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("plant", ["backlash", "bouc_wen"])
def test_the_record_is_what_its_script_computes(script: ModuleType, law: str, plant: str) -> None:
    where, unit, block, gains = script.linear()[law]
    error = script.worst(where, plant, "100", unit, block, gains)
    assert error == pytest.approx(switching_table.recorded()[law][plant]["100"], rel=1e-5)


@pytest.mark.parametrize("law", LAWS)
def test_no_law_is_30_percent_better_than_its_linear_law_or_the_pid(law: str) -> None:
    """Else the pages must not call it a PD or PID."""
    for plant in switching_table.PLANTS:
        for signal in switching_table.SIGNALS:
            error = switching_table.worst(law, plant, signal)
            assert error > 0.7 * switching_table.recorded()[law][plant][signal]
            assert error > 0.7 * switching_table.worst("pid", plant, signal)
    assert switching_table.LOOPS[law].endswith(("(PD)", "(PID)"))


def test_the_readme_states_the_figures() -> None:
    law, linear, pid = (
        f"{v:.2f}"
        for v in (
            switching_table.worst("sliding_mode", "backlash", "100"),
            switching_table.recorded()["sliding_mode"]["backlash"]["100"],
            switching_table.worst("pid", "backlash", "100"),
        )
    )
    said = " ".join((REPOSITORY / "README.md").read_text().split())
    assert (
        f"the error of sliding mode with integral action is {law} %. It is {linear} % if a linear term replaces the "
        f"switching term. The error of the best PID is {pid} %." in said
    )


@pytest.mark.turn("shipped loops")
@pytest.mark.some(1)
@pytest.mark.parametrize("scenario", ["pid", "pid_observer"])
def test_no_drawn_law_is_30_percent_better_than_both(script: ModuleType, scenario: str) -> None:
    """Than its linear law and than the tuned loop; drawn anew, too."""
    assert switching_table.recorded()[f"drawn_{scenario}"]["smallest_to_both"] > 0.7
    assert script.draws(scenario, 2, seed=7)["smallest_to_both"] > 0.7
