"""The yield of a study, and two studies side by side."""

import json
import math
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from decay import LAG
from invoked import invoked
from scipy.stats import binom

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.scenario import Cases, build
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.system.case import delayed
from hystfmu.studies.compare import _sign_test, compare_studies
from hystfmu.studies.figures import effects
from hystfmu.studies.spec import Study
from hystfmu.studies.summary import interval, read_study
from hystfmu.studies.task import loop_metrics

LOOP = Path(__file__).parents[2] / "scenarios" / "pid"
DRAWS: dict[str, Any] = {
    "method": "random",
    "n": 40,
    "seed": "run",
    "parameters": {"command.step": {"range": [1.0, 4.0]}, "lag.b": {"scale": [0.5, 2.0]}},
    "limits": {"one": {"last": 3.0}, "half": {"peak": 3.5}},
}


def test_effects_of_ishigami_are_those_in_closed_form() -> None:
    """sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1 (Ishigami & Homma 1990), from draws that change with every run."""
    x = np.random.default_rng().random((600, 3))
    a, b, c = np.pi * (2 * x.T - 1)
    y = np.sin(a) + 7 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)
    alone, second, both = (1 + 0.1 * np.pi**4 / 5) ** 2 / 2, 49 / 8, 0.01 * np.pi**8 * 8 / 225
    found, total = effects(x, np.column_stack([y, np.ones(len(y))])), alone + second + both
    assert found.first[:, 0] == pytest.approx([alone / total, second / total, 0], abs=0.01)
    assert found.total[:, 0] == pytest.approx([(alone + both) / total, second / total, both / total], abs=0.01)
    assert found.explained[0] > 0.99
    assert not found.total[:, 1].any()


def test_effects_of_levels() -> None:
    """a + 2 a b + c on -1, 0, 1: variances 2/3, 4 * 4/9 and, of a parameter that is not drawn, 0."""
    a, b, c = (v.ravel() for v in np.meshgrid([0.0, 0.5, 1.0], [0.0, 0.5, 1.0], [0.0]))
    x = np.tile(np.column_stack([a, b, c]), (2, 1))
    y = (2 * x[:, 0] - 1) * (1 + 2 * (2 * x[:, 1] - 1))
    found = effects(x, y[:, None])
    assert found.first[:, 0] == pytest.approx([3 / 11, 0, 0], abs=1e-12)
    assert found.total[:, 0] == pytest.approx([1, 8 / 11, 0], abs=1e-12)


def test_the_interval_is_where_the_binomial_tails_are_a_fortieth() -> None:
    for inside, draws in ((997, 1000), (3, 7), (514, 1000)):
        lo, hi = interval(inside, draws)
        assert binom.sf(inside - 1, draws, lo) == pytest.approx(0.025, rel=1e-9)
        assert binom.cdf(inside, draws, hi) == pytest.approx(0.025, rel=1e-9)
    assert interval(0, 20) == pytest.approx((0, 1 - 0.025**0.05))
    assert interval(1000, 1000) == pytest.approx((0.025**0.001, 1))


def test_the_share_is_that_of_the_closed_form_and_the_worst_draw_runs_again(
    write: Any, tmp_path: Path, monkeypatch: Any
) -> None:
    outcome = hy.study(write(**DRAWS), tmp_path / "out", workers=1)
    values = {row["variation"]: row["values"] for row in outcome.rows}
    good = sum(
        v["command.step"] * v["lag.b"] * (1 - math.exp(-1 / 0.5)) <= 3.0 and v["command.step"] <= 3.5
        for v in values.values()
    )
    assert outcome.summary is not None
    assert (outcome.summary.draws, outcome.summary.inside, outcome.summary.unstable) == (40, good, 0)
    assert outcome.summary.interval == interval(good, 40)
    assert hy.study(write(**DRAWS), tmp_path / "out", workers=1).ran == 0  # the seed is kept with the table
    assert hy.study(write(**DRAWS), tmp_path / "other", workers=1).seed != outcome.seed
    sections = json.loads((tmp_path / "out" / "report.json").read_text())["sections"]
    assert sections[0]["text"].startswith(f"{good} of 40 variations are inside the limits")
    case = next(s for s in sections if s["title"] == "Case one")
    index, command, settings = case["tables"][-1]["rows"][0]
    last = max(row["metrics"]["last"] for row in outcome.rows if row["case"] == "one")
    assert outcome.rows[index]["metrics"]["last"] == last
    monkeypatch.chdir(tmp_path / "out")
    _, verb, *words = shlex.split(command)
    for given in (words, [*words[:3], "--set", f"@{settings}"]):
        result = CliRunner().invoke(main, [verb, *given, "--engine", "native", "--json"])
        verdicts = json.loads(result.output)[0]["metrics"]
        assert next(v["value"] for v in verdicts if v["metric"] == "last") == last


