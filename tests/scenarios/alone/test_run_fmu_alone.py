"""A foreign FMU by itself: its table of inputs, its times and steps, what it leaves behind; without a binary."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.fmu.foreign.instance import Ended, Finding
from hystfmu.scenario import run_fmu as module
from hystfmu.scenario.engine import alone
from hystfmu.scenario.engine.alone import Task, _inputs, _run, main
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.run_fmu import FmuRun, _table, _task
from hystfmu.scenario.system.foreign import ForeignPort


def port(name: str, size: int = 1, kind: str = "input", type_: str = "Float64", variability: str = "continuous") -> Any:
    variable = SimpleNamespace(name=name, type=type_, variability=variability)
    return ForeignPort(name, kind, "", (0.0,) * size, "", variable)  # type: ignore[arg-type]


def foreign(*ports: Any, fixed: float | None = None, **experiment: Any) -> Any:
    stated = SimpleNamespace(**({"startTime": None, "stopTime": None, "stepSize": None} | experiment))
    simulation = SimpleNamespace(fixedInternalStepSize=fixed)
    description = SimpleNamespace(defaultExperiment=stated if experiment else None, coSimulation=simulation)
    return SimpleNamespace(ports=ports, description=description, path="x.fmu", folder=Path("."), settings={"p": 1.0})


# ---- the table -----------------------------------------------------------------------------------------------------
def test_columns_become_inputs_in_the_order_of_their_elements(tmp_path: Path) -> None:
    (tmp_path / "u.csv").write_text("u_2,t [ms],v,u_1\n1,0,10,4\n2,500,20,5\n3,2000,30,6\n")
    f = foreign(port("v"), port("w"), port("u", 2))
    t, driven, signals = _table(tmp_path / "u.csv", f)
    assert t.tolist() == [0.0, 0.5, 2.0]
    assert [p.name for p in driven] == ["v", "u"]
    assert signals.tolist() == [[10.0, 4.0, 1.0], [20.0, 5.0, 2.0], [30.0, 6.0, 3.0]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b\n1,2\n2,3\n", "a column of time is needed, named t or time; there are 'a', 'b'"),
        ("t [m],v\n1,2\n2,3\n", "the time must be in s, "),
        ("t,z\n1,2\n2,3\n", "'z' is no input of x.fmu; there are v, u_1, u_2"),
        ("t,u_1\n1,2\n2,3\n", "the input 'u' needs columns for all elements; 'u_2' is missing"),
        ("t,v\n1,2\n0.5,3\n", "the times must not decrease, and there must be a row"),
    ],
)
def test_a_table_that_does_not_fit(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "u.csv").write_text(text)
    with pytest.raises(InputError) as e:
        _table(tmp_path / "u.csv", foreign(port("v"), port("u", 2)))
    assert str(e.value).startswith(f"{tmp_path / 'u.csv'}: {said}")


def test_equal_times_are_a_discontinuity(tmp_path: Path) -> None:
    (tmp_path / "u.csv").write_text("time,v\n0,1\n1,2\n1,3\n2,4\n")
    assert _table(tmp_path / "u.csv", foreign(port("v")))[0].tolist() == [0.0, 1.0, 1.0, 2.0]


# ---- start, stop, step ---------------------------------------------------------------------------------------------
T = np.array([0.0, 4.0])


def task(f: Any, step: float | None = None, stop: float | None = None, table: bool = True) -> Task:
    return _task("x.fmu", f, T, (), np.zeros((2, 0)), step, stop, table)


@pytest.mark.parametrize(
    ("experiment", "fixed", "given", "want"),
    [
        ({}, None, {}, (0.0, 0.008, 500)),
        ({"startTime": 1.0}, None, {}, (1.0, 0.006, 500)),
        ({"stopTime": 2.0}, None, {}, (0.0, 0.004, 500)),
        ({"stopTime": 2.0}, None, {"stop": 3.0}, (0.0, 0.006, 500)),
        ({"stopTime": 2.0, "stepSize": 0.5}, 0.25, {}, (0.0, 0.5, 4)),
        ({"stopTime": 2.0}, 0.25, {}, (0.0, 0.25, 8)),
        ({"stopTime": 2.0, "stepSize": 0.5}, 0.25, {"step": 1.0}, (0.0, 1.0, 2)),
        ({"startTime": "1", "stopTime": "2.5", "stepSize": "0.5"}, None, {}, (1.0, 0.5, 3)),
    ],
)
def test_times_and_steps(experiment: Any, fixed: float | None, given: Any, want: tuple[float, float, int]) -> None:
    made = task(foreign(fixed=fixed, **experiment), **given)
    assert (made.start, made.step, made.n_steps) == want


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"table": False}, "states no stop time; give --stop"),
        ({"stop": 0.0}, "the stop time must be finite and after the start at 0 s; got 0"),
        ({"stop": math.inf}, "the stop time must be finite and after the start at 0 s; got inf"),
        ({"step": 0.0}, "the step must be finite and greater than 0; got 0"),
        ({"step": -1.0}, "the step must be finite and greater than 0; got -1"),
        ({"step": math.inf}, "the step must be finite and greater than 0; got inf"),
        ({"step": 9.0}, "0.444444 steps of 9 s; at least 1 and at most 10000000 can run"),
        ({"step": 3e-7}, "1.33333e+07 steps of 3e-07 s; at least 1 and at most 10000000 can run"),
    ],
)
def test_times_that_make_no_run(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=f"^x.fmu: {re.escape(said)}$"):
        task(foreign(), **given)


def test_the_limit_of_steps_and_of_values(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_STEPS", 8)
    monkeypatch.setattr(module, "MOST_VALUES", 12)
    wide = foreign(port("y", 2, "output"), port("u", 9))
    for f, n, good in [(foreign(), 8, True), (foreign(), 9, False), (wide, 6, True), (wide, 7, False)]:
        if good:
            assert task(f, step=4.0 / n).n_steps == n
        else:
            with pytest.raises(InputError, match=r"can run$"):
                task(f, step=4.0 / n)


# ---- between the rows ----------------------------------------------------------------------------------------------
def test_continuous_inputs_go_straight_and_others_hold() -> None:
    driven = (port("u"), port("n", type_="Int32"), port("d", variability="discrete"), port("r", type_="Real"))
    signals = np.array([[0.0, 0, 0, 0], [4.0, 4, 4, 4], [8.0, 8, 8, 8]])
    made = Task(foreign(), driven, np.array([1.0, 2.0, 3.0]), signals, 0.0, 0.5, 8)
    found = _inputs(made, np.array([0.5, 1.0, 1.5, 2.0 - 1e-10, 2.0 - 1e-8, 2.5, 3.0, 9.0]))
    assert found[:, 0] == pytest.approx([0, 0, 2, 4, 4, 6, 8, 8], abs=1e-7)
    assert found[:, 1].tolist() == [0, 0, 0, 4, 0, 4, 8, 8]
    assert found[:, 2].tolist() == found[:, 1].tolist()
    assert found[:, 3].tolist() == found[:, 0].tolist()


class Unit:
    """In place of an FMU: counts its steps, and adds what it was last given."""

    ends_at, fails_at, made = 10**9, 10**9, None

    def __init__(self, folder: Any, description: Any, inputs: Any, outputs: Any, name: str, say: Any) -> None:
        type(self).made = self
        self.said, self.calls, self.u, self.n = say, [], [], 0
        self.shapes = [[(v.name, n) for v, n in x] for x in (inputs, outputs)]

    def set_parameters(self, settings: Any) -> None:
        self.calls.append(("set", settings))

    def start(self, t: float, u: list[float]) -> None:
        self.calls.append(("start", t))
        self.u = u

    def step(self, t: float, h: float) -> None:
        self.n += 1
        if self.n == self.ends_at:
            raise Ended("it ends")
        if self.n == self.fails_at:
            self.said("log")
            raise Finding("it fails")
        self.calls.append((t, h))

    def put(self, u: list[float]) -> None:
        self.u = u

    def get(self) -> list[float]:
        return [float(self.n), sum(self.u)]


@pytest.fixture
def ramp(monkeypatch: pytest.MonkeyPatch) -> Task:
    monkeypatch.setattr(alone, "Simulated", Unit)
    monkeypatch.setattr(alone, "_CHUNK", 3)
    monkeypatch.setattr(Unit, "ends_at", 10**9)
    f = foreign(port("u"), port("y", 2, "output"))
    return Task(f, (f.ports[0],), np.array([0.0, 10.0]), np.array([[0.0], [10.0]]), 1.0, 0.5, 7)


def values(folder: Path) -> list[list[float]]:
    return np.fromfile(folder / "values").reshape(-1, 2).tolist()  # type: ignore[no-any-return]


def test_a_row_after_every_step_with_the_inputs_of_its_beginning(ramp: Task, tmp_path: Path) -> None:
    assert _run(ramp, tmp_path) == (8, "")
    assert Unit.made is not None
    assert Unit.made.calls == [("set", {"p": 1.0}), ("start", 1.0), *[(1.0 + 0.5 * k, 0.5) for k in range(7)]]
    assert Unit.made.shapes == [[("u", 1)], [("y", 2)]]
    assert values(tmp_path) == [[0.0, 1.0], *[[k + 1.0, 1.0 + 0.5 * k] for k in range(7)]]


@pytest.mark.parametrize("at", [1, 3, 4, 7])
def test_an_fmu_that_ends_keeps_what_it_gave(ramp: Task, tmp_path: Path, monkeypatch: Any, at: int) -> None:
    monkeypatch.setattr(Unit, "ends_at", at)
    assert _run(ramp, tmp_path) == (at, "it ends")
    assert [row[0] for row in values(tmp_path)] == list(map(float, range(at)))


def test_an_fmu_that_fails_stops_with_what_it_said(ramp: Task, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(Unit, "fails_at", 2)
    with pytest.raises(Stopped, match=r"^it fails \(log\)$"):
        _run(ramp, tmp_path)


@pytest.mark.parametrize(
    ("error", "stopped"),
    [
        (MemoryError(), "needs more than 4 GB of memory"),
        (Finding("why"), "why"),
        (Stopped("why"), "why"),
        (KeyError("x"), "KeyError: 'x'"),
        (None, None),
    ],
)
def test_the_child_leaves_word_of_every_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception | None, stopped: str | None
) -> None:
    def run(task: Any, folder: Path) -> tuple[int, str]:
        if error is not None:
            raise error
        return 5, "a note"

    import pickle

    monkeypatch.setattr(alone, "_run", run)
    monkeypatch.setattr(alone, "limit_memory", lambda gigabytes: None)
    (tmp_path / "task").write_bytes(pickle.dumps(None))
    main(tmp_path)
    want = {"stopped": stopped, "rows": 0, "note": ""} if error is not None else None
    assert json.loads((tmp_path / "ended.json").read_text()) == (want or {"stopped": None, "rows": 5, "note": "a note"})


# ---- what is shown -------------------------------------------------------------------------------------------------
def test_a_run_in_lines() -> None:
    t = np.array([0.5, 1.0, 1.5])
    done = FmuRun("x.fmu", t, {"y": np.array([1.0, 3.0, 2.0]), "long": np.array([-1.0, 0.25, -2.0])}, "")
    assert done.lines() == [
        "x.fmu: 3 rows, 0.5 to 1.5 s",
        "y     min 1  max 3  end 2",
        "long  min -2  max 0.25  end -2",
    ]
    assert done.summary() == {"file": "x.fmu", "rows": 3, "final": {"y": 2.0, "long": -2.0}, "note": ""}
    assert FmuRun("x.fmu", t, {}, "it ends").lines() == ["x.fmu: 3 rows, 0.5 to 1.5 s; it ends"]
