"""A scenario file that is wrong is refused in one line that names file, key, rule and value, before anything runs."""

from __future__ import annotations

from typing import Any

import pytest
from click.testing import CliRunner
from engines import ready

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.scenario import Cases, build


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


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("step", -1e-4, ["step", "greater than 0", "-0.0001"]),
        ("step", 0.0, ["step", "greater than 0"]),
        ("step", float("nan"), ["step"]),
        ("step", float("inf"), ["step"]),
        ("step", "fast", ["step", "fast"]),
        ("step", KeyError, ["step", "required"]),
        ("stop", 0.03005, ["stop", "multiple of the step"]),
        ("stop", 1e9, ["stop", "at most"]),
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
        ("connections/pid.u_ff", "reference.r", ["pid.u_ff", "constant value as well"]),
        ("connections/plant.u", KeyError, ["nothing is connected to 'plant.u'"]),
        ("units/pid/inputs", {"v": 1.0}, ["no input 'v'"]),
        ("units/pid/block", "pidd", ["The type of a block must be one", "Got 'pidd' instead"]),
        ("units/pid/values", {"Kq": 1.0}, ["A parameter of pid must be one of", "Got 'Kq' instead"]),
        ("units/pid/values", {"tau": -1.0}, ["tau", "Got -1"]),
        ("units/pid/set", {"Kq": 1.0}, ["no parameter 'Kq'"]),
        ("units/pid/set", {"Kp": "*x"}, ["after '*' stands a number", "'*x'"]),
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
    ],
)
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
    result = CliRunner().invoke(main, ["run", str(write(loop)), "--engine", "python"])
    assert result.exit_code == 2
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


def test_a_misspelt_key_is_named_and_not_the_one_that_it_leaves_out(loop: Any, write: Any) -> None:
    loop["stopp"] = loop.pop("stop")
    with pytest.raises(InputError, match=r"scenario\.toml: stopp: There is no such key. Did you mean 'stop'"):
        hy.run([write(loop)], engine="native")
