"""Times, rows, order and loops of a system, counted by hand; and units that become one graph."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from engines import ready

from hystfmu.scenario.system.folders import here_or_shipped, shipped_scenarios
from hystfmu.scenario.system.measures import label, unit_of, unit_of_metric

# ---- one graph -----------------------------------------------------------------------------------------------------


def test_units_of_measure_of_a_signal(loop: Any, write: Any) -> None:
    loop["units"]["plant"]["graph"]["outputs"][0]["unit"] = "um"
    loop["units"]["pair"] = {"block": "scaling", "dims": {"n": 2}, "inputs": {"u_1": 0.0, "u_2": 0.0}}
    loop["order"].append("pair")
    s = ready(write(loop))
    assert [unit_of(s, e) for e in ("plant.y", "plant.v", "pair.y_2", "pair.gain", "x.y", "plant.q")] == [
        "um", "", "", "", "", "",
    ]  # fmt: skip
    peak, rms = (s.case.metrics["tracking"].model_copy(update={"kind": k}) for k in ("peak", "rms"))
    assert [unit_of_metric(s, m) for m in (peak, rms, s.case.metrics["tracking"])] == ["um", "um", "%"]
    assert [label("a", "um"), label("a", "")] == ["a in um", "a"]


def test_units_of_measure_follow_connections_metrics_and_blocks_that_do_not_scale(loop: Any, write: Any) -> None:
    plant = loop["units"]["plant"]["graph"]
    plant["outputs"][0]["unit"], plant["inputs"][0]["unit"] = "um", "V"
    loop["units"] |= {
        "late": {"block": "delay", "dims": {"n": 2}},
        "error": {"block": "sum", "values": {"k": [1.0, -1.0]}},
        "half": {"block": "sum", "values": {"k": [0.5, 0.0]}},
    }
    loop["order"] += ["late", "error", "half"]
    loop["connections"] |= {"late.u": "plant.y", "error.u_1": "late.y", "error.u_2": "plant.y"}
    loop["connections"] |= {"half.u_1": "late.y", "half.u_2": "late.y"}
    s = ready(write(loop))
    ends = ("plant.y", "reference.r", "pid.y", "late.y", "error.y", "half.u_1", "half.y", "pid.u", "plant.u")
    assert [unit_of(s, e) for e in ends] == ["um", "um", "um", "um", "um", "um", "", "V", "V"]
    plant["inputs"][0]["unit"] = "um"
    plant["outputs"][0]["unit"] = "V"
    loop["connections"]["late.u"] = "pid.u"  # a sum of V and um
    s = ready(write(loop))
    assert [unit_of(s, e) for e in ("plant.u", "plant.y", "late.y", "error.y", "reference.r")] == [
        "um", "V", "", "", "",
    ]  # fmt: skip


def test_a_shipped_scenario_stands_in_for_a_missing_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shipped = shipped_scenarios()
    assert (shipped / "pid").is_dir()
    assert here_or_shipped("scenarios/pid") == shipped / "pid"
    for path in ("scenarios/none_of_that_name", "other/pid", "pid"):
        assert here_or_shipped(path) == Path(path)
    (tmp_path / "scenarios" / "pid").mkdir(parents=True)
    assert here_or_shipped("scenarios/pid") == Path("scenarios/pid")
