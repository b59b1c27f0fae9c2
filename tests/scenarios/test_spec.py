"""Scenario files: keys, limits of numbers, defaults, delays, paths; what is refused before anything runs."""

import dataclasses
import importlib
import math
import pkgutil
import re
from pathlib import Path
from typing import Any

import pydantic
import pytest
from engines import ready
from invoked import invoked

import hystfmu as hy
import hystfmu.scenario
from hystfmu.base.errors import InputError
from hystfmu.scenario import Cases, build
from hystfmu.scenario.system import case as cases
from hystfmu.scenario.system.case import delayed
from hystfmu.scenario.system.spec import (
    CaseSpec,
    CouplingSpec,
    MarginsSpec,
    MetricSpec,
    ScenarioSpec,
    TubeSpec,
    UnitSpec,
    inside,
)


def broken(data: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    *keys, last = path.split("/")
    at = data
    for key in keys:
        at = at[key]
    if value is KeyError:
        del at[last]
    else:
        at[last] = value
    return data


@pytest.mark.parametrize(("path", "value", "words"), [
    ("step", -1e-4, ["step", "greater than 0", "-0.0001"]),
    ("step", 0.0, ["step", "greater than 0"]),
    ("step", float("nan"), ["step"]),
    ("step", float("inf"), ["step"]),
    ("step", "fast", ["step", "fast"]),
    ("step", KeyError, ["step", "required"]),
    ("stop", 0.03005, ["stop", "multiple of the step"]),
    ("stop", 1e9, ["stop", "at most", "got 1e+13"]),
    ("ripple", 0, ["ripple", "greater than or equal to 1"]),
    ("speed", 3, ["speed", "There is no such key"]),
    ("order", ["plant", "pid"], ["order", "missing: ['reference']"]),
    ("order", ["plant", "reference", "pid", "pid"], ["order", "twice: ['pid']"]),
    ("order", ["plant", "reference", "pid", "ghost"], ["order", "unknown: ['ghost']"]),
    ("connections/plant.w", "pid.u", ["no input 'plant.w'", "['u']"]),
    ("connections/plant.u", "pid.w", ["no output 'pid.w'", "pid.u"]),
    ("connections/plant.u", "ghost.u", ["no output 'ghost.u'", "pid"]),
    ("connections/ghost.u", "pid.u", ["no unit 'ghost'", "plant"]),
    ("connections/plant", "pid.u", ["unit.variable", "'plant'"]),
    ("connections/pid.u_ff", "reference.r", ["pid.u_ff", "and have a constant value"]),
    ("connections/plant.u", KeyError, ["nothing is connected to 'plant.u'"]),
    ("units/pid/inputs", {"v": 1.0}, ["no input 'v'"]),
    ("units/pid/block", "pidd", ["The type of a block must be one", "Got 'pidd' instead"]),
    ("units/pid/values", {"Kq": 1.0}, ["A parameter of pid must be one of", "Got 'Kq' instead"]),
    ("units/pid/values", {"tau": -1.0}, ["tau", "Got -1"]),
    ("units/pid/values", {"Kp": "a"}, ["units.pid: The 'Kp' parameter"]),
    ("units/pid/values", {"Kp": {"a": 1}},
     ["units.pid.values.Kp: The value must be a valid boolean or integer or number or string"]),
    ("units/plant", {"block": "prandtl_ishlinskii", "dims": {"n": 2}, "values": {"r": [0.2, 0.1]}},
     ["units.plant: ", "the thresholds r must not decrease"]),
    ("units/plant", {"block": "prandtl_ishlinskii", "dims": {"n": 2}, "values": {"r": [0.2]}},
     ["units.plant: ", "'r' parameter of prandtl_ishlinskii must have 2 values. Got 1 instead"]),
    ("units/pid/set", {"Kq": 1.0}, ["no parameter 'Kq'"]),
    ("units/pid/set", {"Kp": "*x"}, ["'*' must be followed by a number", "'*x'"]),
    ("units/pid/model", "a.model.toml", ["exactly one of model, block, graph, inverse_of"]),
    ("units/pid", {}, ["exactly one of model"]),
    ("memory", True, ["memory: There is no such key."]),
    ("coupling", {"most_sweeps": 9}, ["coupling.most_sweeps: There is no such key."]),
    ("coupling", {"events": "met"}, ["coupling.events", "'located' or 'grid'", "'met'"]),
    ("units/pid/as", "fmu1", ["as", "fmu1"]),
    ("units/pid/as", "python", ["units.pid.as", "'fmu2' or 'fmu3'", "'python'"]),
    ("units/pid/every", 0, ["every", "0"]),
    ("units/plant", {"model": "../../../secret.model.toml"}, ["must stay within the folder of the scenarios"]),
    ("units/plant", {"model": "/etc/passwd"}, ["relative to the scenario", "/etc/passwd"]),
    ("units/plant", {"model": "C:\\x.model.toml"}, ["relative to the scenario"]),
    ("units/plant", {"model": "gone.model.toml"}, ["gone.model.toml", "No such file"]),
    ("units/plant/graph/wires", [["hysteresis.y", "g1.u"]], ["must be one of", "Got 'g1.u' instead"]),
    ("metrics", {}, ["metrics", "at least 1"]),
    ("metrics/tracking/kind", "mean", ["kind", "'mean'"]),
    ("metrics/tracking/signal", "plant.z", ["metrics.tracking", "no output 'plant.z'"]),
    ("metrics/tracking/after", 0.03, ["metrics.tracking.after", "below stop"]),
    ("metrics/tracking/limit", -1.0, ["limit", "-1"]),
    ("record", ["plant.z"], ["record", "no output 'plant.z'"]),
    ("loops", [["pid.u", "plant.z"]], ["loops", "no output 'plant.z'; there are plant.y, plant.v"]),
    ("case", [{"name": "a"}, {"name": "a"}], ["two cases have the name 'a'"]),
    ("case", [{"name": "a", "set": {"ghost.x": 1}}], ["case a", "no unit 'ghost'"]),
    ("case", [{"name": "a", "limits": {"ghost": 1.0}}], ["case a", "no metric 'ghost'"]),
    ("case", [{"name": "a,b"}], ["case", "a,b"]),
])  # fmt: skip
def test_a_wrong_key_is_named_with_its_value(loop: Any, write: Any, path: str, value: Any, words: list[str]) -> None:
    folder = write(broken(loop, path, value))
    with pytest.raises(InputError) as caught:
        [build(case) for case in Cases(folder).cases]
    message = str(caught.value)
    assert "\n" not in message
    assert str(folder / "scenario.toml") in message or "gone.model.toml" in message
    for word in words:
        assert word in message, message


def test_broken_toml_and_missing_file(tmp_path: Any) -> None:
    (tmp_path / "scenario.toml").write_text("name = \n")
    with pytest.raises(InputError, match=r"scenario\.toml: line 1: The file must be valid TOML"):
        Cases(tmp_path)
    with pytest.raises(InputError, match=r"gone/scenario\.toml: No such file"):
        Cases(tmp_path / "gone")


def test_a_symbolic_link_does_not_lead_out(loop: Any, write: Any, tmp_path: Any) -> None:
    (tmp_path / "secret.model.toml").write_text("format = 1\n")
    loop["units"]["plant"] = {"model": "link.model.toml"}
    folder = write(loop)
    (folder / "link.model.toml").symlink_to(tmp_path / "secret.model.toml")
    with pytest.raises(InputError, match="must stay within the folder of the scenarios"):
        ready(folder)


def test_a_metric_that_needs_a_partner_says_so(loop: Any, write: Any) -> None:
    del loop["metrics"]["tracking"]["against"]
    with pytest.raises(InputError, match=r"metrics\.tracking: .*rms_percent needs 'against'"):
        hy.run([write(loop)], engine="native")
    loop["metrics"]["tracking"] |= {"against": "reference.r", "lines": True}
    loop["ripple"] = 4  # the reference is a staircase, and rows at its turns look like a line
    with pytest.raises(InputError, match=r"tracking\.lines: .* reference has one in every 4 rows: set fine = true"):
        hy.run([write(loop)], engine="native")


def test_overrides_reach_scalars_elements_and_arrays(loop: Any, write: Any) -> None:
    loop["units"]["plant"]["set"] = {"hysteresis_w": "*2", "hysteresis_r_3": 0.4}
    loop["case"] = [{"name": "a"}, {"name": "b", "set": {"plant.hysteresis_w_1": 9.0}}]
    a, b = (build(c) for c in Cases(write(loop), {"plant.hysteresis_w0": "*0.5"}).cases)
    node = a.parts[0].graph.node("hysteresis")
    assert node.value("w").tolist() == [0.6, 0.4, 0.2]
    assert node.value("r").tolist() == [0.1, 0.2, 0.4]
    assert node.value("w0").tolist() == [0.15]
    assert b.parts[0].graph.node("hysteresis").value("w").tolist() == [9.0, 0.4, 0.2]


def test_an_override_that_fits_nothing_is_refused(loop: Any, write: Any) -> None:
    folder = write(loop)
    with pytest.raises(InputError, match=r"--set plant\.ghost: none of the scenarios"):
        hy.run([folder], set={"plant.ghost": 1.0}, engine="native")
    with pytest.raises(InputError, match=r"Did you mean 'plant\.hysteresis_w'"):
        hy.run([folder], set={"plnt.hysteresis_w": 1.0}, engine="native")
    with pytest.raises(InputError, match=r"^--set: must read 'unit\.variable'"):
        hy.run([folder], set={"ghost": 1.0}, engine="native")


def test_an_engine_that_does_not_exist_is_refused_with_those_that_do(loop: Any, write: Any) -> None:
    with pytest.raises(InputError, match=r"^engine: must be one of fmpy, native\. Got 'python' instead\."):
        hy.run([write(loop)], engine="python")  # type: ignore[arg-type]
    result = invoked(["run", str(write(loop)), "--engine", "python"], status=2)
    assert "'python' is not one of 'fmpy', 'native'. See " in result.output.splitlines()[-1]


@pytest.mark.parametrize("below", [False, True])
def test_a_file_of_a_newer_version_names_the_remedy(loop: Any, write: Any, below: bool) -> None:
    path = write({**loop, "format": 2, "key_to_come": 1})
    if below:
        path = write({"extends": "../loop/scenario.toml"}, "child")
    with pytest.raises(InputError, match=r"format: The format must be 1. Got 2 .*: pip install --upgrade"):
        Cases(path)
    write({**loop, "format": 1})
    assert Cases(path).spec.format == 1


# ---- limits and defaults ---------------------------------------------------------------------------------------------
UNIT: dict[str, Any] = {"block": "pid"}
METRIC: dict[str, Any] = {"kind": "peak", "signal": "a.y"}
WHOLE: dict[str, Any] = {
    "name": "s", "step": 0.1, "stop": 1.0, "order": ["a"], "units": {"a": UNIT}, "metrics": {"m": METRIC},
}  # fmt: skip
CORNERS: dict[str, Any] = {"slopes": [1.0, 1.0], "corners": ["*"]}
TINY = 5e-324


def many(n: int, value: Any) -> dict[str, Any]:
    return {f"x{k}": value for k in range(n)}


@pytest.mark.parametrize(("kind", "base", "key", "good", "bad"), [
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
    (MarginsSpec, CORNERS, "stable_to_steps", [0.0, 100.0], [-TINY, 100.0 + 1e-13]),
    (MarginsSpec, {"Ms_db": 1.0}, "slopes", [[0.5, 2.0]], [[1.0], [1.0, 2.0, 3.0], [1.0, math.inf]]),
    (CaseSpec, {"name": "c"}, "stop", [TINY], [0.0, math.inf]),
    (CaseSpec, {"name": "c"}, "after", [0.0], [-TINY]),
    (CaseSpec, {"name": "c"}, "limits", [{"m": 0.0}], [{"m": -TINY}]),
    (CaseSpec, {}, "name", ["c" * 64, "0.a-B_"], ["c" * 65, "", "-a", "a b"]),
    (ScenarioSpec, WHOLE, "step", [TINY], [0.0, math.inf]),
    (ScenarioSpec, WHOLE, "stop", [TINY], [0.0]),
    (ScenarioSpec, WHOLE, "ripple", [1, 1000], [0, 1001]),
    (ScenarioSpec, WHOLE, "order", [["a"], ["a"] * 200], [[], ["a"] * 201]),
    (ScenarioSpec, WHOLE, "guard", [1.0], [1.0 - 1e-15, math.inf]),
    (MarginsSpec, CORNERS, "expected_unstable", [["a"] * 100], [["a"] * 101]),
    (MarginsSpec, {}, "corners", [["*"] * 100, ["a" * 64]], [["*"] * 101, ["a" * 65]]),
    (ScenarioSpec, WHOLE, "tolerance", [0.0, 1.0], [-TINY, 1.0 + 1e-15]),
    (ScenarioSpec, WHOLE, "units", [many(200, UNIT)], [{}, many(201, UNIT)]),
    (ScenarioSpec, WHOLE, "metrics", [many(100, METRIC)], [{}, many(101, METRIC)]),
    (ScenarioSpec, WHOLE, "case", [[{"name": k} for k in many(200, 0)]], [[{"name": k} for k in many(201, 0)]]),
    (ScenarioSpec, WHOLE, "loops", [[["a", "b"]]], [[["a"]], [["a", "b", "c"]]]),
])  # fmt: skip
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
    assert s.tolerance == 1e-6


def test_the_length_of_a_run(loop: Any, write: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cases, "MOST_STEPS", 300)
    ready(write(loop))
    for change, said in [
        ({"stop": 0.0301}, r"stop: at most 300 fine steps; got 301$"),
        ({"ripple": 2}, r"stop: at most 300 fine steps; got 600$"),
        ({"stop": 0.00001}, r"stop: must be a multiple of the step 0\.0001 s; got 1e-05$"),
        ({"stop": 0.01}, r"metrics\.tracking\.after: must be below stop 0\.01 s; got 0\.01$"),
    ]:
        with pytest.raises(InputError, match=said):
            ready(write(loop | change))
    ready(write(loop | {"stop": 0.03 * (1 - 1e-7)}))
    ready(write(loop | {"stop": 0.0101}))


def test_values_of_the_package_cannot_be_changed() -> None:
    """All dataclasses are frozen, except Sweeps, whose counters change during a run."""
    found = {}
    for info in pkgutil.walk_packages(hystfmu.scenario.__path__, "hystfmu.scenario."):
        for name, value in vars(importlib.import_module(info.name)).items():
            if dataclasses.is_dataclass(value) and isinstance(value, type) and value.__module__ == info.name:
                found[name] = value.__dataclass_params__.frozen  # type: ignore[attr-defined]
    assert len(found) > 20
    assert [name for name, frozen in found.items() if not frozen] == ["Sweeps"]


# ---- delays and paths ------------------------------------------------------------------------------------------------
def delay(**more: Any) -> UnitSpec:
    return UnitSpec.model_validate({"block": "delay", "dims": {"n": 3}} | more)


# ---- a number of steps ---------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("steps", "unit", "n", "fine"), [
    (2, {}, 2, False), (2.0, {}, 2, False), (0.75, {}, 3, True), (1.25, {}, 5, True), (1e-7 / 4 + 1, {}, 1, False),
    (5, {"fine": True}, 5, True), (5, {"every": 2}, 5, False), (250_000_000, {}, 250_000_000, False),
])  # fmt: skip
def test_a_fraction_counts_in_fine_steps(steps: float, unit: dict[str, Any], n: int, fine: bool) -> None:
    found = delayed(delay(set={"n": 9, "y0": 0.5}, **unit), steps, 4, "here")
    assert (found.block, found.dims, found.fine, found.set) == ("delay", {"n": n}, fine, {"y0": 0.5})


