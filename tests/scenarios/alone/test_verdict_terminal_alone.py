"""Verdicts of a run against limits and a baseline, and how a terminal shows them, line by line."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome.metrics import Measure
from hystfmu.scenario.outcome.result import CHANGED, CaseResult, Change, LoopFigures, Verdict, judge
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


@pytest.mark.parametrize(
    ("value", "limit", "good"),
    [(1.0, None, True), (1.0, 1.0, True), (1.1, 1.0, False), (math.inf, None, False), (math.nan, 1.0, False)],
)
def test_within_is_finite_and_not_above_the_limit(value: float, limit: float | None, good: bool) -> None:
    (v,), lines, _ = verdict_on(value, limit, None, strict=False)
    assert (v.within, v.same, v.baseline, v.limit, v.kind, v.metric) == (good, None, None, limit, "peak", "m")
    rule = "is not finite" if limit is None else f"exceeds the limit {limit:g}"
    assert lines == ([] if good else [f"s/c: m (peak of a.y) = {value:.6g} {rule}"])


@pytest.mark.parametrize(
    ("value", "limit", "old", "same"),
    [
        (2.0, None, 2.0, True),
        (2.0019, None, 2.0, True),
        (2.0021, None, 2.0, False),
        (-2.0019, None, -2.0, True),
        (2.0099, 10.0, 2.0, True),  # of the limit, where that is larger
        (2.0101, 10.0, 2.0, False),
        (0.9e-9, None, 0.0, True),  # rounding
        (1.1e-9, None, 0.0, False),
    ],
)
def test_the_same_within_a_tolerance(value: float, limit: float | None, old: float, same: bool) -> None:
    (v,), lines, changed = verdict_on(value, limit, old, strict=False)
    assert (v.same, v.baseline, lines) == (same, old, [])
    assert bool(changed) == (not same)


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


def test_cases_of_a_scenario_have_a_line_each() -> None:
    good = result(shown(0.5, 1.0, "rms_percent"), loop=LoopFigures(True, 2.5, 3.0))
    bad = result(shown(2.0), case="d", lines=("s/d: over",), notes=("a note",), seconds=1.5)
    lines = terminal.verdicts([good, bad]).splitlines()
    assert cells(lines[0]) == cells("scenario case verdict metric value limit Ms dB delay margin, steps seconds")
    assert cells(lines[-5]) == cells("s c ok m % 0.5 1 2.5 3 0.25")
    assert cells(lines[-4]) == cells("s d FAILED m 2 1 1.50")
    assert lines[-3:] == ["a note", "s/d: over", "1 of 2 cases passed"]
    assert "Ms dB" not in terminal.verdicts([bad])
    stopped = terminal.verdicts([result(lines=("s/c: stopped",))]).splitlines()
    assert cells(stopped[-3]) == cells("s c FAILED stopped 0.25")


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


def test_of_the_changes_the_first_is_shown() -> None:
    lines = ("x", f"a {CHANGED} 1", "y", f"b {CHANGED} 2", f"c {CHANGED} 3")
    text = terminal.verdicts([result(shown(0.5), lines=lines)]).splitlines()
    assert text[-4:-1] == ["x", "y", f"a {CHANGED} 1 (and 2 more changed)"]
    assert terminal.verdicts([result(shown(0.5), lines=lines[:2])]).splitlines()[-2] == f"a {CHANGED} 1"


def test_every_metric_has_a_line() -> None:
    text = terminal.every_metric([result(shown(0.5, None), shown(2.0, 1.0, "rms_percent", "n", 1.9))]).splitlines()
    assert cells(text[-2]) == cells("s c ok m 0.5")
    assert cells(text[-1]) == cells("s c FAILED n % 2 1 1.9")


def test_changes_as_a_table() -> None:
    assert terminal.changes([]) == "the baseline does not change"
    assert terminal.changes([], "none") == "none"
    text = terminal.changes([Change("s/c", "m", 2.0, 3.0), Change("s/c", "n", None, 1.0), Change("s/c", "o", "a", "b")])
    assert [cells(line) for line in text.splitlines()[-3:]] == [
        cells("s/c m 2 3 +50"), cells("s/c n - 1 -"), cells("s/c o a b -"),
    ]  # fmt: skip


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
