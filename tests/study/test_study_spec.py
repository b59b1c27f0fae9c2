"""The numbers of a study file: defaults, limits, maps to values; limits of loops; the rules of a scenario hold."""

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pydantic
import pytest
import tuned
from invoked import invoked

from hystfmu.scenario import build
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.studies.report import best_variation
from hystfmu.studies.spec import (
    PREFIX,
    LearntLoops,
    LoopShapingDesign,
    LoopSpec,
    ObjectiveSpec,
    ParameterSpec,
    RepetitiveDesign,
    SecondOrderSpec,
    Study,
    StudySpec,
    Weight,
)
from hystfmu.studies.task import LoopLimits

STUDY: dict[str, Any] = {"name": "s", "scenario": ".", "method": "random", "parameters": {"a.b": {"range": [0.0, 1.0]}}}
LOOP: dict[str, Any] = {"case": "c"}
SHAPING: dict[str, Any] = {
    "method": "loop_shaping", "case": "c", "delay": 1.0, "weight": {"K": "a"}, "robust": ["r.one"],
}  # fmt: skip
REPETITIVE: dict[str, Any] = {"method": "repetitive_filters", "unit": "u", "loops": [{"case": "c"}]}
LEARNT = LearntLoops(case="c")
RANGE: dict[str, Any] = {"range": [0.0, 1.0]}
TINY = 5e-324


@pytest.mark.parametrize(("kind", "base", "name", "default", "inside", "outside"), [
    (ParameterSpec, RANGE, "steps", 5, [1, 100_000], [0, 100_001]),
    (ParameterSpec, RANGE, "log", False, [], []),
    (ParameterSpec, {}, "values", None, [[1.0], [0.0] * 100_000], [[], [0.0] * 100_001]),
    (ParameterSpec, {}, "range", None, [[0.0, 1.0]], [[0.0], [0.0, 1.0, 2.0], [1.0, 1.0], [0.0, math.inf]]),
    (ParameterSpec, {}, "scale", None, [[0.5, 2.0]], [[0.5], [0.5, 1.0, 2.0], [2.0, 0.5]]),
    (LoopSpec, LOOP, "Ms_db", 6.0, [TINY, 60], [0.0, 60.1]),
    (LoopSpec, LOOP, "delay", 0.0, [0, 100], [-0.1, 100.1]),
    (LoopSpec, LOOP, "corners", [], [["a"] * 100], [["a"] * 101]),
    (LoopSpec, LOOP, "slopes", [1.0, 1.0], [[0.5, 2.0]], [[1.0], [1.0, 2.0, 3.0]]),
    (LoopSpec, LOOP, "delays", [0.0], [[0.0], [1.0] * 20, [100.0]], [[], [1.0] * 21, [-1.0], [100.5]]),
    (ObjectiveSpec, {"metric": "m"}, "targets", {}, [{"a": TINY}], [{"a": 0.0}, {"a": math.inf}]),
    (ObjectiveSpec, {"metric": "m"}, "over_cases", "max", ["mean"], ["least"]),
    (StudySpec, STUDY, "n", 64, [1, 10_000_000], [0, 10_000_001]),
    (StudySpec, STUDY, "seed", 0, [0, 2**31 - 1, "run"], [-1, 2**31, "draw"]),
    (StudySpec, STUDY, "timeout", 60.0, [TINY, 1e6], [0.0, 1e6 + 1]),
    (StudySpec, STUDY, "memory", 4.0, [TINY, 1e4], [0.0, 1e4 + 1]),
    (StudySpec, STUDY, "cases", None, [["a"]], [[]]),
    (StudySpec, STUDY, "engine", "native", ["fmpy"], ["other"]),
    (LearntLoops, {"case": "c"}, "slopes", [1.0], [[1.0] * 20], [[], [1.0] * 21, [math.inf]]),
    (ObjectiveSpec, {"metric": "m"}, "limits", {}, [{"a": -1.0}], [{"a": math.inf}, {"a": math.nan}]),
    (StudySpec, STUDY, "start", {}, [{"a": 1.0}], [{"a": math.nan}]),
    (RepetitiveDesign, REPETITIVE, "loops", None, [[LEARNT] * 50], [[], [LEARNT] * 51]),
    (LoopShapingDesign, SHAPING, "delay", None, [0, 100], [-0.1, 100.1]),
    (LoopShapingDesign, SHAPING, "order", 2, [1, 6], [0, 7]),
    (LoopShapingDesign, SHAPING, "ratio", 1.1, [1.0001, 10], [1.0, 10.1]),
    (LoopShapingDesign, SHAPING, "robust", None, [["a.b"], ["a.b", "c.d"]], [[], ["a.b"] * 3]),
])  # fmt: skip
def test_a_field_has_its_default_and_its_limits(kind, base, name, default, inside, outside) -> None:
    made = kind.model_fields[name]
    found = made.get_default(call_default_factory=True)
    assert (found if not made.is_required() else None) == default
    for value in inside:
        assert getattr(kind.model_validate({**base, name: value}), name) == value
    for value in outside:
        with pytest.raises(pydantic.ValidationError):
            kind.model_validate({**base, name: value})


