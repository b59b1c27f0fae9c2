"""Rows of margins, limits of loops and delays by simulation, cell by cell."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario import margin_table as module
from hystfmu.scenario.loop import simulated
from hystfmu.scenario.loop.simulated import simulated_delay
from hystfmu.scenario.margin_limits import LoopVerdict, verdicts_of
from hystfmu.scenario.margin_table import COLUMNS, FALLING, LoopRow, MarginTable, _row

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


# ---- from loops to rows --------------------------------------------------------------------------------------------
class Loop:
    """A loop whose margins are told: stable below a product of slope and delay."""

    def __init__(self, slopes: tuple[float, float], name: str = "a", to: float = 1.0, key: Any = 0) -> None:
        self.slopes, self.falling, self.memories, self.to, self.key = slopes, False, (), to, (key,)
        self.system = SimpleNamespace(case=SimpleNamespace(scenario="s", name=name))
        self.side = SimpleNamespace(entry="entry")
        self.asked: list[tuple[float, ...]] = []

    def __replace(self, **more: Any) -> Any:
        other = Loop(more["slopes"], self.system.case.name, self.to)
        other.memories = self.memories
        other.asked = self.asked
        return other

    def margins(self, slope: float = 1.0, delay: float = 0.0) -> Any:
        self.asked.append((slope, delay))
        stable = slope * delay <= 2
        return SimpleNamespace(
            stable=stable,
            Ms_db=slope + 10 * delay,
            gain_db=1.0,
            gain_low_db=-6.0,
            conditional=stable,
            phase_deg=2.0,
            delay_steps=3.0,
            bandwidth_hz=4.0,
        )

    def worst_peak_db(self, delay: float) -> float:
        return np.inf if delay > 1 else 7.0 + delay

    def noise_gain(self, delay: float) -> float:
        return 5.0 + delay

    def learning(self, delay: float) -> float:
        return 0.5 + delay

    def stable_to(self, delays: Any = ()) -> float:
        return self.to

    def stable_at(self, delay: float) -> bool:
        return delay < 1


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "replace", lambda loop, **more: loop._Loop__replace(**more))


@pytest.mark.usefixtures("told")
def test_a_row_joins_the_sectors_of_its_cases() -> None:
    found = _row([Loop((0.5, 1.5)), Loop((0.4, 1.2), "b"), Loop((0.6, 1.75), "c")], True)  # type: ignore[list-item]
    assert (found.scenario, found.cases, found.slopes) == ("s", ("a", "b", "c"), (0.4, 1.75))
    m = found.margins
    assert (m["Ms_db"], m["Ms_1_db"], m["Ms_1_largest_db"]) == (1.0, 11.0, 11.75)
    assert (m["Ms_worst_db"], m["noise_gain"], m["learning"], m["stable_to_steps"]) == (7.0, 5.0, None, 1.0)
    assert m["simulated_delay_steps"] is None
    assert [f["further_steps"] for f in found.at_delay] == [0.0, 0.5, 1.0, 2.0]
    assert [f["sector_stable"] for f in found.at_delay] == [True, True, False, False]
    assert [f["Ms_worst_db"] for f in found.at_delay] == [7.0, 7.5, 8.0, None]
    assert [f["Ms_db"] for f in found.at_delay] == [1.0, 6.0, 11.0, 21.0]
    assert _row([Loop((0.5, 1.5))], False).at_delay == ()  # type: ignore[list-item]


@pytest.mark.usefixtures("told")
def test_what_an_unstable_loop_has_is_nothing() -> None:
    steep = Loop((0.5, 2.5), to=np.nan)
    steep.memories = ("m",)  # type: ignore[assignment]
    m = _row([steep], True)  # type: ignore[list-item]
    assert (m.margins["Ms_1_largest_db"], m.margins["stable_to_steps"]) == (None, None)
    assert m.margins["Ms_1_db"] == 11.0
    assert m.margins["learning"] == 0.5
    assert [f["noise_gain"] for f in m.at_delay] == [5.0, 5.5, 6.0, 7.0]


@pytest.mark.usefixtures("told")
@pytest.mark.parametrize(("found", "shown"), [(1.25, 1.25), (float("nan"), None)])
def test_only_a_falling_gain_is_simulated(monkeypatch: pytest.MonkeyPatch, found: float, shown: float | None) -> None:
    monkeypatch.setattr(module, "simulated_delay", lambda system, entry: found)
    loop = Loop((0.5, 1.5))
    assert _row([loop], False).margins["simulated_delay_steps"] is None  # type: ignore[list-item]
    loop.falling = True
    assert _row([loop], False).margins["simulated_delay_steps"] == shown  # type: ignore[list-item]


# ---- limits --------------------------------------------------------------------------------------------------------
def scenario(**limits: Any) -> Any:
    spec = {"case": None, "Ms_db": None, "stable_to_steps": None, "slopes": None, "corners": ["*"]} | limits
    margins = SimpleNamespace(**spec) if limits else None
    cases = [SimpleNamespace(name="a"), SimpleNamespace(name="b")]
    return SimpleNamespace(spec=SimpleNamespace(margins=margins, name="s"), origin="o", cases=cases)


def test_limits_of_a_scenario() -> None:
    loops: Any = {"a": Loop((0.5, 1.0), to=2.0, key="a"), "b": Loop((0.5, 1.0), to=1.0, key="b")}
    assert verdicts_of(scenario(), loops) == []
    assert verdicts_of(scenario(Ms_db=3.0), loops) == [LoopVerdict("s", "Ms_db", "a", 1.0, 3.0, False)]
    assert verdicts_of(scenario(Ms_db=3.0, case="b"), loops)[0].where == "b"
    assert verdicts_of(scenario(stable_to_steps=1.5), loops) == [
        LoopVerdict("s", "stable_to_steps", "b, the worst of 2", 1.0, 1.5, True)
    ]
    assert verdicts_of(scenario(stable_to_steps=1.5, corners=["a*"]), loops)[0].where == "a, the worst of 1"
    loops["b"].to = math.nan
    (found,) = verdicts_of(scenario(stable_to_steps=0.0), loops)
    assert (found.value, found.where, found.within) == (None, "b, the worst of 2", False)
    with pytest.raises(InputError, match=r"^o: margins\.case: The case must have a loop\. Got 'c' instead\.$"):
        verdicts_of(scenario(Ms_db=3.0, case="c"), loops)
    with pytest.raises(
        InputError, match=r"^o: margins\.corners: A case with a loop must have such a name\. Got \['x'\]"
    ):
        verdicts_of(scenario(stable_to_steps=1.0, corners=["x"]), loops)


def test_an_unstable_loop_has_no_peak() -> None:
    loop = Loop((0.5, 1.0))
    loop.margins = lambda: SimpleNamespace(stable=False, Ms_db=1.0)  # type: ignore[method-assign,assignment]
    assert verdicts_of(scenario(Ms_db=3.0), {"a": loop})[0].value is None  # type: ignore[dict-item]


def test_progress_and_groups_of_a_table(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half of it for opening the loops, half for their margins; loops with one key share a row."""

    def system(name: str) -> Any:
        return SimpleNamespace(case=SimpleNamespace(scenario="s", name=name))

    class Opened(SimpleNamespace):
        def __str__(self) -> str:
            return "a loop"

        def margins(self) -> Any:
            return SimpleNamespace(stable=self.system.case.name != "d")

        def stable_at(self, delay: float) -> bool:
            return True

    class Row(list[str]):
        @property
        def stable(self) -> bool:
            return "d" not in self

    plans = [SimpleNamespace(systems=[system(n) for n in "abcd"], scenario=SimpleNamespace(origin="o"))]
    monkeypatch.setattr(module, "read", lambda paths, overrides, coupling: paths)
    monkeypatch.setattr(module, "plan", lambda *a, **more: plans)
    monkeypatch.setattr(module, "_row", lambda group, delays: Row([o.system.case.name for o in group]))
    monkeypatch.setattr(module, "verdicts_of", lambda scenario, opened: sorted((c, str(o)) for c, o in opened.items()))
    monkeypatch.setattr(module, "stability_of", lambda scenario, opened, lost: [f"lost: {c}" for c in lost])

    def opened(system: Any, at: str) -> Any:
        if system.case.name == "b":
            raise InputError("s/b: no feedback")
        return Opened(key=(system.case.name == "c",), system=system)

    monkeypatch.setattr(module, "open_loop", opened)
    seen: list[float] = []
    found = module.margin_table(["x"], progress=seen.append)
    assert seen == [0.0, 0.125, 0.25, 0.375, 0.75, 1.0]
    assert (found.rows, found.refused) == ([["a", "d"], ["c"]], ["s/b: no feedback"])
    given = [("a", "a loop"), ("b", "s/b: no feedback"), ("c", "a loop"), ("d", "a loop")]
    assert found.verdicts == [*given, "lost: d"], "loops, or why there is none; of equal loops only the unstable one"
    assert module.margin_table(["x"], "a").verdicts == ["lost: d"], "with named cases their stability alone"


# ---- by simulation -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("ripple", [1, 4])
def test_a_delay_grows_by_bisection_until_the_case_does_not_hold(monkeypatch: pytest.MonkeyPatch, ripple: int) -> None:
    system: Any = SimpleNamespace(case=SimpleNamespace(ripple=ripple))
    monkeypatch.setattr(simulated, "_delayed", lambda s, entry, n: n)

    def found(errors: Any) -> float:
        monkeypatch.setattr(simulated, "_errors", errors)
        return simulated_delay(system, None, 1.5, 0.25)  # type: ignore[arg-type]

    for holds in range(4 * ripple + 1):
        for worse in (None, (1.0, 1.6), (1.0, 1.51), (1.3, 1.0)):
            assert found(lambda s, h=holds, w=worse: (1.0, 1.0) if s is system or s <= h else w) == holds / ripple
    assert found(lambda s: (1.0, 1.0) if s is system or s <= 2 else (1.0, 1.25)) == 4.0, "equal to a limit still holds"
    assert found(lambda s: (0.5, 0.75)) == 4.0
    assert math.isnan(found(lambda s: None))
    assert math.isnan(found(lambda s: (1.0, 1.51)))
    assert found(lambda s: (1.0, 1.5)) == 4.0
