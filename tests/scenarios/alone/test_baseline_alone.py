"""A baseline by hand: what is kept of a run, how it is written and read, what a change of every part says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome.result import (
    BASELINE_ROWS,
    Baseline,
    Change,
    Kept,
    Record,
    _outside,
    changes,
    compare,
    save_baseline,
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


# ---- what is kept --------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("n", [1, 2, 23, 24, 25, 100, 1001])
def test_some_rows_are_kept_with_the_first_and_the_last(n: int) -> None:
    rows = kept(system(n), run(n)).rows()
    assert rows.shape == (min(n, BASELINE_ROWS), 3)
    at = (rows[:, 0] / H).round().astype(int)
    assert (at[0], at[-1]) == (0, n - 1)
    assert np.ptp(np.diff(at)) <= 1 if n > 1 else True
    assert rows[:, 1].tolist() == at.tolist()
    assert rows[:, 2].tolist() == (10 * at).tolist()


def test_around_the_rows_of_a_tube_all_rows_are_kept() -> None:
    """As many as the tube is wide, and two more; at both ends of the run too."""
    n, tube = 2001, TubeSpec(time=3 * H, value=0.1)
    old = baseline([[500 * H, 0.0, 0.0]])
    found = kept(system(n, tube), run(n), old).trace
    at = set((found.t / H).round().astype(int).tolist())
    for middle in (0, 500, n - 1):
        for k in range(middle - 6, middle + 7):
            assert (k in at) == (0 <= k < n and abs(k - middle) <= 5), k
    assert len(kept(system(n), run(n), old).trace.t) == BASELINE_ROWS
    other = Baseline({}, {"d": np.zeros((1, 3))}, (), {})
    assert len(kept(system(n, tube), run(n), other).trace.t) == BASELINE_ROWS


# ---- files ---------------------------------------------------------------------------------------------------------
def test_what_is_written_is_read(tmp_path: Path) -> None:
    assert Baseline.load(tmp_path) is None
    record = Record({"rms": 0.1}, np.array([[0.0, 1 / 3, -2.0], [0.25, 1e-300, 4.0]]), {"u": "abc"})
    save_baseline(tmp_path, ("a.y", "b.y"), {"c": record, "d": Record({}, np.zeros((1, 3)), {})})
    text = (tmp_path / "baseline.csv").read_text()
    assert text == f"case,t,a.y,b.y\nc,0.0,{1 / 3!r},-2.0\nc,0.25,1e-300,4.0\nd,0.0,0.0,0.0\n"
    found = Baseline.load(tmp_path)
    assert found is not None
    assert (found.metrics, found.signals) == ({"c": {"rms": 0.1}, "d": {}}, ("a.y", "b.y"))
    assert found.final_states == {"c": {"u": "abc"}, "d": {}}
    assert found.rows["c"].tolist() == record.rows.tolist()
    assert "final_states" not in (tmp_path / "baseline.toml").read_text().partition("[case.d")[2]


@pytest.mark.parametrize(
    ("csv", "said"),
    [
        ("case,x,a.y\nc,0,1\n", "line 1: must begin with case,t; record the baseline again with --record"),
        ("case,t,a.y\nc,0,1\nc,1\n", "line 3: must have 2 numbers; got ['1']"),
        ("case,t,a.y\nc,0,1,2\n", "line 2: must have 2 numbers; got ['0', '1', '2']"),
        ("case,t,a.y\nc,0,x\n", "line 2: must have 2 numbers; got ['0', 'x']"),
        ("case,t,a.y\nc,0,nan\n", "line 2: must have 2 numbers; got ['0', 'nan']"),
        ("case,t,a.y\nc,0,inf\n", "line 2: must have 2 numbers; got ['0', 'inf']"),
    ],
)
def test_a_damaged_table_names_its_line(tmp_path: Path, csv: str, said: str) -> None:
    (tmp_path / "baseline.toml").write_text("[case.c.metrics]\n")
    (tmp_path / "baseline.csv").write_text(csv)
    with pytest.raises(InputError) as e:
        Baseline.load(tmp_path)
    assert str(e.value) == f"{tmp_path / 'baseline.csv'}: {said}"


# ---- what a record would change ------------------------------------------------------------------------------------
def test_a_change_as_a_share_of_the_old_value() -> None:
    assert Change("s", "m", 2.0, 3.0).relative == 0.5
    assert Change("s", "m", -2.0, -3.0).relative == -0.5
    for old, new in [(0.0, 1.0), (None, 1.0), (1.0, None), ("a", "b")]:
        assert Change("s", "m", old, new).relative is None


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


def test_other_rows_or_signals_are_not_compared() -> None:
    s, n = system(5), 5
    rows = np.column_stack([H * np.arange(n), np.arange(n), 10.0 * np.arange(n)])
    said = ["s/c: baseline.csv has other rows or signals than the scenario: run with --record"]
    good = baseline(rows)
    assert compare(s.case, kept(s, run(n)), good) == []
    assert compare(s.case, kept(s, run(n)), baseline(rows[:-1])) == said
    assert compare(s.case, kept(s, run(n)), replace(good, signals=("b.y", "a.y"))) == said
    assert compare(s.case, kept(s, run(n)), replace(good, rows={})) == said


def test_final_states_are_compared_by_unit() -> None:
    s, n = system(5), 5
    rows = np.column_stack([H * np.arange(n), np.arange(n), 10.0 * np.arange(n)])
    found = kept(s, run(n, states={"u": "1", "v": "2", "w": "3"}))
    assert compare(s.case, found, baseline(rows, states={"u": "1", "v": "9"})) == [
        "s/c: the final states of v (2) changed against the baseline 9",
        "s/c: no baseline of the final states of w: run with --record",
    ]


# ---- a tube --------------------------------------------------------------------------------------------------------
def outside(signal: Any, at: float, was: float, time: float, room: float = 0.0) -> float:
    n = len(signal)
    s = system(n)
    found = kept(s, run(n, np.column_stack([signal, signal])))
    assert n <= BASELINE_ROWS
    return float(_outside(TubeSpec(time=time, value=0.5), found, "a.y", np.array([at]), np.array([was]), room)[0])


def test_a_value_is_met_if_the_signal_passes_its_box() -> None:
    """The signal is a line of slope 4 per second; the box reaches from t - time to t + time."""
    line = np.arange(9.0)
    for time in (0.25, 0.3, 0.5):
        reach = 4 * time
        for was, gap in [(4.0 + reach, 0.0), (4.0 + reach + 0.5, 0.5), (4.0 - reach - 0.25, 0.25)]:
            assert outside(line, 1.0, was, time) == pytest.approx(gap, abs=1e-12)
            assert outside(line, 1.0, was, time, 0.2) == pytest.approx(gap - 0.2, abs=1e-12)
    assert outside(line, 1.0, 4.0, 0.5) < 0


def test_an_extremum_inside_the_box_counts() -> None:
    peak = np.array([0.0, 0, 0, 5, 0, 0, 0, -3, 0])
    assert outside(peak, 0.75, 5.0, 0.25) == 0
    assert outside(peak, 1.0, 5.0, 0.3) == 0
    assert outside(peak, 1.0, 5.5, 0.3) == 0.5
    assert outside(peak, 1.5, -3.0, 0.3) == 0
    assert outside(peak, 1.5, -4.0, 0.3) == 1


def test_beyond_its_ends_a_signal_goes_on_as_its_point_reflection() -> None:
    line = np.arange(9.0)
    assert outside(line, 0.0, -2.0, 0.5) == pytest.approx(0.0, abs=1e-12)
    assert outside(line, 2.0, 10.0, 0.5) == pytest.approx(0.0, abs=1e-12)
    assert outside(line, 2.0, 11.0, 0.5) == pytest.approx(1.0, abs=1e-12)
    assert outside(np.array([3.0]), 0.0, 4.0, 0.5) == 1.0
    assert outside(line, 1.0, 4.5, 0.0) == 0.5