@pytest.mark.parametrize(("n", "good"), [(0, False), (1, True), (1000, True), (1001, False)])
def test_a_study_has_one_to_a_thousand_parameters(n: int, good: bool) -> None:
    given = {**STUDY, "parameters": {f"a.p{k}": RANGE for k in range(n)}}
    if good:
        assert len(StudySpec.model_validate(given).parameters) == n
    else:
        with pytest.raises(pydantic.ValidationError):
            StudySpec.model_validate(given)


@pytest.mark.parametrize(("given", "words"), [
    ({}, "exactly one of range, scale, values, second_order. Got none"),
    ({"range": [0, 1], "values": [1.0]}, "Got range, values"),
    ({"range": [2, 1]}, "a range must rise. Got 2.0 to 1.0"),
    ({"range": [0, 1], "log": True}, "must be greater than 0. Got 0.0"),
    ({"second_order": {"gain": [0.0, 1], "f_n": [1, 2], "zeta": [0.1, 1]}}, "gain must rise from a value greater"),
    ({"second_order": {"gain": [0.5, 1], "f_n": [2, 2], "zeta": [0.1, 1]}}, "f_n must rise .* Got 2.0 to 2.0"),
    ({"second_order": {"gain": [0.5, 1], "f_n": [1, 2], "zeta": [1, 0.1]}}, "zeta must rise"),
])  # fmt: skip
def test_what_a_parameter_must_be(given: dict[str, Any], words: str) -> None:
    with pytest.raises(pydantic.ValidationError, match=words):
        ParameterSpec.model_validate(given)


@pytest.mark.parametrize(("given", "pairs"), [
    ({"range": [2.0, 6.0]}, [(0.0, 2.0), (0.25, 3.0), (1.0, 6.0)]),
    ({"scale": [0.5, 2.0]}, [(0.0, 0.5), (0.5, 1.25), (1.0, 2.0)]),
    ({"range": [0.1, 10.0], "log": True}, [(0.0, 0.1), (0.5, 1.0), (0.75, 10**0.5), (1.0, 10.0)]),
])  # fmt: skip
def test_fractions_of_a_range_and_back(given: dict[str, Any], pairs: list[tuple[float, float]]) -> None:
    p = ParameterSpec.model_validate(given)
    for fraction, value in pairs:
        assert p.at(fraction) == pytest.approx(value)
        assert p.fraction(value) == pytest.approx(fraction, abs=1e-12)
    assert p.setting(2.5) == ("*2.5" if p.scale else 2.5)
    assert p.coordinates("a.b") == {"a.b": p}