def test_a_study_that_goes_on_has_the_table_of_one_that_was_not_interrupted(write: Any, tmp_path: Path) -> None:
    """The first draws of a larger study are those of a smaller one, also if the seed was drawn at run time."""
    begun = hy.study(write(**DRAWS | {"n": 10}), tmp_path / "out", workers=1)
    resumed = hy.study(write(**DRAWS), tmp_path / "out", workers=2)
    whole = hy.study(write(**DRAWS | {"seed": begun.seed}), tmp_path / "whole", workers=1)
    assert (begun.ran, resumed.ran) == (20, 60)
    assert resumed.table.read_bytes() == whole.table.read_bytes()


def test_a_draw_that_loses_its_reference_is_counted_as_unstable(write: Any, tmp_path: Path) -> None:
    metrics = {"error": {"kind": "max_percent", "signal": "lag.y", "against": "command.d", "stroke": 1.0}}
    parameters = {"lag.b": {"values": [1.0, -1.0]}, "command.step": {"values": [0.4]}}
    study = {"parameters": parameters, "limits": {"one": {"error": 45.0}}}
    result = CliRunner().invoke(
        main, ["study", str(write(of_scenario={"metrics": metrics}, **study)), "-o", str(tmp_path / "out")]
    )
    assert "1 of 2 variations are inside the limits (50 %); 1 is unstable." in result.output


def test_second_order_dynamics_follow_their_frequency_and_damping(tmp_path: Path) -> None:
    """The poles of what is set have the drawn frequency and damping; the gain at rest is the drawn one."""
    study = Study(LOOP / "draws.study.toml")
    gain, f_n, zeta = 0.9, 450.0, 0.6
    drawn = {k: p.at(0.5) for k, p in study.parameters.items()}
    settings = study.settings(drawn | {"plant.g0.gain": gain, "plant.g0.f_n": f_n, "plant.g0.zeta": zeta})
    poles = np.roots(settings["plant.g0_a"])
    assert np.abs(poles) == pytest.approx(2 * np.pi * f_n)
    assert -poles.real / np.abs(poles) == pytest.approx(zeta)
    assert settings["plant.g0_b"][0] / settings["plant.g0_a"][-1] == pytest.approx(gain)
    assert settings["delay.n"] == 1


def test_a_delay_may_be_any_number_of_fine_steps() -> None:
    """The output of the fine unit is its input, held for a step, some fine steps later; 0 makes it a connection."""
    scenario = Cases(LOOP)
    case = next(c for c in scenario.cases if c.name == "sine_100")
    ripple = case.ripple
    for steps in (0, 0.3, 1, 1.7):
        other = next(c for c in scenario.changed({"delay.n": steps}, None).cases if c.name == "sine_100")
        trace = Native(build(other), ["inverse.y", "delay.y"]).run()
        late = round(steps * ripple)
        assert np.array_equal(trace["delay.y"][late:], trace["inverse.y"][: len(trace.t) - late])
    for wrong in (-1, 0.05, "two", True, math.nan):
        with pytest.raises(ValueError, match=r"here: must be a number of steps of at least 0, in steps of 0\.1\. Got"):
            delayed(case.units["delay"], wrong, ripple, "here")


def test_margins_of_a_draw_are_those_of_the_loop() -> None:
    system = build(next(c for c in Cases(LOOP).cases if c.name == "sine_100"))
    opened = open_loop(system)
    assert loop_metrics(system, {})["Ms_db"] == opened.margins().Ms_db
    assert loop_metrics(system, {"delay.n": 1.5})["Ms_db"] == opened.margins(1.0, 0.5).Ms_db
    assert loop_metrics(system, {"delay.n": 0})["Ms_db"] < opened.margins().Ms_db
    assert loop_metrics(system, {"pid.Kd": "*4"})["Ms_db"] == math.inf


