"""`extends`: what a scenario takes from another file, and one line that names file and key where that fails."""

from pathlib import Path
from typing import Any

import pytest

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.model import Model
from hystfmu.scenario import Cases, build
from hystfmu.scenario.system.spec import MOST_FILES

ROOT = Path(__file__).parents[2] / "scenarios"
BASE = "../loop/scenario.toml"


def child(write: Any, folder: str = "child", **more: Any) -> Cases:
    """A scenario beside `loop` that extends it."""
    return Cases(write({"extends": BASE, **more}, folder))


def test_tables_merge_by_key_and_everything_else_replaces(loop: Any, write: Any) -> None:
    write(loop)
    spec = child(
        write,
        step=2e-4,
        record=["pid.u"],
        units={"pid": {"values": {"Kp": 3.0}}},
        metrics={"tracking": {"limit": 1.0}, "last": {"kind": "final", "signal": "plant.y"}},
        connections={"pid.u_ff": "reference.r"},
    ).spec
    assert (spec.step, spec.stop, spec.record) == (2e-4, loop["stop"], ["pid.u"])
    assert spec.units["pid"].values == {"Kp": 3.0, "Ki": 2000.0, "Kd": 2e-4}
    assert spec.units["plant"] == Cases(write(loop)).spec.units["plant"]
    assert (spec.metrics["tracking"].limit, spec.metrics["tracking"].stroke) == (1.0, 2.0)
    assert list(spec.metrics) == ["tracking", "last"]
    assert spec.connections == loop["connections"] | {"pid.u_ff": "reference.r"}


def test_a_unit_that_names_its_source_replaces_the_other_as_a_whole(loop: Any, write: Any) -> None:
    write(loop)
    unit = child(write, units={"pid": {"block": "lead_lag", "dims": {"n": 2}}}).spec.units["pid"]
    assert (unit.block, unit.dims, unit.values, unit.inputs) == ("lead_lag", {"n": 2}, {}, {})


def test_a_case_states_what_differs_from_the_one_of_its_name(loop: Any, write: Any) -> None:
    loop["case"] = [
        {"name": "a", "stop": 0.02, "set": {"pid.Kp": 2.0, "pid.Ki": 1.0}, "limits": {"tracking": 5.0}},
        {"name": "b", "stop": 0.04},
        {"name": "c"},
    ]
    write(loop)
    assert [c.name for c in child(write).cases] == ["a", "b", "c"]
    chosen = child(write, case=[{"name": "new"}, {"name": "b"}, {"name": "a", "set": {"pid.Kp": 3.0}}]).cases
    assert [(c.name, c.stop) for c in chosen] == [("new", 0.03), ("b", 0.04), ("a", 0.02)]
    assert chosen[2].units["pid"].set == {"Kp": 3.0, "Ki": 1.0}
    assert chosen[2].metrics["tracking"].limit == 5.0


def test_a_pattern_stands_for_the_cases_of_the_other_file_that_run(loop: Any, write: Any) -> None:
    write(loop | {"case": [{"name": n} for n in ("b", "a_2", "a_1", "c")]})
    write({"extends": BASE, "case": [{"name": "a_?"}, {"name": "c", "stop": 0.02}]}, "middle")
    below = "../middle/scenario.toml"
    for case, names in (
        ([{"name": "*"}], ["a_2", "a_1", "c"]),
        ([{"name": "c"}, {"name": "*", "stop": 0.025}], ["c", "a_2", "a_1"]),
        ([{"name": "*_1"}, {"name": "a_*"}, {"name": "b"}], ["a_1", "a_2", "b"]),
    ):
        found = child(write, extends=below, case=case).cases
        assert [c.name for c in found] == names
        assert {c.name: c.stop for c in found if c.name.startswith("a")} == dict.fromkeys(
            ("a_1", "a_2"), 0.025 if "stop" in case[-1] else 0.03
        )
    with pytest.raises(InputError, match=r"child/scenario\.toml: case b\*: the file that it extends has no case"):
        child(write, extends=below, case=[{"name": "b*"}])
    with pytest.raises(InputError, match=r"case\.0\.name"):
        Cases(write(loop | {"case": [{"name": "*"}]}))


def test_cases_add_up_along_a_chain_and_the_nearest_list_chooses(loop: Any, write: Any) -> None:
    write(loop | {"case": [{"name": "a", "stop": 0.02}]})
    write({"extends": BASE, "case": [{"name": "b", "stop": 0.04}]}, "middle")
    cases = child(write, extends="../middle/scenario.toml", case=[{"name": "a"}, {"name": "b"}]).cases
    assert [(c.name, c.stop) for c in cases] == [("a", 0.02), ("b", 0.04)]
    other = Cases(write({"extends": "../middle/scenario.toml"}, "other"))
    assert [c.name for c in other.cases] == ["b"]