def test_fractions_of_a_list() -> None:
    p = ParameterSpec.model_validate({"values": [5.0, 1.0, 3.0]})
    assert [p.at(f) for f in (0.0, 0.3, 0.34, 0.5, 0.67, 1.0)] == [5.0, 5.0, 1.0, 1.0, 3.0, 3.0]
    assert [p.fraction(v) for v in (1.0, 3.0, 5.0)] == [0.0, 0.5, 1.0]
    assert ParameterSpec.model_validate({"values": [4.0]}).fraction(4.0) == 0.0
    assert p.bounds == (0.0, 0.0)


def test_second_order_dynamics_draw_three_parameters() -> None:
    p = ParameterSpec.model_validate({"second_order": {"gain": [0.5, 1], "f_n": [10, 20], "zeta": [0.1, 1]}})
    found = p.coordinates("lag.g")
    assert {k: v.bounds for k, v in found.items()} == {
        "lag.g.gain": (0.5, 1), "lag.g.f_n": (10, 20), "lag.g.zeta": (0.1, 1)
    }  # fmt: skip
    coarse = ParameterSpec.model_validate(p.model_dump() | {"log": True, "steps": 3}).coordinates("lag.g")
    assert [(v.steps, v.at(0.5)) for v in coarse.values()] == [
        (3, pytest.approx(math.sqrt(a * b))) for a, b in ((0.5, 1), (10, 20), (0.1, 1))
    ]
    w = 2 * math.pi * 10
    settings = SecondOrderSpec.settings("lag.g", 0.5, 10.0, 0.2)
    assert settings["lag.g_b"] == pytest.approx([0.5 * w**2])
    assert settings["lag.g_a"] == pytest.approx([1.0, 0.4 * w, w**2])
    with pytest.raises(pydantic.ValidationError):
        SecondOrderSpec.model_validate({"gain": [0.5], "f_n": [10, 20], "zeta": [0.1, 1]})


@pytest.mark.parametrize(("over", "targets", "values", "score"), [
    ("max", {}, [2.0, 3.0], 3.0), ("mean", {}, [2.0, 3.0], 2.5), ("max", {"a": 0.5}, [2.0, 3.0], 4.0),
    ("mean", {"b": 6.0}, [2.0, 3.0], 1.25), ("max", {}, [2.0, math.inf], math.nan),
    ("max", {}, [2.0, None], math.nan),
])  # fmt: skip
def test_the_objective_of_several_cases(over: str, targets: Any, values: list[Any], score: float) -> None:
    objective = ObjectiveSpec.model_validate({"metric": "m", "over_cases": over, "targets": targets})
    rows = [{"case": c, "metrics": {} if v is None else {"m": v}} for c, v in zip("ab", values, strict=True)]
    assert objective.score(rows) == pytest.approx(score, nan_ok=True)


@pytest.mark.parametrize(("given", "gain", "at_10"), [
    ({"K": "a"}, 2.0, 2.0),
    ({"Ki": "a"}, None, 2.0 / 10j),
    ({"K": "a", "K_1": "b"}, None, 2.0 * (10j + 3) / 10j),
    ({"K": "a", "K_1": "b", "K_2": "c"}, None, 2.0 * (10j + 3) * (10j + 5) / 10j**2),
    ({"K": "a", "T_z": "b", "T_p": "c"}, 2.0, 2.0 * (30j + 1) / (50j + 1)),
    ({"K": "a", "T_z": "b"}, 2.0, 2.0 * (30j + 1)),
])  # fmt: skip
def test_the_weight_of_a_loop(given: dict[str, str], gain: float | None, at_10: complex) -> None:
    W = Weight.model_validate(given).transfer({"a": 2.0, "b": 3.0, "c": 5.0})
    assert complex(W(10j)) == pytest.approx(at_10)
    assert gain is None or complex(W(0)) == pytest.approx(gain)


@pytest.mark.parametrize("given", [{}, {"K": "a", "Ki": "b"}])
def test_a_weight_has_one_gain(given: dict[str, str]) -> None:
    with pytest.raises(pydantic.ValidationError, match="exactly one of K and Ki"):
        Weight.model_validate(given)


