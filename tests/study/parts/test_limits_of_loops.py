"""Limits of the linearised loop by numbers: nominal peak, corners with slopes and delays, margins of a draw."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.studies import loop_limits
from hystfmu.studies.loop_limits import LoopLimits, _radius, loop_metrics
from hystfmu.studies.spec import LoopSpec


class Opened:
    """A loop whose pole is slope times (1 + delay) times its own."""

    slopes = (0.5, 2.0)

    def __init__(self, pole: float, stable: bool = True, memories: tuple[int, ...] = ()) -> None:
        self.pole, self.nominal, self.memories, self.asked = pole, stable, memories, []

    def margins(self, slope: float | None = None, *, delay: float) -> Any:
        self.asked.append((slope, delay))
        return SimpleNamespace(Ms_db=5.0 + delay, stable=self.nominal)

    def radius(self, slope: float, delay: float) -> float:
        return self.pole * slope * (1 + delay)

    def stable(self, slope: float, delay: float) -> bool:
        return self.nominal


@pytest.fixture
def limits(monkeypatch: Any) -> Any:
    def make(loops: dict[str, Opened], **spec: Any) -> LoopLimits:
        monkeypatch.setattr(loop_limits, "build", lambda case: case)
        monkeypatch.setattr(loop_limits, "_changed", lambda system, settings: system)
        monkeypatch.setattr(loop_limits, "open_loop", lambda system, slopes: (slopes, loops[system])[1])
        study: Any = SimpleNamespace(scenario_cases={k: k for k in loops})
        return LoopLimits(study, LoopSpec.model_validate({"case": "nominal", **spec}))

    return make


def test_the_peak_of_the_nominal_case(limits: Any) -> None:
    nominal = Opened(0.5)
    found = limits({"nominal": nominal}, Ms_db=4.5, delay=1.5).excess({})
    assert found == {"Ms_db": pytest.approx(2.0), "radius": pytest.approx(-1 + 1e-6, abs=1e-12)}
    assert nominal.asked == [(None, 1.5)]
    assert limits({"nominal": Opened(0.5, stable=False)}).excess({})["Ms_db"] == math.inf


def test_the_largest_pole_of_corners_slopes_and_delays(limits: Any) -> None:
    loops = {"nominal": Opened(9.0), "a": Opened(0.2), "b": Opened(0.3)}
    made = limits(loops, corners=["a", "b"], slopes=[0.5, 1.5], delays=[0.0, 0.75])
    assert made.excess({})["radius"] == pytest.approx(0.3 * 1.5 * 1.75 - (1 - 1e-6), abs=1e-12)
    edge = limits({"nominal": Opened(9.0), "a": Opened(1 - 1e-6)}, corners=["a"])
    assert edge.excess({})["radius"] == pytest.approx(0.0, abs=1e-15)


def test_a_memory_counts_only_in_an_unstable_loop(monkeypatch: Any) -> None:
    monkeypatch.setattr(loop_limits, "replace", lambda opened, memories: Opened(0.1))
    assert _radius(Opened(0.9, memories=(1,)), 1.0, 0.0) == pytest.approx(0.1)  # type: ignore[arg-type]
    assert _radius(Opened(0.9, False, (1,)), 1.0, 0.0) == pytest.approx(0.9)  # type: ignore[arg-type]
    assert _radius(Opened(0.9), 1.0, 0.0) == pytest.approx(0.9)  # type: ignore[arg-type]


@pytest.mark.parametrize("stable", [True, False])
def test_a_fraction_of_a_step_opens_the_loop_later(monkeypatch: Any, stable: bool) -> None:
    opened, asked = Opened(0.2, stable), []
    monkeypatch.setattr(loop_limits, "sizes", lambda case: {"delay.n", "late.n"})
    monkeypatch.setattr(loop_limits, "replace", lambda case, overrides: overrides)
    monkeypatch.setattr(loop_limits, "build", lambda overrides: (asked.append(overrides), "system")[1])
    monkeypatch.setattr(loop_limits, "open_loop", lambda system: opened)
    system: Any = SimpleNamespace(case=SimpleNamespace(overrides={"x": 1.0}))
    found = loop_metrics(system, {"delay.n": 3.25, "late.n": 2.5, "pid.Kp": 7.5})
    assert asked == [{"x": 1.0, "delay.n": 3.0, "late.n": 2.0, "pid.Kp": 7.5}]
    assert opened.asked == [(None, 0.75)]
    assert found["Ms_db"] == (pytest.approx(5.75) if stable else math.inf)
    assert found["radius"] == pytest.approx(0.2 * 2.0 * 1.75)
    assert np.isfinite(found["radius"])
