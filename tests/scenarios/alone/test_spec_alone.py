"""Every number of a scenario file at its limits, every default, and what is refused before anything runs."""

from __future__ import annotations

import dataclasses
import importlib
import math
import pkgutil
from typing import Any

import pydantic
import pytest
from engines import ready

import hystfmu as hy
import hystfmu.scenario
from hystfmu.base.errors import InputError
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


def test_what_a_record_does_not_take() -> None:
    refused: list[tuple[dict[str, Any], str]] = [
        ({"set": {"a.x": 1}}, "it takes neither --set nor --coupling"),
        ({"coupling": "jacobi"}, "it takes neither --set nor --coupling"),
        ({"case": "c"}, "it takes no --case"),
    ]
    for more, said in refused:
        with pytest.raises(InputError, match=said):
            hy.run([], record=True, **more)


def test_values_of_the_package_cannot_be_changed() -> None:
    """All dataclasses are frozen, except Sweeps, whose counters change during a run."""
    found = {}
    for info in pkgutil.walk_packages(hystfmu.scenario.__path__, "hystfmu.scenario."):
        for name, value in vars(importlib.import_module(info.name)).items():
            if dataclasses.is_dataclass(value) and isinstance(value, type) and value.__module__ == info.name:
                found[name] = value.__dataclass_params__.frozen  # type: ignore[attr-defined]
    assert len(found) > 20
    assert [name for name, frozen in found.items() if not frozen] == ["Sweeps"]