def test_what_a_design_reads() -> None:
    assert RepetitiveDesign.model_validate(REPETITIVE).reads == ("design.cutoff", "design.gain")
    assert RepetitiveDesign.model_validate(REPETITIVE).cases == ("c",)
    shaping = LoopShapingDesign.model_validate({**SHAPING, "weight": {"K": "a", "T_p": "b"}})
    assert shaping.reads == ("a", "b")
    assert shaping.cases == ("c",)


# ---- limits of loops -------------------------------------------------------------------------------------------------
ROOT = Path(__file__).parents[2]
FILE = ROOT / "scenarios/pid/gains.study.toml"


def test_the_best_variation_is_within_the_limits_of_the_loop() -> None:
    study = Study(FILE)
    gains = study.scenario_cases["sine_10"].units["pid"].values
    shipped = {key: float(gains[key.partition(".")[2]]) for key in study.parameters}
    rows: list[dict[str, Any]] = []
    for variation, (factor, error) in enumerate(((1.0, 0.02), (3.0, 0.01))):
        values = shipped | {"pid.Kd": factor * shipped["pid.Kd"]}
        metrics = {"tracking": error, "variation": 1.0}
        rows += [{"variation": variation, "case": "sine_10", "values": values, "metrics": metrics, "status": "ok"}]
    best = best_variation(study, rows)
    assert best is not None
    assert best["variation"] == 0  # the other has the smaller error and an unstable corner


def test_a_case_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    text = FILE.read_text().replace('scenario = "."', f'scenario = "{FILE.parent.as_posix()}"')
    bad = tmp_path / "bad.study.toml"
    bad.write_text(text.replace("../loops/gains.toml", "gains.toml"))
    rules = (ROOT / "scenarios/loops/gains.toml").read_text()
    (tmp_path / "gains.toml").write_text(rules.replace('corners = ["up_400_10"', 'corners = ["up_999_10"'))
    result = invoked(["study", str(bad), "-o", str(tmp_path / "out")], status=2)
    assert "objective.loop: no case 'up_999_10'" in result.output


# ---- rules of a scenario ---------------------------------------------------------------------------------------------
OWN = {"extends", "scenario", "parameters", "start", "design", "cases", "objective", "limits"}
FAMILY = {"tracking": (tuned.TRACKING, "loops"), "stage": (tuned.STAGE, "stage")}
AROUND = ("sliding_mode_2005", "sliding_mode_2005_1khz")  # around the inverse: slopes of the plant itself
PERIODIC = ("repetitive",)  # what is asked for where the reference repeats


def own(name: str) -> dict[str, Any]:
    return tomllib.loads((tuned.SCENARIOS / name / "gains.study.toml").read_text())


@pytest.mark.parametrize("family", FAMILY)
def test_a_study_states_its_parameters_and_takes_the_rules_of_its_family(family: str) -> None:
    names, folder = FAMILY[family]
    for name in names:
        file, stated = tuned.SCENARIOS / name / "gains.study.toml", own(name)
        assert stated.keys() <= (OWN | {"n"} if name in tuned.OURS else OWN), name
        assert (file.parent / stated["extends"]).resolve().parent == tuned.SCENARIOS / folder, name
        assert "limits" not in stated or name == AROUND[0], name
        assert stated.get("objective", {}).keys() == (
            {"loop"} if name in AROUND else {"targets"} if name in PERIODIC else set()
        )
        rules = tomllib.loads((tuned.SCENARIOS / folder / "gains.toml").read_text())
        if "cases" in stated:
            assert name in PERIODIC
            left_out = set(rules["cases"]) - set(stated["cases"])
            assert set(stated["cases"]) <= set(rules["cases"])
            assert all("broadband" in case for case in left_out)
            targets = rules["objective"]["targets"]
            assert all(v <= targets[case] for case, v in stated["objective"]["targets"].items()), "harder, not easier"


