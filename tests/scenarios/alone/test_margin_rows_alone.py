"""Rows of margins and limits of loops, cell by cell."""

from __future__ import annotations

import math
from typing import Any

from hystfmu.scenario.loop import table as module
from hystfmu.scenario.loop.opening import LoopVerdict
from hystfmu.scenario.loop.table import COLUMNS, FALLING, LoopRow, MarginTable

LINEAR = dict.fromkeys(COLUMNS, 1.5) | {
    "simulated_delay_steps": None, "learning": None, "stable": True, "conditionally_stable": False,
}  # fmt: skip


def row(
    scenario: str = "s", cases: tuple[str, ...] = ("a",), at: tuple[dict[str, Any], ...] = (), **more: Any
) -> LoopRow:
    return LoopRow(scenario, cases, (0.5, 1.25), LINEAR | more, at)


def cells(line: str) -> list[str]:
    return line.split()


def test_a_row_of_a_loop() -> None:
    columns = ["Ms_db", "gain_db", "simulated_delay_steps", "learning"]
    assert row(gain_low_db=-math.inf).cells(["gain_low_db"])[3] == "-inf"
    assert row().cells(columns) == ["s", "a", "0.50..1.25", "1.5", "1.5", "", ""]
    assert row(Ms_db=None).cells(columns)[3] == "unstable"
    assert row(simulated_delay_steps=4).cells(columns)[5] == ">= 4"
    assert row(simulated_delay_steps=3.75).cells(columns)[5] == "3.75"
    assert row(simulated_delay_steps=4).cells(["Ms_db"]) == ["s", "a", "0.50..1.25", "1.5"]
    assert row(Ms_db=-0.0).cells(["Ms_db"])[3] == "0"
    assert row(cases=("a", "b")).cells([])[1] == "a, b"
    assert row(cases=("a", "b", "c")).cells([])[1] == "a, b and 1 more"


def test_rows_at_delays() -> None:
    at = tuple({"further_steps": d, "Ms_db": 2.0, "learning": None, "sector_stable": d < 1} for d in (0.0, 0.5, 1.0))
    found = row(at=at).cells_at_delay(["Ms_db", "learning"])
    assert [r[3:] for r in found] == [["0", "2", "", "stable"], ["0.5", "2", "", "stable"], ["1", "2", "", "unstable"]]
    assert all(r[:3] == ["s", "a", "0.50..1.25"] for r in found)


def test_columns_that_no_loop_has_are_left_out() -> None:
    plain, falling = row(), row(simulated_delay_steps=2.0)
    head = MarginTable([plain], [], []).text().splitlines()[0]
    assert "simulated" not in head
    assert "learning" not in head
    both = MarginTable([plain, falling], [], []).text()
    assert "delay steps, simulated" in both.splitlines()[0]
    assert both.endswith(FALLING)
    assert FALLING not in MarginTable([plain], [], []).text()
    at = ({"further_steps": 0.0, "sector_stable": True} | dict.fromkeys(module.AT_DELAY, 1.0),)
    late = MarginTable([row(at=at), row(at=at, learning=0.5)], [], []).text(delays=True)
    assert "learning factor" in late.splitlines()[0]
    assert "learning" not in MarginTable([row(at=at)], [], []).text(delays=True)
    assert "further steps" in late.splitlines()[0]
    assert "further steps" not in both


def verdict(value: float | None, bound: float = 2.0, at_least: bool = False) -> LoopVerdict:
    return LoopVerdict("s", "Ms_db", "a", value, bound, at_least)


def test_a_limit_of_a_loop() -> None:
    for value, at_least, good in [
        (2.0, False, True), (2.1, False, False), (2.0, True, True), (1.9, True, False), (None, True, False),
        (None, False, False),
    ]:  # fmt: skip
        v = verdict(value, at_least=at_least)
        assert v.within == good
        assert v.word == ("ok" if good else "BROKEN")
        assert MarginTable([], [], [v]).broken() == ([] if good else [v.line()])
    assert verdict(2.5).line() == "s: margins.Ms_db: must be at most 2 at a. Got 2.5."
    assert verdict(None, at_least=True).line() == "s: margins.Ms_db: must be at least 2 at a. Got an unstable loop."


def test_reasons_are_counted_by_scenario() -> None:
    refused = ["s/a: no feedback", "s/b: no feedback", "s/c: other", "r/a: no feedback"]
    lines = MarginTable([], refused, [verdict(9.0)]).text().splitlines()
    assert lines[-4:] == [
        "no margins: s, 2 cases: no feedback",
        "no margins: s, 1 case: other",
        "no margins: r, 1 case: no feedback",
        verdict(9.0).line(),
    ]
    assert str(MarginTable([], refused, [])) == "\n".join(lines[-4:-1])


def test_for_machines_infinity_is_none() -> None:
    at = ({"further_steps": 0.0, "gain_db": math.inf},)
    found = MarginTable(
        [row(at=at, gain_db=math.inf, gain_low_db=-math.inf, phase_deg=-math.inf)], ["s/a: x"], [verdict(1.0)]
    ).summary()
    (loop,) = found["loops"]
    m = loop["margins"]
    assert (m["gain_db"], m["gain_low_db"], m["phase_deg"], m["Ms_db"]) == (None, None, None, 1.5)
    assert loop["at_delay"] == [{"further_steps": 0.0, "gain_db": None}]
    assert found["refused"] == ["s/a: x"]
    assert found["verdicts"][0] == vars(verdict(1.0)) | {"within": True}
