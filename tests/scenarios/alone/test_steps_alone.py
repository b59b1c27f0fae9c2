"""How members are called in a step, with members that only write down their calls; and small facts of a package."""

from __future__ import annotations

import ctypes as C
import dataclasses
import importlib
import pkgutil
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import hystfmu.scenario
from hystfmu.base.errors import InputError
from hystfmu.scenario import margin_limits, run_scenarios
from hystfmu.scenario.engine.hold import Lines
from hystfmu.scenario.engine.master import _coupling, chunks_here
from hystfmu.scenario.engine.stepped_member import Calls, SteppedMember, slots
from hystfmu.scenario.outcome.trace import Stopped, Sweeps
from hystfmu.scenario.plan import _check_overrides, _plan
from hystfmu.scenario.run_scenarios import _share_done
from hystfmu.scenario.system.foreign import ForeignPort


class Told(SteppedMember):
    """A member whose three calls return what they are told."""

    def __init__(self, substeps: int = 1, lines: bool = False, statuses: Any = (0, 0, 0), copies: int = 1) -> None:
        self.name, self.calls_made = "m", list[Any]()
        self.period, self.any_step, self.sources = 1, True, [0]
        self._length, self._substeps, self._h, self._t = 0.5, substeps, C.c_double(0.5 / substeps), C.c_double(2.0)
        self._values, self._u = (C.c_double * 2)(3.0, 4.0), (C.c_double * copies)()
        self._copies, self._said, self._lines = [(k, 1) for k in range(copies)], [], None
        if lines:
            self._lines = Lines([1] * copies, [1.0] * copies, substeps, self._values)
        self.statuses = list(statuses)
        part: Any = SimpleNamespace(outputs=("y",), substeps=substeps)
        self._call(part, *[lambda k=k: self._answer(k) for k in range(3)])

    def _answer(self, k: int) -> int:
        self.calls_made.append(("put", "do", "get")[k] + f" {self._t.value:g} {list(self._u)}")
        return int(self.statuses[k])

    def start(self, t0: float) -> None: ...

    def save(self) -> None: ...

    def restore(self) -> None: ...

    def close(self) -> None: ...

    def calls(self) -> Calls:
        raise NotImplementedError

    def free_state(self, state: int) -> None: ...


def turn(m: Told) -> list[Any]:
    for call in m.turn:
        if call() > 1:
            raise m.stopped()
    return m.calls_made


def test_a_plain_turn_is_a_list_of_calls() -> None:
    assert turn(Told()) == ["put 2 [4.0]", "do 2 [4.0]", "get 2 [4.0]"]
    assert len(Told().turn) == 4
    assert turn(Told(copies=0)) == ["do 2 []", "get 2 []"]
    assert len(Told(copies=0).turn) == 2


def test_substeps_begin_one_after_the_other() -> None:
    m = Told(2)
    assert len(m.turn) == 1
    assert turn(m) == ["put 2 [4.0]", "do 2 [4.0]", "do 2.25 [4.0]", "get 2 [4.0]"]
    m.stretch(0.2)
    m.calls_made.clear()
    assert turn(m)[1:3] == ["do 2 [4.0]", "do 2.1 [4.0]"]
    m.stretch(None)
    m.calls_made.clear()
    assert turn(m)[2] == "do 2.25 [4.0]"


def test_lines_put_the_inputs_of_every_substep() -> None:
    m = Told(2, lines=True)
    m.begin()
    m._values[1] = 6.0
    assert turn(m) == ["put 2 [5.0]", "do 2 [5.0]", "put 2.25 [6.0]", "do 2.25 [6.0]", "get 2 [6.0]"]
    m.stretch(0.2)  # a line begins anew
    m._values[1] = 8.0
    m.calls_made.clear()
    assert turn(m)[0] == "put 2 [8.0]"