def around(plant: hy.Node, wanted: str = "reference.r") -> hy.Scenario:
    loop = hy.Scenario("short", step=1e-3, stop=0.02).add("reference", hy.blocks.Reference(frequency=200.0))
    loop.add("plant", plant).add("law", hy.blocks.Pid(Kp=0.0, Ki=200.0))
    loop.metric("miss", "rms_percent", "plant.y", "reference.r").connect(wanted, "law.y_d")
    return loop.connect("plant.y", "law.y").connect("law.u", "plant.u")


def test_a_stable_loop_whose_corrections_may_grow_has_no_pole_outside() -> None:
    """With a short period, stable by the encirclements of its memory: abs(Q - L T) is above 1 between the harmonics."""
    loop = around(hy.Node("lag", "transfer_function", {"na": 1, "nb": 0}, {"b": [1.0], "a": [2e-3, 1.0]}), "memory.r")
    loop.add("memory", hy.blocks.Repetitive(n=5, n_q=1, n_l=1, q=[0.5, 0.25], l=[0.0, 0.5, 0.0]))
    loop.connect("reference.r", "memory.y_d").connect("plant.y", "memory.y")
    system = build(loop.order("reference", "plant", "memory", "law").ready().cases[0])
    assert open_loop(system, (1.0, 1.0)).learning() > 1
    found = loop_metrics(system, {})
    assert found["Ms_db"] < 5
    assert found["radius"] < 1


def test_a_slope_of_zero_opens_the_loop_and_makes_no_draw_unstable() -> None:
    """Plays without linear term stand still after a reversal, and the integral keeps its value."""
    plays = hy.Node("plays", "prandtl_ishlinskii", {"n": 1}, {"w0": 0.0, "r": [0.1], "w": [1.0]})
    system = build(around(plays).ready().cases[0])
    assert open_loop(system).slopes[0] == 0
    assert 0.999 < loop_metrics(system, {})["radius"] < 1


# ---- two studies -----------------------------------------------------------------------------------------------------
Made = Callable[..., Path]
RANGES = {"command.step": {"range": [1.0, 4.0]}, "lag.b": {"scale": [0.5, 2.0]}}


@pytest.fixture
def made(write: Any, tmp_path: Path) -> Made:
    """A study of a lag with a time constant, in its folder."""

    def make(name: str, a: float = 0.5, seed: int = 5, limit: float = 3.0, method: str = "random") -> Path:
        lag = {**LAG["units"]["lag"], "values": {"b": [1.0], "a": [a, 1.0], "hold": "zoh"}}
        drawn = {"method": method, "parameters": RANGES, "limits": {"one": {"last": limit}}}
        more = {"n": 40, "seed": seed} if method == "random" else {}
        if method == "grid":
            drawn["parameters"] = {k: {**v, "steps": 3} for k, v in RANGES.items()}
        study = write(of_scenario={"units": {**LAG["units"], "lag": lag}}, **drawn, **more)
        hy.study(study, tmp_path / name, workers=1)
        return tmp_path / name

    return make


def last(folder: Path, a: float) -> np.ndarray:
    """The response of the lag to a step after 1 s, from the parameters in the table."""
    values = read_study(folder).values
    return np.asarray(values[:, 0] * values[:, 1] * (1 - np.exp(-1 / a)))


def test_shares_percentiles_and_changed_draws_are_those_of_the_closed_form(made: Made, tmp_path: Path) -> None:
    seed = int(np.random.default_rng().integers(2**31))
    old, new = made("old", 0.5, seed), made("new", 0.4, seed)
    before, after = last(old, 0.5), last(new, 0.4)
    found = {(c.title, c.what): (c.old, c.new) for c in compare_studies(old, new, tmp_path / "out.html")}
    for what, value in (("last, 50 % of the variations", 50), ("last, 99 % of the variations", 99)):
        expected = [float(np.quantile(v, value / 100, method="inverted_cdf")) for v in (before, after)]
        assert found["decay/one", what] == pytest.approx(expected, rel=1e-9)
    good = [v <= 3.0 for v in (before, after)]
    shares = [100 * float(g.mean()) for g in good]
    assert found.get(("all cases", "inside the limits, %"), (shares[0],) * 2) == pytest.approx(shares)
    text = (tmp_path / "out.html").read_text()
    moved = int(np.sum(good[0] != good[1]))
    assert f"{good[0].sum()} of 40 variations" in text
    assert (f"{moved} variations changed their verdict, 0 to inside and {moved} to outside" in text) == (moved > 0)
    assert compare_studies(old, old, tmp_path / "same.html") == []
    assert "No variation changed its verdict." in (tmp_path / "same.html").read_text()


