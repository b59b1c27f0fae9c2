"""Internal model and repetitive control: filters as designed, anti-windup down to the clipping itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tuned

from hystfmu.design import repetitive_filters
from hystfmu.scenario import Cases, build
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.outcome.result import Baseline

ROOT = Path(__file__).parents[3] / "scenarios"
SLOPES = (0.68, 1.64)  # of plant over inverse in the corners
LEARNT_AT = (0.8, 1.38)  # slopes for which the filters are designed


def opened(name: str, case: str) -> OpenedLoop:
    cases = {c.name: c for c in Cases(ROOT / name).cases}
    return open_loop(build(cases[case]), SLOPES)


def recorded(name: str) -> dict[str, dict[str, float]]:
    baseline = Baseline.load(ROOT / name)
    assert baseline is not None
    return baseline.metrics


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
    found = recorded("internal_model")
    assert found["saturation_10"]["tracking"] == pytest.approx(clipping, rel=0.01)
    assert found["windup_10"]["tracking"] > 3 * clipping
    assert recorded("repetitive")["saturation_10"]["tracking"] == pytest.approx(clipping, rel=0.01)


def test_what_repeats_is_learnt_in_every_corner() -> None:
    """Periodic references: 10 Hz 0.02, corners 0.03; 100 Hz 0.015, corners 0.2; with two steps as well."""
    found = recorded("repetitive")
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
