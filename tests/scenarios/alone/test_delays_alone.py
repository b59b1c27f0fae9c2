"""Delays as settings and in the budget; files inside the folder of the scenarios."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from engines import ready

from hystfmu.base.errors import InputError
from hystfmu.scenario.report.loops import Delay, delay_budget
from hystfmu.scenario.system.case import delayed, sizes
from hystfmu.scenario.system.spec import UnitSpec, inside, is_relative, scenario_folders


def delay(**more: Any) -> UnitSpec:
    return UnitSpec.model_validate({"block": "delay", "dims": {"n": 3}} | more)


# ---- a number of steps ---------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("steps", "unit", "n", "fine"),
    [
        (2, {}, 2, False),
        (2.0, {}, 2, False),
        (0.75, {}, 3, True),
        (1.25, {}, 5, True),
        (1e-7 / 4 + 1, {}, 1, False),
        (5, {"fine": True}, 5, True),
        (5, {"every": 2}, 5, False),
        (250_000_000, {}, 250_000_000, False),
    ],
)
def test_a_fraction_counts_in_fine_steps(steps: float, unit: dict[str, Any], n: int, fine: bool) -> None:
    found = delayed(delay(set={"n": 9, "y0": 0.5}, **unit), steps, 4, "here")
    assert (found.block, found.dims, found.fine, found.set) == ("delay", {"n": n}, fine, {"y0": 0.5})


@pytest.mark.parametrize("unit", [{}, {"fine": True}])
def test_no_step_makes_it_a_connection(unit: dict[str, Any]) -> None:
    for steps in (0, 0.0, 1e-7):
        found = delayed(delay(values={}, set={"n": 9}, **unit), steps, 4, "here")
        assert (found.block, found.dims, found.set, found.fine) == ("scaling", {"n": 1}, {}, bool(unit))


@pytest.mark.parametrize(
    ("steps", "unit", "least"),
    [
        (-1, {}, 0.25),
        (0.3, {}, 0.25),
        (1.0 + 1e-6, {}, 0.25),
        (1.5, {"fine": True}, 1),
        (1.5, {"every": 2}, 1),
        ("2", {}, 0.25),
        (True, {}, 0.25),
        (250_000_001, {}, 0.25),
        (float("nan"), {}, 0.25),
    ],
)
def test_what_is_no_number_of_steps(steps: object, unit: dict[str, Any], least: float) -> None:
    said = f"here: must be a number of steps of at least 0, in steps of {least:g}. Got {steps!r}."
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        delayed(delay(**unit), steps, 4, "here")


def test_only_delays_have_such_a_setting(loop: Any, write: Any) -> None:
    loop["units"]["late"] = {"block": "delay", "dims": {"n": 2}}
    loop["order"].append("late")
    loop["connections"]["late.u"] = "plant.v"
    system = ready(write(loop))
    assert sizes(system.case) == {"late.n"}
    assert "late.n" in system.parameters


# ---- the budget ----------------------------------------------------------------------------------------------------
def test_every_late_value_is_in_the_budget(loop: Any, write: Any) -> None:
    """Plant, reference, PID in this order: only the command is read before it is made, by a plant with dynamics."""
    assert delay_budget(ready(write(loop))) == [
        Delay("pid.u -> plant.u", 0.5, "held between samples: half a step on average")
    ]
    loop["order"] = ["pid", "reference", "plant"]
    late = "one step of its source late: the reader stands earlier in the order"
    assert delay_budget(ready(write(loop))) == [
        Delay("reference.r -> pid.y_d", 1.0, late),
        Delay("plant.y -> pid.y", 1.0, late),
    ]
    loop["coupling"] = {"scheme": "iterative"}
    assert delay_budget(ready(write(loop))) == []
    loop["coupling"] = {"scheme": "jacobi"}
    assert [(d.where, d.steps) for d in delay_budget(ready(write(loop)))] == [
        ("reference.r -> pid.y_d", 1.0),
        ("plant.y -> pid.y", 1.0),
        ("pid.u -> plant.u", 0.5),
    ]
    loop["order"] = ["plant", "reference", "pid"]
    texts = {d.where: d.text for d in delay_budget(ready(write(loop)))}
    assert texts["plant.y -> pid.y"] == "one step of its source late: all units read first"


def test_fine_units_and_straight_lines_in_the_budget(loop: Any, write: Any) -> None:
    loop["ripple"] = 4
    loop["units"]["plant"]["fine"] = True
    loop["units"]["late"] = {"block": "delay", "dims": {"n": 6}, "fine": True}
    loop["order"] = ["plant", "late", "reference", "pid"]
    loop["connections"] |= {"late.u": "pid.u", "plant.u": "late.y"}
    assert [(d.where, d.steps, d.text) for d in delay_budget(ready(write(loop)))] == [
        ("late.y -> plant.u", 0.125, "held between samples: half a step on average"),
        ("pid.u -> late.u", 0.5, "held between samples: half a step on average"),
        ("late", 1.5, "delay block of 6 steps of the unit"),
    ]
    loop["ripple"] = 1
    del loop["units"]["plant"]["fine"], loop["units"]["late"]["fine"]
    loop["units"]["plant"]["hold"] = "first"
    (line,) = [d for d in delay_budget(ready(write(loop))) if d.where == "late.y -> plant.u"]
    assert line.steps == 0
    assert "straight line" in line.text


# ---- files ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("path", "good"), [("a/b", True), ("../a", True), ("/a", False), ("a\\b", False), ("C:a", False)]
)
def test_relative_paths(path: str, good: bool) -> None:
    assert is_relative(path) == good


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


def test_a_folder_of_single_scenarios_is_no_group(tmp_path: Path) -> None:
    (tmp_path / "some" / "one").mkdir(parents=True)
    (tmp_path / "some" / "one" / "scenario.toml").touch()
    with pytest.raises(InputError, match="must stay within"):
        inside(tmp_path / "some" / "one", "../../out", "w")
    assert inside(tmp_path / "some" / "one", "../m", "w") == (tmp_path / "some" / "m").resolve()


def test_a_scenario_that_holds_scenarios(tmp_path: Path) -> None:
    """Its parent then is the folder of all: a file there counts as inside."""
    (tmp_path / "base" / "variant").mkdir(parents=True)
    for name in ("base", "base/variant"):
        (tmp_path / name / "scenario.toml").touch()
    assert inside(tmp_path / "base" / "variant", "../m", "w") == (tmp_path / "base" / "m").resolve()
    with pytest.raises(InputError, match="must stay within"):
        inside(tmp_path / "base" / "variant", "../../m", "w")


def test_folders_of_a_group_are_sorted(tmp_path: Path) -> None:
    top = tree(tmp_path)
    assert scenario_folders(top / "one") == [top / "one"]
    assert scenario_folders(top / "group") == [top / "group" / "three", top / "group" / "two"]
    assert scenario_folders(top / "shared") == [top / "shared"]
    assert scenario_folders(top / "none.toml") == [top / "none.toml"]
