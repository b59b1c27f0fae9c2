"""Every number of a scenario file at its limits, every default, and who passes on that foreign code is confined."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pydantic
import pytest
from engines import ready

from hystfmu.base.errors import InputError
from hystfmu.scenario import run_case, run_fmu
from hystfmu.scenario.engine import alone, isolated, simulation
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.ssp import run as ssp_run
from hystfmu.scenario.system import case as cases
from hystfmu.scenario.system.spec import (
    CaseSpec,
    CouplingSpec,
    MarginsSpec,
    MetricSpec,
    ScenarioSpec,
    TubeSpec,
    UnitSpec,
)

run_scenarios = importlib.import_module("hystfmu.scenario.run_scenarios")  # the package has a function of that name
UNIT: dict[str, Any] = {"block": "pid"}
METRIC: dict[str, Any] = {"kind": "peak", "signal": "a.y"}
WHOLE: dict[str, Any] = {
    "name": "s", "step": 0.1, "stop": 1.0, "order": ["a"], "units": {"a": UNIT}, "metrics": {"m": METRIC},
}  # fmt: skip
TINY = 5e-324


def many(n: int, what: Any) -> dict[str, Any]:
    return {f"x{k}": what for k in range(n)}


def named(n: int) -> list[dict[str, str]]:
    return [{"name": f"c{k}"} for k in range(n)]


@pytest.mark.parametrize(
    ("kind", "base", "key", "good", "bad"),
    [
        (UnitSpec, UNIT, "every", [1, 1_000_000], [0, 1_000_001]),
        (UnitSpec, UNIT, "substeps", [1, 10_000], [0, 10_001]),
        (MetricSpec, METRIC, "after", [0.0, 1e300], [-TINY, math.inf, math.nan]),
        (MetricSpec, METRIC, "limit", [0.0, 1e300], [-TINY, math.inf]),
        (MetricSpec, METRIC, "stroke", [TINY], [0.0, -1.0, math.inf]),
        (CouplingSpec, {}, "max_sweeps", [2, 10_000], [1, 10_001]),
        (CouplingSpec, {}, "tolerance", [TINY, 1.0], [0.0, math.inf]),
        (TubeSpec, {"value": 0.5}, "time", [0.0], [-TINY, math.inf]),
        (TubeSpec, {}, "value", [0.0, 1.0], [-TINY, 1.0 + 1e-15]),
        (MarginsSpec, {}, "Ms_db", [TINY, 60.0], [0.0, 60.0 + 1e-13]),
        (
            MarginsSpec,
            {"slopes": [1.0, 1.0], "corners": ["*"]},
            "stable_to_steps",
            [0.0, 100.0],
            [-TINY, 100.0 + 1e-13],
        ),
        (MarginsSpec, {"Ms_db": 1.0}, "slopes", [[0.5, 2.0]], [[1.0], [1.0, 2.0, 3.0], [1.0, math.inf]]),
        (CaseSpec, {"name": "c"}, "stop", [TINY], [0.0, math.inf]),
        (CaseSpec, {"name": "c"}, "after", [0.0], [-TINY]),
        (CaseSpec, {"name": "c"}, "limits", [{"m": 0.0}], [{"m": -TINY}]),
        (CaseSpec, {}, "name", ["c" * 64, "0.a-B_"], ["c" * 65, "", "-a", "a b"]),
        (ScenarioSpec, WHOLE, "step", [TINY], [0.0, math.inf]),
        (ScenarioSpec, WHOLE, "stop", [TINY], [0.0]),
        (ScenarioSpec, WHOLE, "ripple", [1, 1000], [0, 1001]),
        (ScenarioSpec, WHOLE, "tolerance", [0.0, 1.0], [-TINY, 1.0 + 1e-15]),
        (
            ScenarioSpec,
            WHOLE,
            "units",
            [{f"u{k}": UNIT for k in range(200)}],
            [{}, {f"u{k}": UNIT for k in range(201)}],
        ),
        (
            ScenarioSpec,
            WHOLE,
            "metrics",
            [{f"m{k}": METRIC for k in range(100)}],
            [{}, {f"m{k}": METRIC for k in range(101)}],
        ),
        (
            ScenarioSpec,
            WHOLE,
            "case",
            [[{"name": f"c{k}"} for k in range(200)]],
            [[{"name": f"c{k}"} for k in range(201)]],
        ),
        (ScenarioSpec, WHOLE, "loops", [[["a", "b"]]], [[["a"]], [["a", "b", "c"]]]),
    ],
)
def test_a_value_at_its_limits(kind: Any, base: dict[str, Any], key: str, good: list[Any], bad: list[Any]) -> None:
    for value in good:
        kind.model_validate(base | {key: value})
    for value in bad:
        with pytest.raises(pydantic.ValidationError):
            kind.model_validate(base | {key: value})


def test_what_a_file_leaves_away() -> None:
    s = ScenarioSpec.model_validate(WHOLE | {"case": [{"name": "c"}]})
    unit, metric, coupling, case = s.units["a"], s.metrics["m"], s.coupling, s.case[0]
    assert (unit.every, unit.fine, unit.substeps, unit.hold, unit.runs_as) == (1, False, 1, "zero", "fmu2")
    assert (metric.after, metric.limit, metric.stroke, metric.lines, metric.against) == (0.0, None, None, False, None)
    assert (coupling.scheme, coupling.events, coupling.tolerance, coupling.max_sweeps) == (
        "gauss_seidel", "located", 1e-12, 50,
    )  # fmt: skip
    assert (case.stop, case.after, case.coupling, case.set, case.conditions) == (None, None, None, {}, [])
    assert (s.ripple, s.final_states, s.tube, s.record, s.loops, s.margins) == (1, False, None, [], [], None)
    assert TubeSpec.model_validate({"value": 0.5}).time == 0.0
    assert 0 < s.tolerance < 1e-3


def test_the_length_of_a_run(loop: Any, write: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cases, "MOST_STEPS", 300)
    ready(write(loop))
    for change, said in [
        ({"stop": 0.0301}, r"stop: at most 300 fine steps; got 301$"),
        ({"ripple": 2}, r"stop: at most 300 fine steps; got 600$"),
        ({"stop": 0.03005}, r"stop: must be a multiple of the step 0\.0001 s; got 0\.03005$"),
        ({"stop": 0.00001}, r"stop: must be a multiple of the step 0\.0001 s; got 1e-05$"),
        ({"stop": 0.01}, r"metrics\.tracking\.after: must be below stop 0\.01 s; got 0\.01$"),
        ({"order": ["plant", "reference"]}, r"order: must name every unit once; missing: \['pid'\], unknown: \[\]$"),
        ({"order": ["plant", "reference", "pid", "x"]}, r"once; missing: \[\], unknown: \['x'\]$"),
        ({"order": ["plant", "pid", "reference", "pid"]}, r"order: must name every unit once; twice: \['pid'\]$"),
    ]:
        with pytest.raises(InputError, match=said):
            ready(write(loop | change))
    ready(write(loop | {"stop": 0.03 * (1 - 1e-7)}))
    ready(write(loop | {"stop": 0.0101}))


# ---- foreign code is confined unless told otherwise ----------------------------------------------------------------
def told(monkeypatch: pytest.MonkeyPatch, place: Any, name: str, answer: Any = None) -> list[Any]:
    """Replace a function by one that writes down its arguments."""
    seen: list[Any] = []

    def instead(*a: Any, **more: Any) -> Any:
        seen.append((a, more))
        if isinstance(answer, Exception):
            raise answer
        return answer

    monkeypatch.setattr(place, name, instead)
    return seen


def test_a_run_hands_on_its_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = told(monkeypatch, isolated, "chunks_isolated", iter(()))
    system: Any = SimpleNamespace(foreign=(1,), n_steps=0)
    for more, want in [({}, (600.0, True)), ({"seconds": 5.0, "confined": False}, (5.0, False))]:
        simulation.chunks(system, **more)
        (_, _, seconds), kept = seen.pop()
        assert (seconds, kept["confined"]) == want
    trace = Trace(np.zeros(1), np.zeros((1, 1)), {"a.y": 0}, 1)
    seen = told(monkeypatch, simulation, "chunks", [trace])
    assert simulation.simulate(system) is trace
    assert seen.pop()[0][1:] == ("fmpy", None, 600.0, True)
    simulation.simulate(system, "native", None, 1.0, False)
    assert seen.pop()[0][1:] == ("native", None, 1.0, False)


def test_a_case_hands_on_its_limits(monkeypatch: pytest.MonkeyPatch, loop: Any, write: Any) -> None:
    system = ready(write(loop))
    seen = told(monkeypatch, run_case, "chunks", Stopped("why"))
    result, record = run_case.run_case(system, None, "native", None)  # type: ignore[arg-type]
    assert (result.lines, record, result.trace) == (("loop/nominal: stopped: why",), None, None)
    assert seen.pop()[0][3:] == (600.0, True)
    run_case.run_case(system, None, "native", None, seconds=2.0, confined=False)  # type: ignore[arg-type]
    assert seen.pop()[0][3:] == (2.0, False)
    seen = told(monkeypatch, run_scenarios, "run_case", (result, None))
    monkeypatch.setattr(run_scenarios, "loop_figures", lambda system: None)
    run_scenarios.run_scenarios([write(loop)])
    _, kept = seen.pop()
    assert (kept["seconds"], kept["confined"], kept["out"]) == (600.0, True, None)
    run_scenarios.run_scenarios([write(loop)], seconds=3.0, confined=False)
    assert (seen[-1][1]["seconds"], seen[-1][1]["confined"]) == (3.0, False)


def test_an_fmu_alone_hands_on_its_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    foreign = SimpleNamespace(ports=(), folder=Path("."))
    monkeypatch.setattr(run_fmu, "Foreign", SimpleNamespace(load=lambda path: foreign))
    monkeypatch.setattr(run_fmu, "_task", lambda *a: "task")
    seen = told(monkeypatch, run_fmu, "run_alone", (np.zeros(1), np.zeros((1, 0)), ""))
    run_fmu.run_fmu("x.fmu")
    assert seen.pop()[0] == ("task", 600.0, True)
    run_fmu.run_fmu("x.fmu", seconds=4.0, confined=False)
    assert seen.pop()[0] == ("task", 4.0, False)
    boxes: list[Any] = []

    class Child:
        def __init__(self, *a: Any, box: Any) -> None:
            boxes.append(box)

        def finish(self, seconds: float) -> tuple[list[str], bool]:
            return [], False

    monkeypatch.setattr(alone, "Child", Child)
    for more in ({}, {"confined": False}):
        with pytest.raises(Stopped) as e:
            alone.run_alone(SimpleNamespace(foreign=foreign), 1.0, **more)  # type: ignore[arg-type]
        assert e.value.status == "timeout"
    assert [box is None for box in boxes] == [False, True]


def test_an_archive_hands_on_its_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    case = SimpleNamespace(overrides={})
    monkeypatch.setattr(ssp_run, "_prepared", lambda *a: (SimpleNamespace(signals=()), case, None))
    system = SimpleNamespace(columns={"a.y": 0}, n_steps=0)
    monkeypatch.setattr(ssp_run, "build", lambda case: system)
    seen = told(monkeypatch, ssp_run, "simulate", "trace")
    assert ssp_run.run_ssp("x") == ssp_run.SspRun("trace", (), ())  # type: ignore[arg-type]
    assert seen.pop()[1] == {"seconds": 600.0, "confined": True}
    seen = told(monkeypatch, ssp_run, "chunks", Stopped("why"))
    assert ssp_run.run_ssp_file("x", "native", None, None, None, 5.0, None).faults == ("x: stopped: why",)
    assert seen.pop()[1] == {"seconds": 5.0, "confined": True}
    trace = Trace(np.zeros(1), np.ones((1, 1)), {"a.y": 0}, 1)
    told(monkeypatch, ssp_run, "chunks", [trace])
    said = "x: 1 rows of 1 outputs; no reference to compare with"
    done = ssp_run.run_ssp_file("x", "native", None, None, None, 5.0, None)
    assert (done.lines(), done.passed) == ([said], True)
