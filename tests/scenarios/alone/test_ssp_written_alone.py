"""Files of a loop for other simulators, element by element: archives, containers, joined units, pictures of a case."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from engines import ready

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome import plots
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.ssp import run as ssp_run
from hystfmu.scenario.ssp.container import _bits, _check, _description, _list, _string, _system, _told, _unit
from hystfmu.scenario.ssp.joined import joined
from hystfmu.scenario.ssp.parameter_set import parameter_set
from hystfmu.scenario.ssp.write import SSC, SSD, _experiment, _reference, _structure, _with_starts, write_ssp
from hystfmu.scenario.system.spec import MetricSpec
from hystfmu.scenario.system.system import System, build


@pytest.fixture
def system(loop: Any, write: Any) -> System:
    loop["units"]["plant"]["graph"]["outputs"][0]["unit"] = "um"
    return ready(write(loop))


def tags(root: ET.Element, space: str, name: str) -> list[dict[str, str]]:
    return [dict(e.attrib) for e in root.iter(f"{{{space}}}{name}")]


# ---- the structure -------------------------------------------------------------------------------------------------
def test_components_connectors_and_connections(system: System) -> None:
    root = ET.fromstring(_structure(system, {"plant": {"p": 1.0}}, "1.0", False))
    assert (root.get("name"), root.get("version")) == ("loop", "1.0")
    components = list(root.iter(f"{{{SSD}}}Component"))
    assert [(c.get("name"), c.get("source"), c.get("implementation")) for c in components] == [
        (n, f"resources/{n}.fmu", "CoSimulation") for n in ("plant", "reference", "pid")
    ]
    ends = {c.get("name"): [(e.get("name"), e.get("kind")) for e in c.iter(f"{{{SSD}}}Connector")] for c in components}
    assert ends["plant"] == [("u", "input"), ("y", "output"), ("v", "output")]
    assert ends["pid"][:2] == [("y_d", "input"), ("y", "input")], "u_ff is a constant: it is not listed"
    assert len(list(components[0].iter(f"{{{SSD}}}ParameterBinding"))) == 1
    assert not list(components[1].iter(f"{{{SSD}}}ParameterBinding"))
    assert tags(root, SSD, "Connection") == [
        {"startElement": a, "startConnector": b, "endElement": c, "endConnector": d}
        for a, b, c, d in [("pid", "u", "plant", "u"), ("reference", "r", "pid", "y_d"), ("plant", "y", "pid", "y")]
    ]
    plant = [e[0].get("unit") for e in components[0].iter(f"{{{SSD}}}Connector")]
    assert plant[1] == "um"
    used = {e.get("unit") for e in root.iter(f"{{{SSC}}}Real")} - {None}
    assert [u.get("name") for u in root.iter(f"{{{SSC}}}Unit")] == sorted(map(str, used))


def test_connectors_of_the_system(system: System) -> None:
    root = ET.fromstring(_structure(system, {}, "2.0", True))
    top = root.find(f"{{{SSD}}}System")
    assert top is not None
    listed = top.find(f"{{{SSD}}}Connectors")
    assert listed is not None
    assert [(e.get("name"), e.get("kind")) for e in listed] == [("reference_r", "output"), ("plant_y", "output")]
    assert [e for e in tags(root, SSD, "Connection") if "endElement" not in e] == [
        {"startElement": "reference", "startConnector": "r", "endConnector": "reference_r"},
        {"startElement": "plant", "startConnector": "y", "endConnector": "plant_y"},
    ]
    assert ET.fromstring(_structure(system, {}, "1.0", False)).find(f"{{{SSD}}}System/{{{SSD}}}Connectors") is None


def test_times_and_coupling_travel_along(system: System) -> None:
    root = ET.Element("root")
    _experiment(root, system.case)
    (experiment,) = tags(root, SSD, "DefaultExperiment")
    assert experiment == {"startTime": "0.0", "stopTime": "0.03"}
    told = [dict(e.attrib) for e in root.iter() if e.tag.endswith(("FixedStepAlgorithm", "Coupling"))]
    assert told == [
        {"baseStepSize": "0.0001"},
        {"step": "0.0001", "scheme": "gauss_seidel", "order": "plant reference pid"},
    ]


def test_values_and_the_reference_result(system: System) -> None:
    root = ET.fromstring(parameter_set("x", {"p": 1 / 3, "q": 2.0}, "1.0"))
    found = [(p.get("name"), p[0].get("value")) for p in root.iter() if p.tag.endswith("}Parameter")]
    assert found == [("p", repr(1 / 3)), ("q", "2.0")]
    trace = Trace(np.array([0.0, 0.5]), np.arange(2.0 * system.n_values).reshape(2, -1), system.columns, 1)
    lines = _reference(system, trace).decode().splitlines()
    assert lines[0] == "t,reference.r,plant.y"
    assert [list(map(float, line.split(","))) for line in lines[1:]] == [
        [t, trace["reference.r"][k], trace["plant.y"][k]] for k, t in enumerate((0.0, 0.5))
    ]
    system.case.__dict__["record"] = ()
    assert _reference(system, trace).decode().splitlines()[0].split(",")[1:] == list(system.columns)


def test_inputs_start_with_constants_or_what_they_are_handed(system: System) -> None:
    pid = system.parts[2]
    graph = _with_starts(pid, {("pid", "y"): 0.5, ("plant", "y_d"): 9.0, ("pid", "u_ff"): 7.0}, 0.25)
    assert {i.name: i.start for i in graph.inputs} == {"y_d": 0.0, "y": 0.5, "u_ff": 0.125}
    assert graph.step == 0.25


def test_an_archive_has_no_date(loop: Any, write: Any, tmp_path: Path) -> None:
    loop["stop"], loop["metrics"]["tracking"]["after"] = 0.001, 0.0
    case = ready(write(loop)).case
    made = write_ssp(case, tmp_path / "x.ssp")
    with zipfile.ZipFile(tmp_path / "x.ssp") as archive:
        assert {i.date_time for i in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert {i.compress_type for i in archive.infolist()} == {zipfile.ZIP_DEFLATED}
        names = archive.namelist()
    assert (made.components, made.path) == (1, tmp_path / "x.ssp")
    assert names == ["SystemStructure.ssd", "resources/loop.fmu", "extra/org.hystfmu/reference.csv"]


# ---- units that are joined -----------------------------------------------------------------------------------------
def test_neighbours_become_one_unit(system: System) -> None:
    case, names = joined(system)
    assert case.order == ("loop",)
    assert names == {end: f"loop.{end.replace('.', '_')}" for end in system.columns}
    assert case.record == ("loop.reference_r", "loop.plant_y")
    assert (case.connections, case.units["loop"].inputs) == ({}, {"pid_u_ff": 0.125})
    again = build(case)
    assert [p.name for p in again.parts] == ["loop"]
    assert again.parts[0].constants == {"pid_u_ff": 0.125}


def test_an_algebraic_loop_is_cut_where_a_value_is_late(loop: Any, write: Any) -> None:
    del loop["units"]["plant"]["graph"]["outputs"][1]
    loop["units"]["plant"] = {"block": "scaling", "dims": {"n": 1}}
    loop["units"]["pid"] = {"block": "sum", "dims": {"n": 2}, "values": {"k": [1.0, -0.5]}}
    loop["connections"] = {"plant.u": "pid.y", "pid.u_1": "reference.r", "pid.u_2": "plant.y"}
    loop["loops"] = []
    case, names = joined(ready(write(loop)))
    assert case.order == ("plant_to_reference", "pid")
    assert names["pid.y"] == "pid.pid_y"
    assert case.connections == {
        "plant_to_reference.plant_u": "pid.pid_y", "pid.pid_u_1": "plant_to_reference.reference_r",
        "pid.pid_u_2": "plant_to_reference.plant_y",
    }  # fmt: skip


# ---- a container ---------------------------------------------------------------------------------------------------
def test_numbers_and_texts_of_a_system_file() -> None:
    assert _bits(1.5) == struct.pack(">d", 1.5).hex() == "3ff8000000000000"
    assert [_string(t) for t in ("a_B-9/{x}~.:", "a b", "ä%", "")] == ["a_B-9/{x}~.:", "a%20b", "%C3%A4%25", "%"]
    assert [_list([]), _list(["3", "5"])] == ["0", "2 3 5"]


def test_a_system_file_by_hand(system: System) -> None:
    places = system.columns
    head = _system(system, ["unit ..."]).splitlines()
    assert head[0] == f"coupling 0 1 {_bits(1e-4)} {_bits(1e-4)}"
    assert head[1].split()[:3] == ["values", str(len(places)), "d"]
    assert head[2:] == ["units 3", "unit ..."]
    files: dict[str, bytes] = {}
    lines = _unit(system, 2, files)
    part = system.parts[2]
    ports = {n: p.reference + i for p in part.own.ports for i, n in enumerate(p.scalar_names)}
    assert lines[1:] == [
        "structural 0",
        "parameters 0",
        f"inputs 1 d {ports['u_ff']} 1 {_bits(0.125)}",
        f"connected 2 2 d y_d {ports['y_d']} 1 {places['reference.r']} {_bits(0.0)} "
        f"d y {ports['y']} 1 {places['plant.y']} {_bits(0.0)}",
        f"outputs {len(part.outputs)} {len(part.outputs)} " + " ".join(f"d {n} {ports[n]} 1" for n in part.outputs),
    ]
    assert lines[0].startswith("unit pid 2 units/own/")
    assert lines[0].endswith(f" 1 1 {_bits(1e-4)} {places['pid.u']}")
    assert set(files) == {lines[0].split()[3].removeprefix("units/"), "pid/resources/block.bin"}


def test_the_description_of_a_container(system: System) -> None:
    root = ET.fromstring(_description(system, "x", "token"))
    assert root.get("guid") == "token"
    assert str(root.get("description")).endswith("3 units, stepped in the order plant, reference, pid")
    experiment = root.find("DefaultExperiment")
    assert experiment is not None
    assert dict(experiment.attrib) == {"startTime": "0.0", "stopTime": "0.03", "stepSize": "0.0001"}
    variables = [(v.get("name"), v.get("valueReference")) for v in root.iter("ScalarVariable")]
    assert variables == [(end.replace(".", "_"), str(k)) for k, end in enumerate(system.columns)]
    for of in ("Outputs", "InitialUnknowns"):
        assert [u.get("index") for u in root.iterfind(f"ModelStructure/{of}/Unknown")] == [
            str(k + 1) for k in range(len(variables))
        ]


def test_what_a_container_does_not_step(loop: Any, write: Any) -> None:
    loop["coupling"] = {"scheme": "iterative"}
    with pytest.raises(InputError, match="a container steps in order or all at once, not with iterative coupling"):
        _check(ready(write(loop)))
    loop["coupling"] = {"scheme": "jacobi"}
    _check(ready(write(loop)))
    loop["units"]["pid"]["hold"] = "first"
    with pytest.raises(InputError, match="pid has a hold of its own: a container knows none"):
        _check(ready(write(loop)))


def test_values_of_a_container_as_their_types(system: System) -> None:
    def told(kind: str, *values: Any) -> str:
        return _told(system, system.parts[0], SimpleNamespace(name="p", type=kind), 3, values)

    assert _told(system, system.parts[0], None, 3, [1.5]) == f"d 3 1 {_bits(1.5)}"
    assert told("Real", 1.5, -0.0) == f"d 3 2 {_bits(1.5)} {_bits(-0.0)}"
    assert told("Boolean", True) == "? 3 1 1"
    assert told("String", "a b") == "s 3 1 a%20b"
    assert told("Integer", 2.5) == "i 3 1 2"
    assert told("UInt64", 2**64 - 1) == "Q 3 1 18446744073709551615"
    with pytest.raises(InputError, match=r"plant\.p: a container sets no values of type Binary"):
        told("Binary", 1.0)
    with pytest.raises(InputError, match=r"plant\.p: 300 does not fit the type Int8"):
        told("Int8", 300.0)


# ---- compared with a reference ------------------------------------------------------------------------------------
def test_a_run_is_held_against_the_result_in_its_archive() -> None:
    case: Any = SimpleNamespace(step=0.5, tolerance=0.01)
    trace = Trace(np.array([0.0, 0.5, 1.0]), np.array([[1.0], [2.0], [4.0]]), {"a.y": 0}, 1)

    def held(rows: Any, signals: tuple[str, ...] = ("a.y",)) -> Any:
        return ssp_run._held_against("x", case, signals, None if rows is None else np.array(rows), trace)

    assert held(None) == held([[0.0, 1.0], [0.6, 2.0]]) == ((), ())
    assert held([[0.0, 1.0], [0.5, 2.0], [1.0, 4.0]]) == (("a.y",), ())
    assert held([[0.0, 1.0], [0.5 + 4e-7, 2.0]]) == (("a.y",), ())
    assert held([[0.0, 1.03], [0.5, 2.0], [1.0, 4.0]]) == (("a.y",), ())
    (line,) = held([[0.0, 1.0], [0.5, 2.05], [1.0, 4.0]])[1]
    assert line.startswith("x: a.y = 2 at t = 0.5 s differs from 2.05 in ")
    assert len(held([[0.0, 1.0], [0.5, np.nan]])[1]) == 1
    with pytest.raises(InputError, match=r"^x: .*: names b\.y, which does not exist$"):
        held([[0.0, 1.0]], ("b.y",))


# ---- pictures ------------------------------------------------------------------------------------------------------
def test_the_plots_of_a_case(monkeypatch: pytest.MonkeyPatch) -> None:
    metric = MetricSpec.model_validate({"kind": "max_percent", "signal": "a.y", "against": "b.y", "after": 0.5})
    late = MetricSpec.model_validate({"kind": "peak", "signal": "a.y", "after": 1.0})
    monkeypatch.setattr(plots, "unit_of", lambda system, end: {"a.y": "um", "b.y": "um"}.get(end, ""))
    ends = {"a.y": 0, "b.y": 1, "c.y": 2}
    values = np.array([[9.0, 0, 1], [1, 2, 2], [3, 2, 3], [2, 6, 4]])
    trace = Trace(np.arange(4) * 0.5, values, ends, 1)
    case = SimpleNamespace(metrics={"m": metric, "n": late}, loops=(("a.y", "b.y"),), record=("a.y", "c.y", "b.y"))
    system: Any = SimpleNamespace(case=case)
    found = plots.case_plots(system, trace)
    assert [p.title for p in found] == [
        "Loops, each over its range", "a.y, b.y", "c.y", "Tracking error, including between samples",
    ]  # fmt: skip
    assert [p.y_label for p in found[1:3]] == ["value in um", "value"]
    (loop,) = found[0].lines
    assert loop.x.tolist() == [0.0, 100.0, 50.0]
    assert loop.y.tolist() == [0.0, 0.0, 100.0]
    (error,) = found[3].lines
    assert error.x.tolist() == [0.5, 1.0, 1.5]
    assert error.y.tolist() == [-25.0, 25.0, -100.0]
    assert plots._share(np.array([2.0, 2.0])).tolist() == [50.0, 50.0]
    case.metrics, case.loops, case.record = {}, (), ("a.y", "c.y")
    assert [p.title for p in plots.case_plots(system, trace)] == ["a.y", "c.y"]
    assert plots.value_label(system, ["a.y", "c.y"]) == "value"
