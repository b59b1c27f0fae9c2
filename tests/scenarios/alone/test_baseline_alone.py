"""A baseline by hand: what is kept of a run, how it is written and read, what a change of every part says."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from hystfmu.scenario.outcome.baseline import (
    Baseline,
    Change,
    Kept,
    Record,
    changes,
    compare,
)
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.spec import TubeSpec

H = 0.25
ENDS = {"a.y": 0, "b.y": 1}


def system(n: int, tube: TubeSpec | None = None, tolerance: float = 1e-6) -> Any:
    case = SimpleNamespace(
        name="c", title="s/c", record=("a.y", "b.y"), tube=tube, tolerance=tolerance, stop=(n - 1) * H
    )

    def rows(t: Any) -> Any:
        return np.ceil(np.round(t / H, 9)).astype(np.int64)

    return SimpleNamespace(case=case, n_steps=n - 1, h=H, rows=rows)


def run(n: int, values: Any = None, states: dict[str, str] | None = None) -> Trace:
    given = np.column_stack([np.arange(n), 10.0 * np.arange(n)]) if values is None else np.asarray(values)
    return Trace(H * np.arange(n), given.astype(float), ENDS, 1, states or {})


def kept(s: Any, trace: Trace, old: Baseline | None = None) -> Kept:
    found = Kept(s, old)
    found.add(trace)
    return found


def baseline(rows: Any, metrics: dict[str, float] | None = None, states: dict[str, str] | None = None) -> Baseline:
    return Baseline({"c": metrics or {}}, {"c": np.asarray(rows)}, ("a.y", "b.y"), {"c": states or {}})


# ---- what a record would change ------------------------------------------------------------------------------------


def test_everything_that_a_record_would_change() -> None:
    rows = np.array([[0.0, 1.0, 5.0], [0.5, 2.0, 6.0]])
    old = Baseline({"c": {"x": 1.0, "y": 2.0}, "gone": {"x": 4.0}}, {"c": rows}, ("a.y", "b.y"), {"c": {"u": "1"}})
    new = rows + np.array([[0, 0.5, 0], [0, -0.75, 0]])
    assert changes("s", old, {"c": Record({"x": 1.0, "z": 3.0}, new, {"u": "2", "v": "3"})}) == [
        Change("s/c", "y", 2.0, None),
        Change("s/c", "z", None, 3.0),
        Change("s/c", "a.y at 0.5 s", 2.0, 1.25),
        Change("s/c", "final states of u", "1", "2"),
        Change("s/c", "final states of v", None, "3"),
        Change("s/gone", "x", 4.0, None),
    ]
    assert changes("s", None, {"c": Record({"x": 1.0}, rows, {})}) == [Change("s/c", "x", None, 1.0)]
    assert changes("s", old, {"c": Record({"x": 1.0, "y": 2.0}, rows[:1], {"u": "1"})}) == [
        Change("s/gone", "x", 4.0, None)
    ]


# ---- what a run says -----------------------------------------------------------------------------------------------
def test_a_signal_is_compared_with_room_relative_to_its_largest_value() -> None:
    n = 5
    old = baseline(np.column_stack([H * np.arange(n), np.arange(n), -10.0 * np.arange(n)]))
    base = np.column_stack([np.arange(n), -10.0 * np.arange(n)])
    for tolerance, off, good in [(1e-3, 0.03, True), (1e-3, 0.05, False), (1e-3, -0.05, False)]:
        s = system(n, tolerance=tolerance)
        moved = base + np.array([[0, 0]] * 2 + [[0, off]] + [[0, 0]] * 2)
        lines = compare(s.case, kept(s, run(n, moved)), old)
        want = f"s/c: b.y = {-20 + off:.9g} at t = 0.5 s changed against the baseline -20 "
        assert lines == ([] if good else [f"{want}(tolerance 0.001 of its largest value)"])


def test_final_states_are_compared_by_unit() -> None:
    s, n = system(5), 5
    rows = np.column_stack([H * np.arange(n), np.arange(n), 10.0 * np.arange(n)])
    found = kept(s, run(n, states={"u": "1", "v": "2", "w": "3"}))
    assert compare(s.case, found, baseline(rows, states={"u": "1", "v": "9"})) == [
        "s/c: the final states of v (2) changed against the baseline 9",
        "s/c: no baseline of the final states of w: run with --record",
    ]
