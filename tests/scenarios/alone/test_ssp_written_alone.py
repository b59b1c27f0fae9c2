"""Files of a loop for other simulators, element by element: archives, containers, joined units, pictures of a case."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import pytest
from engines import ready

from hystfmu.base.errors import InputError
from hystfmu.scenario.ssp.container import _check
from hystfmu.scenario.ssp.coupling import joined
from hystfmu.scenario.ssp.write import write_ssp
from hystfmu.scenario.system.system import System


@pytest.fixture
def system(loop: Any, write: Any) -> System:
    loop["units"]["plant"]["graph"]["outputs"][0]["unit"] = "um"
    return ready(write(loop))


# ---- the structure -------------------------------------------------------------------------------------------------


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