@pytest.mark.parametrize("unit", [{}, {"fine": True}])
def test_no_step_makes_it_a_connection(unit: dict[str, Any]) -> None:
    for steps in (0, 0.0, 1e-7):
        found = delayed(delay(values={}, set={"n": 9}, **unit), steps, 4, "here")
        assert (found.block, found.dims, found.set, found.fine) == ("scaling", {"n": 1}, {}, bool(unit))


@pytest.mark.parametrize(("steps", "unit", "least"), [
    (-1, {}, 0.25), (0.3, {}, 0.25), (1.0 + 1e-6, {}, 0.25), (1.5, {"fine": True}, 1), (1.5, {"every": 2}, 1),
    ("2", {}, 0.25), (True, {}, 0.25), (250_000_001, {}, 0.25), (float("nan"), {}, 0.25),
])  # fmt: skip
def test_what_is_no_number_of_steps(steps: object, unit: dict[str, Any], least: float) -> None:
    said = f"here: must be a number of steps of at least 0, in steps of {least:g}. Got {steps!r}."
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        delayed(delay(**unit), steps, 4, "here")


# ---- files ---------------------------------------------------------------------------------------------------------


def tree(root: Path) -> Path:
    """Scenarios one/ and group/{two,three}/ among all; a file beside them and one outside."""
    for name in ("all/one", "all/group/two", "all/group/three"):
        (root / name).mkdir(parents=True)
        (root / name / "scenario.toml").touch()
    (root / "all" / "shared").mkdir()
    return root / "all"


def test_a_path_stays_within_the_folder_of_all_scenarios(tmp_path: Path) -> None:
    top = tree(tmp_path)
    assert inside(top / "one", "../shared/m", "w") == (top / "shared" / "m").resolve()
    assert inside(top / "group" / "two", "../../shared/m", "w") == (top / "shared" / "m").resolve()
    assert inside(top / "one", ".", "w", top / "group" / "two") == (top / "one").resolve()
    for folder, path in [("one", "../../out"), ("group/two", "../../../out")]:
        with pytest.raises(InputError, match=r"^w: must stay within the folder of the scenarios; got '\.\./"):
            inside(top / folder, path, "w")
    for path in ("/etc/passwd", "a\\b"):
        with pytest.raises(InputError, match=r"^w: must be a path relative to the scenario, with '/'; got "):
            inside(top / "one", path, "w")
    with pytest.raises(InputError, match=r"^w: .*null.*; got 'a\\x00b'$"):
        inside(top / "one", "a\0b", "w")
