"""All laws are tuned by the same rules: cases, targets, hard limits, trials, sampler; scenarios hold what was found."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest
import tuned

from hystfmu.scenario import build
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.studies.spec import PREFIX
from hystfmu.studies.task import LoopLimits

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


@pytest.mark.parametrize(
    "name",
    [n if n == "stage/irc" else pytest.param(n, marks=pytest.mark.stress) for n in tuned.STAGE] + tuned.TRACKING,
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
