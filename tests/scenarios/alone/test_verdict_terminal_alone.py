"""Verdicts of a run against limits and a baseline, and how a terminal shows them, line by line."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome.baseline import CHANGED
from hystfmu.scenario.outcome.metrics import Measure
from hystfmu.scenario.outcome.result import CaseResult, LoopFigures, Verdict, judge
from hystfmu.scenario.report import terminal
from hystfmu.scenario.system.spec import MetricSpec


def cells(line: str) -> list[str]:
    return line.split()


# ---- verdicts of a run ---------------------------------------------------------------------------------------------
def measured(value: float) -> Measure:
    return SimpleNamespace(value=lambda: value)  # type: ignore[return-value]


def verdict_on(
    value: float, limit: float | None, old: float | None, tolerance: float = 1e-3, strict: bool = True
) -> Any:
    m = MetricSpec.model_validate({"kind": "peak", "signal": "a.y"} | ({} if limit is None else {"limit": limit}))
    case: Any = SimpleNamespace(name="c", title="s/c", where="w", metrics={"m": m}, tolerance=tolerance, guard=None)
    case.record, rows = (), np.zeros((0, 1))
    known = SimpleNamespace(
        metrics={"c": {} if old is None else {"m": old}}, rows={"c": rows}, signals=(), final_states={}
    )
    kept: Any = SimpleNamespace(rows=lambda: rows, trace=SimpleNamespace(final_states={}))
    return judge(case, {"m": measured(value)}, kept, None if old is None else known, strict)  # type: ignore[arg-type]


def test_a_missing_baseline_and_a_change_are_failures() -> None:
    assert verdict_on(1.0, None, None)[1] == ["s/c: no baseline: run with --record"]
    m = MetricSpec.model_validate({"kind": "peak", "signal": "a.y"})
    case: Any = SimpleNamespace(name="c", title="s/c", where="w", metrics={"m": m}, tolerance=0.1, guard=None)
    other: Any = SimpleNamespace(metrics={"c": {"m": 2.0, "n": 1.0}})
    lines = judge(case, {"m": measured(3.0)}, SimpleNamespace(), other)[1]  # type: ignore[arg-type]
    assert lines == [
        f"s/c: m = 3 {CHANGED} 2 (tolerance 0.1); if that is meant, run with --record",
        "s/c: no baseline: run with --record",
    ]

    def fails() -> float:
        raise InputError("the stroke is zero")

    broken: Any = SimpleNamespace(value=fails)
    with pytest.raises(InputError, match=r"^w: metrics\.m: the stroke is zero$"):
        judge(case, {"m": broken}, SimpleNamespace(), None)  # type: ignore[arg-type]


# ---- on a terminal -------------------------------------------------------------------------------------------------
def shown(
    value: float, limit: float | None = 1.0, kind: str = "peak", name: str = "m", base: float | None = None
) -> Verdict:
    within = math.isfinite(value) and (limit is None or value <= limit)
    return Verdict(name, kind, value, limit, base, within, None)


def result(
    *verdicts: Verdict, scenario: str = "s", case: str = "c", lines: tuple[str, ...] = (), **more: Any
) -> CaseResult:
    system: Any = SimpleNamespace(case=SimpleNamespace(scenario=scenario, name=case, title=f"{scenario}/{case}"))
    return CaseResult(system, verdicts, lines, None, more.pop("seconds", 0.25), **more)


def test_the_decisive_metric_is_nearest_to_its_limit() -> None:
    low, near, over = shown(0.1), shown(1.8, 2.0), shown(1.2, 1.0)
    none, nan = shown(9.0, None), shown(math.nan, None)
    assert terminal.decisive(result(low, near, none)) is near
    assert terminal.decisive(result(low, near, over)) is over
    assert terminal.decisive(result(none, low)) is low
    assert terminal.decisive(result(none, shown(8.0, None))) is none
    assert terminal.decisive(result(over, nan)) is nan
    assert terminal.decisive(result()) is None
    zero, above_zero = shown(0.0, 0.0), shown(1e-9, 0.0)
    assert terminal.decisive(result(low, zero)) is low
    assert terminal.decisive(result(over, above_zero)) is above_zero


def test_several_scenarios_have_a_line_each() -> None:
    """With the case that is nearest to a limit, and the worst margins of their loops."""
    some = [
        result(shown(0.5), scenario="p", loop=LoopFigures(True, 2.5, 3.0)),
        result(shown(0.9), scenario="p", case="d", loop=LoopFigures(True, 1.5, math.inf), seconds=0.5),
        result(shown(0.1), scenario="q", loop=LoopFigures(False, None, None)),
        result(scenario="r", lines=("r/c: stopped",)),
    ]
    lines = terminal.verdicts(some).splitlines()
    assert cells(lines[0]) == cells(
        "scenario passed nearest to a limit metric value limit largest Ms dB least delay margin, steps seconds"
    )
    assert cells(lines[-5]) == cells("p 2 of 2 d m 0.9 1 2.5 3 0.75")
    assert cells(lines[-4]) == cells("q 1 of 1 c m 0.1 1 unstable unstable 0.25")
    assert cells(lines[-3]) == cells("r 0 of 1 c stopped 0.25")
    assert lines[-1] == "3 of 4 cases passed"
    plain = [replace(r, loop=None) for r in some]
    assert "Ms" not in terminal.verdicts(plain)


def test_every_metric_has_a_line() -> None:
    text = terminal.every_metric([result(shown(0.5, None), shown(2.0, 1.0, "rms_percent", "n", 1.9))]).splitlines()
    assert cells(text[-2]) == cells("s c ok m 0.5")
    assert cells(text[-1]) == cells("s c FAILED n % 2 1 1.9")


# ---- a result ------------------------------------------------------------------------------------------------------
def test_a_result_in_words() -> None:
    four = [shown(0.5, 1.0, "rms_percent"), shown(2.0, 1.0), shown(3.0, None), shown(4.0, None)]
    assert repr(result(*four[:2])) == "Result('s/c', passed, m = 0.5 % <= 1, m = 2 > 1)"
    assert repr(result(*four, lines=("x",))) == "Result('s/c', failed, m = 0.5 % <= 1, m = 2 > 1, m = 3, ...)"
    assert repr(result(*four[:3])).endswith("m = 3)")
    assert repr(result(lines=("s/c: why",))) == "Result('s/c', stopped: s/c: why)"
    assert LoopFigures(True, 2.5, math.inf).cells() == ["2.5", "inf"]
    assert LoopFigures(True, 2.5, math.inf).summary() == {"stable": True, "Ms_db": 2.5, "delay_steps": None}
    assert LoopFigures(False, None, 1.0).summary()["delay_steps"] == 1.0