@pytest.mark.parametrize("substeps", [1, 2])
@pytest.mark.parametrize("lines", [False, True])
@pytest.mark.parametrize("k", [0, 1, 2])
def test_a_warning_goes_on_and_anything_worse_stops(substeps: int, lines: bool, k: int) -> None:
    for status in (0, 1):
        m = Told(substeps, lines, [status * (j == k) for j in range(3)])
        m.begin()
        turn(m)
    for status in (2, 3):
        m = Told(substeps, lines, [status * (j == k) for j in range(3)])
        m.begin()
        with pytest.raises(Stopped, match=r"^m refuses the step from t = [\d.]+ s: inputs \[[\d.]+\]$"):
            turn(m)
        m._said.append("log")
        assert str(m.stopped()).endswith(": log")
        assert m.said == "log"
    assert Told().said == "without a word"


@pytest.mark.parametrize(("size", "fmi", "want"), [(1, 2, [("p", ("p",))]), (1, 3, [("p", ("p",))])])
def test_variables_of_a_scalar_port(size: int, fmi: int, want: Any) -> None:
    assert slots(ForeignPort("p", "input", "", (0.0,) * size), fmi) == want
    three = ForeignPort("p", "input", "", (0.0,) * 3)
    assert slots(three, 3) == [("p", ("p_1", "p_2", "p_3"))]
    assert slots(three, 2) == [(f"p_{k}", (f"p_{k}",)) for k in (1, 2, 3)]


# ---- couplings -----------------------------------------------------------------------------------------------------
class Noted:
    """Adds half of the value that it reads to its own."""

    def __init__(self, name: str, values: Any, notes: list[str], fails: int = 0) -> None:
        self.name, self.notes, self.values, self.fails = name, notes, values, fails
        self.turn = [lambda: self.note("turn") or fails]

    def note(self, what: str) -> None:
        self.notes.append(f"{self.name}.{what}")
        if what == "turn":
            self.values[0] = 1.0 + 0.5 * self.values[0]

    def __getattr__(self, what: str) -> Any:
        return lambda *a: self.note(what)

    def stopped(self) -> Stopped:
        return Stopped(f"{self.name} stops")


def coupled(scheme: str, fails: int = 0, **spec: Any) -> tuple[list[str], Sweeps, Any]:
    values, notes, sweeps = np.zeros(1), list[str](), Sweeps()
    told = SimpleNamespace(scheme=scheme, max_sweeps=spec.get("most", 5), tolerance=spec.get("tolerance", 1e-9))
    system: Any = SimpleNamespace(case=SimpleNamespace(coupling=told), early=lambda: np.array([0]), newton=False)
    due: Any = [Noted("a", values, notes, fails)]
    run = _coupling(system, values, sweeps)(due)
    return notes, sweeps, lambda t: (run(t), values[0])[1]


def test_the_order_of_calls_of_a_coupling() -> None:
    notes, _, run = coupled("gauss_seidel")
    run(0.0)
    assert notes == ["a.turn"]
    notes, _, run = coupled("jacobi")
    run(0.0)
    assert notes == ["a.copy", "a.advance", "a.take"]
    with pytest.raises(Stopped, match=r"^a stops$"):
        coupled("gauss_seidel", 2)[2](0.0)
    assert coupled("gauss_seidel", 1)[2](0.0) == 1.0


def test_sweeps_agree_by_relaxation_or_say_so() -> None:
    """x = 1 + x/2: the secant of the first two residuals meets x = 2."""
    notes, sweeps, run = coupled("iterative")
    assert run(0.0) == 2.0
    assert notes == ["a.save", "a.turn", "a.restore", "a.turn", "a.restore", "a.turn"]
    assert sweeps == Sweeps(3, 3, 1)
    assert coupled("iterative", tolerance=0.5)[2](0.0) == 1.0, (
        "the residual is 1 and the value is 1: within 0.5 of both"
    )
    assert coupled("iterative", tolerance=0.49)[2](0.0) > 1.0
    with pytest.raises(Stopped, match=r"^2 sweeps at t = 0\.25 s do not agree; allow more, or a shorter step$"):
        coupled("iterative", most=2)[2](0.25)
    assert coupled("iterative", most=3)[2](0.0) == 2.0


def test_an_engine_that_is_none() -> None:
    with pytest.raises(InputError, match=r"^engine: must be one of fmpy, native\. Got 'x' instead\.$"):
        next(chunks_here(None, "x"))  # type: ignore[arg-type]