def test_paths_are_relative_to_the_file_that_states_them(loop: Any, write: Any, tmp_path: Path) -> None:
    model = ROOT / "models" / "backlash_plant.model.toml"
    path = tmp_path / "scenarios" / "parts" / "here" / "x.model.toml"
    path.parent.mkdir(parents=True)
    path.write_bytes(model.read_bytes())
    case = {"name": "a", "units": {"plant": {"model": "x.model.toml"}}, "connections": {"plant.d": "plant.y"}}
    below = loop | {"conditions": {"x": {k: case[k] for k in ("units", "connections")}}}
    for taken in (case, {"name": "a", "conditions": ["x"]}):
        write(below | {"case": [taken]}, "parts/here")
        (system,) = map(build, child(write, extends="../parts/here/scenario.toml").cases)
        assert system.parts[0].own.to_bytes() == Model.load(model).graph.to_bytes()


def test_a_case_takes_conditions_later_ones_and_its_own_on_top(loop: Any, write: Any) -> None:
    late = {"block": "delay", "dims": {"n": 2}}
    loop["conditions"] = {
        "slow": {"text": "slow", "stop": 0.05, "after": 0.02, "set": {"reference.frequency": 20.0, "pid.Kp": 2.0}},
        "late": {"text": "late", "units": {"late": late}, "connections": {"late.u": "pid.u", "plant.u": "late.y"}},
        "asked": {"limits": {"tracking": 3.0}, "set": {"pid.Kp": 3.0}},
    }
    loop["case"] = [{"name": "a", "conditions": ["slow", "late", "asked"], "after": 0.0, "set": {"pid.Ki": 1.0}}]
    spelt = {
        "name": "a", "text": "slow, late", "stop": 0.05, "after": 0.0, "units": {"late": late},
        "set": {"reference.frequency": 20.0, "pid.Kp": 3.0, "pid.Ki": 1.0}, "limits": {"tracking": 3.0},
        "connections": {"late.u": "pid.u", "plant.u": "late.y"},
    }  # fmt: skip
    made = Cases(write(loop)).spec
    assert made == Cases(write({k: v for k, v in loop.items() if k != "conditions"} | {"case": [spelt]}, "spelt")).spec
    changed = child(write, conditions={"asked": {"limits": {"tracking": 4.0}}}).cases[0]
    assert (changed.metrics["tracking"].limit, changed.units["pid"].set["Kp"]) == (4.0, 3.0)


def test_units_that_a_case_adds_step_last_unless_it_states_an_order(loop: Any, write: Any) -> None:
    late = {"late": {"block": "delay"}}
    wires = {"late.u": "pid.u", "plant.u": "late.y"}
    loop["case"] = [
        {"name": "a", "units": late, "connections": wires},
        {"name": "b", "units": late, "connections": wires, "order": ["late", *loop["order"]]},
    ]
    a, b = (build(c) for c in Cases(write(loop)).cases)
    assert [p.name for p in a.parts] == [*loop["order"], "late"]
    assert [p.name for p in b.parts] == ["late", *loop["order"]]


@pytest.mark.parametrize(("own", "words"), [
    ({"extends": 3}, ["child/scenario.toml: extends: must be the path", "3"]),
    ({"extends": "../../x.toml"}, ["child/scenario.toml: extends: must stay within the folder of the scenarios"]),
    ({"extends": "/etc/passwd"}, ["child/scenario.toml: extends: must be a path relative", "/etc/passwd"]),
    ({"extends": "a\0b"}, ["child/scenario.toml: extends:", "printable characters"]),
    ({"extends": "gone.toml"}, ["child/scenario.toml: extends: ", "gone.toml: No such file"]),
    ({"extends": "."}, ["child/scenario.toml: extends: ", "Got a folder"]),
    ({"extends": "scenario.toml"}, ["child/scenario.toml: extends: returns to 'scenario.toml'"]),
    ({"stop": -1.0}, ["child/scenario.toml: stop: ", "greater than 0"]),
    ({"units": {"pid": {"values": {"Kp": {}}}}}, ["child/scenario.toml: units.pid.values.Kp"]),
    ({"metrics": {"tracking": {"stroke": -2.0}}}, ["child/scenario.toml: metrics.tracking.stroke"]),
    ({"case": [{"name": "b", "stop": -1.0}]}, ["child/scenario.toml: case.0.stop"]),
    ({"case": [{"name": "z", "text": "x"}]}, ["loop/scenario.toml: case.0.after"]),
    ({"case": [{"text": "x"}]}, ["child/scenario.toml: case.0.name: The key is required."]),
    ({"case": 3}, ["child/scenario.toml: case: ", "list"]),
    ({"units": 3}, ["child/scenario.toml: units: ", "dict"]),
    ({"case": [{"name": "a", "conditions": ["fast"]}]}, ["case a: conditions: no condition 'fast'", "'slow'"]),
    ({"case": [{"name": "a", "conditions": "slow"}]}, ["case.0.conditions", "list"]),
    ({"conditions": {"slow": {"stop": -1.0}}}, ["conditions.slow.stop", "greater than 0"]),
    ({"conditions": {"slow": {"conditions": ["slow"]}}}, ["conditions.slow.conditions: There is no such key"]),
    ({"conditions": {"slow": {"limits": {"ghost": 1.0}}}, "case": [{"name": "a"}]},
     ["case a: limits: no metric 'ghost'"]),
    ({"conditions": 3}, ["conditions: ", "dict"]),
])  # fmt: skip
def test_an_error_names_the_file_and_its_key(loop: Any, write: Any, own: Any, words: list[str]) -> None:
    cases = [{"name": "z", "after": -1.0}, {"name": "a", "conditions": ["slow"]}]
    write(loop | {"case": cases, "conditions": {"slow": {"stop": 0.05}}})
    with pytest.raises(InputError) as caught:
        child(write, **own)
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message


