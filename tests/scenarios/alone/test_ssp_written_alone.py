"""Files of a loop for other simulators, element by element: archives, containers, joined units, pictures of a case."""

from __future__ import annotations

import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path
from typing import Any

import pytest
from engines import ready

from hystfmu.base.errors import InputError
from hystfmu.scenario.ssp.container import _check, joined
from hystfmu.scenario.ssp.write import SSC, SSD, _structure, write_ssp
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


def test_what_a_container_does_not_step(loop: Any, write: Any) -> None:
    loop["coupling"] = {"scheme": "iterative"}
    with pytest.raises(InputError, match="a container steps in order or all at once, not with iterative coupling"):
        _check(ready(write(loop)))
    loop["coupling"] = {"scheme": "jacobi"}
    _check(ready(write(loop)))
    loop["units"]["pid"]["hold"] = "first"
    with pytest.raises(InputError, match="pid has a hold of its own: a container knows none"):
        _check(ready(write(loop)))


# ---- compared with a reference ------------------------------------------------------------------------------------


# ---- pictures ------------------------------------------------------------------------------------------------------