@pytest.mark.parametrize("family", FAMILY)
def test_no_baseline_has_fewer_trials_than_ours(family: str) -> None:
    """By the study files and by what was run."""
    names, _ = FAMILY[family]
    stated = {name: tuned.study(name).spec.n for name in names}
    run = {name: tuned.recorded()[name] for name in names if name in tuned.recorded()}
    assert set(tuned.TRACKING) & set(names) <= set(run)
    assert {name: found["trials"] for name, found in run.items()} == {name: stated[name] for name in run}
    assert {found["seed"] for found in run.values()} == {tuned.study(names[0]).seed}
    most = max((n for name, n in stated.items() if name in tuned.OURS), default=0)
    assert len({n for name, n in stated.items() if name not in tuned.OURS}) == 1
    assert min(n for name, n in stated.items() if name not in tuned.OURS) >= most


@pytest.mark.some(4)
@pytest.mark.parametrize("name", sorted(tuned.recorded()))
def test_a_scenario_has_the_values_that_its_study_found(name: str) -> None:
    """Within the ranges; what a design makes of them, to the digits of the file."""
    study, found = tuned.study(name), tuned.recorded()[name]["values"]
    assert found.keys() == study.parameters.keys()
    for key, p in study.parameters.items():
        assert p.bounds[0] <= found[key] <= p.bounds[1], key
        assert key.startswith(PREFIX) or tuned.shipped(study, key)[0] == pytest.approx(found[key], rel=1e-9), key
    if study.spec.design is not None:
        for key, value in study.settings(found).items():
            want = np.atleast_1d(value)
            assert np.abs(tuned.shipped(study, key) - want).max() <= 1e-5 * np.abs(want).max(), key


@pytest.mark.parametrize("name", tuned.TRACKING)
def test_every_law_starts_from_what_was_best_before(name: str) -> None:
    """The first trial is in the middle of ranges of a factor of 3, and no study ends worse than there."""
    study, found = tuned.study(name), tuned.recorded()[name]
    assert study.spec.start.keys() == study.parameters.keys()
    for key, p in study.parameters.items():
        low, high = study.spec.start[key] / 3, 3 * study.spec.start[key]
        assert p.bounds[0] == pytest.approx(low, rel=1e-3), key
        assert p.bounds[1] == pytest.approx(high, rel=1e-3) or (name in tuned.OURS and p.bounds[1] < high), key
    assert found["best"] <= found["first"]


@pytest.mark.some(3)
@pytest.mark.parametrize(
    "name", [n if n == "stage/irc" else pytest.param(n, marks=pytest.mark.stress) for n in tuned.STAGE] + tuned.TRACKING
)
def test_the_gains_meet_the_hard_limits(name: str) -> None:
    """Of the study, with half a step as well."""
    study = tuned.study(name)
    objective = study.spec.objective
    assert objective is not None
    assert objective.loop is not None
    assert objective.loop.Ms_db == 6.0
    limits = LoopLimits(study, objective.loop.model_copy(update={"delays": [0.0, 0.5, 1.0]}))
    excess = limits.excess({})
    assert max(excess.values()) <= 0, excess
    opened = open_loop(build(study.scenario_cases[objective.loop.case]), (0.68, 1.64))
    assert excess["Ms_db"] == pytest.approx(opened.margins().Ms_db - 6.0)


def test_the_corners_differ_by_what_the_slopes_hold() -> None:
    """Two of the four are enough for the linear limits: gains are in the slopes, whatever the case itself has."""
    cases = tuned.study("pid").scenario_cases
    for f in (400, 600):
        up, down = (open_loop(build(cases[f"{gain}_{f}_10"]), (0.68, 1.64)) for gain in ("up", "down"))
        assert up.response(1.1, 0.5) == pytest.approx(down.response(1.1, 0.5), rel=1e-6)