# ---- plans ---------------------------------------------------------------------------------------------------------
def test_progress_counts_rows() -> None:
    plans: Any = [SimpleNamespace(systems=[SimpleNamespace(n_steps=n) for n in some]) for some in ([0, 2], [3])]
    seen: list[float] = []
    advance = _share_done(plans, seen.append)
    for n in (1, 3, 4):
        advance(n)
    assert seen == [0.125, 0.5, 1.0]


def test_an_override_that_nothing_takes_names_what_is_near() -> None:
    systems: Any = [SimpleNamespace(overridden={"a.x"}, parameters={"a.x", "plant.gain"})]
    _check_overrides({"a.x": 1}, systems)
    said = r"^--set plant\.gaim: none of the scenarios has a unit with that parameter\. Did you mean 'plant\.gain'\?$"
    with pytest.raises(InputError, match=said):
        _check_overrides({"a.x": 1, "plant.gaim": 2}, systems)
    with pytest.raises(InputError, match=r"that parameter\.$"):
        _check_overrides({"zzz.q": 2}, systems)


def test_a_plan_without_baseline(tmp_path: Any) -> None:
    def planned(folder: Any, limit: float | None, record: bool = False, strict: bool = True) -> Any:
        metrics = {"m": SimpleNamespace(limit=limit)}
        system: Any = SimpleNamespace(case=SimpleNamespace(metrics=metrics, guard=None))
        scenario: Any = SimpleNamespace(folder=folder, spec=SimpleNamespace(name="s", guard=None))
        return _plan(scenario, (system,), record, strict)

    limited, free = planned(tmp_path, 1.0), planned(tmp_path, None)
    assert (limited.strict, limited.note.startswith("s: no baseline yet")) == (False, True)
    assert (free.strict, free.note) == (True, "")
    assert not planned(tmp_path, None, strict=False).strict
    assert (planned(None, 1.0).strict, planned(tmp_path, 1.0, True).strict) == (False, False)
    assert planned(tmp_path, 1.0, True).note == planned(None, 1.0).note == ""


def test_what_a_record_does_not_take() -> None:
    for more, said in [
        ({"overrides": {"a.x": 1}}, "it takes neither --set nor --coupling"),
        ({"coupling": "jacobi"}, "it takes neither --set nor --coupling"),
        ({"case": "c"}, "it takes no --case"),
    ]:
        with pytest.raises(InputError, match=said):
            run_scenarios([], record=True, **more)


def test_loops_of_a_scenario_with_its_slopes(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Any] = []

    def opened(system: Any, slopes: Any) -> str:
        seen.append(slopes)
        if system == "bad":
            raise InputError("no loop")
        return f"loop of {system}"

    monkeypatch.setattr(margin_limits, "build", lambda case: case.name)
    monkeypatch.setattr(margin_limits, "open_loop", opened)

    def found(margins: Any) -> Any:
        cases = [SimpleNamespace(name=n) for n in ("a", "bad", "c")]
        return margin_limits.opened_loops(SimpleNamespace(spec=SimpleNamespace(margins=margins), cases=cases))  # type: ignore

    assert {c: str(o) for c, o in found(None).items()} == {"a": "loop of a", "bad": "no loop", "c": "loop of c"}
    found(SimpleNamespace(slopes=None))
    found(SimpleNamespace(slopes=[0.5, 2.0]))
    assert seen == [None] * 6 + [(0.5, 2.0)] * 3


# ---- the package ---------------------------------------------------------------------------------------------------
def test_values_of_the_package_cannot_be_changed() -> None:
    """All dataclasses are frozen but the one that counts."""
    found = {}
    for info in pkgutil.walk_packages(hystfmu.scenario.__path__, "hystfmu.scenario."):
        for name, value in vars(importlib.import_module(info.name)).items():
            if dataclasses.is_dataclass(value) and isinstance(value, type) and value.__module__ == info.name:
                found[name] = value.__dataclass_params__.frozen  # type: ignore[attr-defined]
    assert len(found) > 20
    assert [name for name, frozen in found.items() if not frozen] == ["Sweeps"]