def test_a_changed_limit_is_drawn_beside_the_old_one(made: Made, tmp_path: Path) -> None:
    compare_studies(made("a"), made("b"), tmp_path / "same.html")
    compare_studies(made("a"), made("c", limit=2.5), tmp_path / "changed.html")
    same, changed = ((tmp_path / f"{n}.html").read_text() for n in ("same", "changed"))
    words = ("old limit", "new limit", "All changes", "last, 50 % of the variations")  # the last is equal in both
    assert [[word in page for word in words] for page in (same, changed)] == [[False] * 4, [True] * 4]
    for page, other in ((same, "b"), (changed, "c")):
        titles = "Two studies side by side", "Distributions on common axes", "Draws that changed their verdict"
        assert "variations inside the limits, with 95 % intervals" in page
        assert all(title in page for title in titles)
        assert f"Old: {tmp_path / 'a'}, study decay of decay. New: {tmp_path / other}, study decay of decay." in page
    with pytest.raises(InputError, match=r"loop: not a report of 'hystfmu study': two studies are compared$"):
        compare_studies(tmp_path / "loop", tmp_path / "a", tmp_path / "none.html")


def test_other_draws_have_no_pairs_and_grid_points_no_interval(made: Made, tmp_path: Path) -> None:
    compare_studies(made("a", seed=1), made("b", seed=2), tmp_path / "out.html")
    assert "no variation has two verdicts" in (tmp_path / "out.html").read_text()
    compare_studies(made("g", method="grid"), made("h", 0.3, method="grid"), tmp_path / "grid.html")
    text = (tmp_path / "grid.html").read_text()
    assert " of 9 variations (" in text
    assert "95 % interval" not in text


@pytest.mark.parametrize(("gained", "lost", "p"), [(9, 1, 22 / 1024), (0, 5, 2 / 32), (3, 3, 1.0), (1, 0, 1.0)])
def test_the_probability_of_a_one_sided_change(gained: int, lost: int, p: float) -> None:
    """Coins counted by hand: 9 of 10 or more one-sided are 22 of 1024 ways."""
    assert _sign_test(gained, lost) == pytest.approx(p, rel=1e-12)
    assert _sign_test(lost, gained) == pytest.approx(p, rel=1e-12)


def test_bad_input_is_told_in_one_line(made: Made, tmp_path: Path) -> None:
    good, bad, run = made("good"), tmp_path / "bad", tmp_path / "run"
    shutil.copytree(good, bad)
    told = json.loads((good / "report.json").read_text())
    for change, why in (
        ({"outcomes": "x"}, "outcomes: "),
        ({"outcomes": "i"}, "not the table of the study"),
        ({"interval": [0.1, 2.0]}, "interval.1: "),
        ({"limits": {"one": {"gone": 1.0}}}, "not the table of the study"),
    ):
        (bad / "report.json").write_text(json.dumps({"study": told["study"] | change}))
        with pytest.raises(InputError, match=why):
            compare_studies(good, bad, tmp_path / "out.html")
    (bad / "report.json").write_text(json.dumps(told))
    (bad / "results.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match=r"results\.parquet: not a table of 'hystfmu study'$"):
        compare_studies(good, bad, tmp_path / "out.html")
    run.mkdir()
    (run / "report.json").write_text(json.dumps({"version": "1", "results": []}))
    said = invoked(["compare", str(run), str(good), "-o", str(tmp_path / "out.html")], status=2)
    assert "not a report of 'hystfmu study'" in said.output
    assert not (tmp_path / "out.html").exists()