def test_an_error_below_names_the_file_below(loop: Any, write: Any) -> None:
    folder = write(loop | {"stopp": 3.0})
    with pytest.raises(InputError, match=r"loop/scenario\.toml: stopp: There is no such key"):
        child(write)
    (folder / "scenario.toml").write_text("x = ")
    with pytest.raises(
        InputError, match=r"child/scenario\.toml: extends: .*loop/scenario\.toml: The file must be valid TOML"
    ):
        child(write)
    write(loop | {"case": [{"name": "a"}, {"name": "a"}]})
    with pytest.raises(InputError, match=r"two cases have the name 'a'"):
        child(write)


def test_of_several_files_the_last_one_wins_with_all_that_it_extends(loop: Any, write: Any) -> None:
    write(loop)
    write({"extends": BASE, "name": "first", "step": 2e-4, "record": ["pid.u"]}, "first")
    write({"units": {"pid": {"values": {"Kp": 3.0}}}, "step": 1e-3}, "under")
    write({"extends": "../under/scenario.toml", "name": "second", "case": [{"name": "new"}]}, "second")
    files = ["../first/scenario.toml", "../second/scenario.toml"]
    spec = child(write, extends=files).spec
    assert (spec.name, spec.step, spec.record, [c.name for c in spec.case]) == ("second", 1e-3, ["pid.u"], ["new"])
    assert spec.units["pid"].values == {"Kp": 3.0, "Ki": 2000.0, "Kd": 2e-4}
    for wrong, words in (([files[0], 3], "or a list of them"), ([files[0], files[0]], "returns to")):
        with pytest.raises(InputError, match=words):
            child(write, extends=wrong)


def test_a_chain_is_not_longer_than_it_may_be(loop: Any, write: Any) -> None:
    write(loop, "link_1")
    for k in range(2, MOST_FILES + 2):
        write({"extends": f"../link_{k - 1}/scenario.toml"}, f"link_{k}")
    assert Cases(write({}, "x").parent / f"link_{MOST_FILES}").spec.name == "loop"
    with pytest.raises(InputError, match=f"at most {MOST_FILES} files"):
        Cases(write({"extends": f"../link_{MOST_FILES}/scenario.toml"}, "link_9"))


def test_a_group_among_scenarios_uses_their_files(loop: Any, write: Any) -> None:
    write(loop)
    below = write({"extends": "../../loop/scenario.toml"}, "group/child")
    assert Cases(below).spec.name == "loop"
    with pytest.raises(InputError, match="must stay within the folder of the scenarios"):
        Cases(write({"extends": "../../../x.toml"}, "group/child"))


@pytest.mark.parametrize("beside", ["group", "loop/deeper"])
def test_a_folder_is_no_group_without_scenarios_beside_it(loop: Any, write: Any, tmp_path: Path, beside: str) -> None:
    """A scenario file in the group itself, or one further below a neighbour, does not widen what may be read."""
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "secret.toml").write_text("name = 'secret'\n")
    write(loop, beside)
    with pytest.raises(InputError, match="must stay within the folder of the scenarios"):
        Cases(write({"extends": "../../secret.toml"}, "group/child"))


def test_a_folder_of_scenarios_runs_them_all(loop: Any, write: Any) -> None:
    folder = write(loop, "group/b").parent
    write(loop | {"name": "first"}, "group/a")
    assert [r.scenario for r in hy.run([folder], engine="native")] == ["first", "loop"]
    (folder / "a" / "scenario.toml").unlink()
    (folder / "b" / "scenario.toml").unlink()
    with pytest.raises(InputError, match=r"group/scenario\.toml"):
        hy.run([folder])


def test_deep_tables_are_refused(loop: Any, write: Any) -> None:
    deep = "units" + ".a" * 5000 + " = 1\n"
    for folder in ("loop", "child"):
        path = write(loop, folder) / "scenario.toml"
        path.write_text((f'extends = "{BASE}"\n' if folder == "child" else "") + deep)
    with pytest.raises(InputError, match="nested too deep"):
        Cases(path)
