"""Times, rows, order and loops of a system, counted by hand; and units that become one graph."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from engines import ready

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome.metrics import label, unit_of, unit_of_metric
from hystfmu.scenario.system import system as module
from hystfmu.scenario.system.spec import here_or_shipped, shipped_scenarios
from hystfmu.scenario.system.system import System, fuse, segments, to_graph


@pytest.fixture
def fine(loop: Any, write: Any) -> System:
    """Steps of 1/8 s in four fine ones, a plant that runs in these, a slow unit in every second step."""
    loop |= {"step": 0.125, "stop": 2.0, "ripple": 4, "order": ["plant", "reference", "slow", "pid"]}
    loop["units"]["plant"]["fine"] = True
    loop["units"]["slow"] = {"block": "scaling", "dims": {"n": 1}, "every": 2}
    loop["connections"]["slow.u"] = "plant.v"
    loop["metrics"] = {"p": {"kind": "peak", "signal": "plant.y"}}
    return ready(write(loop))


def test_times_are_whole_steps_and_fine_ones(fine: System) -> None:
    assert (fine.h, fine.n_steps) == (0.03125, 64)
    n = np.arange(65)
    want = [k // 4 * 0.125 + k % 4 * 0.03125 for k in range(65)]
    assert fine.at(n).tolist() == want
    for first, end in [(0, 65), (3, 10), (4, 8), (5, 6), (7, 7)]:
        assert fine.times(first, end).tolist() == want[first:end]


def test_the_row_of_a_time_is_the_first_that_is_not_before_it(fine: System) -> None:
    t = np.array([0.0, 0.03125, 0.0313, 0.0312, 1.0, 2.0])
    assert fine.rows(t).tolist() == [0, 1, 2, 1, 32, 64]


def test_rows_of_a_step_that_is_no_binary_fraction(loop: Any, write: Any) -> None:
    """A quotient that is rounded is corrected by the time of its row."""
    loop |= {"step": 0.1, "stop": 100.0}
    del loop["metrics"]["tracking"]["after"]
    s = ready(write(loop))
    n = np.arange(1001)
    assert s.rows(s.at(n)).tolist() == n.tolist()
    above, below = np.nextafter(s.at(n), np.inf), np.nextafter(s.at(n), -np.inf)
    assert s.rows(above)[:-1].tolist() == (n[:-1] + 1).tolist()
    assert s.rows(above)[-1] == 1000
    assert s.rows(below)[1:].tolist() == n[1:].tolist()


def test_chunks_cover_the_run_and_are_bounded(fine: System, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SHORTEST_CHUNK", 4)
    for values, length in [(8 * 16, 16), (8 * 31, 16), (8 * 32, 32), (8 * 64, 64), (8 * 65, 64), (1, 4), (10**6, 65)]:
        monkeypatch.setattr(module, "CHUNK_VALUES", values)
        chunks = list(fine.chunks())
        assert chunks == [(k, min(k + length, 65)) for k in range(0, 65, length)]


def test_steps_of_units(fine: System) -> None:
    plant, reference, slow, pid = fine.parts
    assert [p.period for p in fine.parts] == [1, 4, 8, 4]
    assert [fine.length(p) for p in fine.parts] == [0.03125, 0.125, 0.25, 0.125]
    assert [p.any_step for p in fine.parts] == [True, False, False, False]
    assert [p.name for p in (plant, reference, slow, pid)] == ["plant", "reference", "slow", "pid"]


def test_who_makes_and_reads_what(fine: System) -> None:
    """plant.y, plant.v, then six outputs of the reference, slow.y, those of the PID."""
    columns = fine.columns
    assert (columns["plant.y"], columns["plant.v"], columns["reference.r"]) == (0, 1, 2)
    links = {fine.parts[n.to].name + "." + fine.parts[n.to].inputs[n.input]: n for n in fine.links}
    assert {k: fine.maker(n).name for k, n in links.items()} == {
        "plant.u": "pid", "slow.u": "plant", "pid.y_d": "reference", "pid.y": "plant",
    }  # fmt: skip
    assert {k: fine.fresh(n) for k, n in links.items()} == {
        "plant.u": False, "slow.u": True, "pid.y_d": True, "pid.y": True,
    }  # fmt: skip
    assert fine.early().tolist() == [columns["pid.u"]]
    assert fine.makers().tolist() == [3]
    assert fine.loops() == {0, 3}
    assert not fine.newton
    assert fine.column("plant.v", "w") == 1
    for end, have in [("plant.z", "plant.y, plant.v"), ("x.y", "plant, reference, slow, pid")]:
        with pytest.raises(InputError, match=f"^w: no output {end!r}; there are {re.escape(have)}$"):
            fine.column(end, "w")


@pytest.mark.parametrize(("scheme", "fresh"), [("gauss_seidel", 2), ("jacobi", 0), ("iterative", 3)])
def test_what_a_reader_sees_depends_on_the_coupling(loop: Any, write: Any, scheme: str, fresh: int) -> None:
    loop["coupling"] = {"scheme": scheme}
    s = ready(write(loop))
    assert sum(s.fresh(n) for n in s.links) == fresh


def test_loops_are_what_a_late_value_goes_through(write: Any) -> None:
    """a -> b -> c -> b, c -> d: d lies between c and e, which are read early; a does not."""
    gain = {"block": "scaling", "dims": {"n": 1}}
    two = {"block": "sum", "dims": {"n": 2}}
    data = {
        "name": "s", "step": 0.1, "stop": 1.0, "order": ["a", "b", "c", "d", "e"],
        "units": {"a": {"block": "reference"}, "b": two, "c": gain, "d": gain, "e": two},
        "connections": {
            "b.u_1": "a.r", "b.u_2": "c.y", "c.u": "b.y", "d.u": "c.y", "e.u_1": "d.y", "e.u_2": "e.y",
        },
        "metrics": {"p": {"kind": "peak", "signal": "d.y"}},
        "coupling": {"scheme": "iterative"},
    }  # fmt: skip
    s = ready(write(data))
    assert s.loops() == {1, 2, 3, 4}
    assert s.makers().tolist() == [2, 4]
    assert s.newton
    data["coupling"] = {"scheme": "gauss_seidel"}
    assert not ready(write(data)).newton
    data["coupling"] = {"scheme": "iterative"}
    data["units"]["c"] = {"block": "delay"}  # a sampled block has no tangent
    assert not ready(write(data)).newton


def test_feed_through_to_outputs_that_are_read(loop: Any, write: Any) -> None:
    """The plant has dynamics from u to y and none from u to v."""
    s = ready(write(loop))
    plant, reference, pid = s.parts
    assert not s.feeds_through(plant, 0)
    loop["metrics"]["v"] = {"kind": "peak", "signal": "plant.v"}
    s = ready(write(loop))
    assert s.feeds_through(s.parts[0], 0)
    assert s.feeds_through(s.parts[2], s.parts[2].inputs.index("y"))
    assert (reference.inputs, pid.name) == ((), "pid")


def test_a_first_order_hold_needs_sources_that_step_as_often(loop: Any, write: Any) -> None:
    loop["ripple"] = 2
    loop["units"]["plant"] |= {"fine": True, "hold": "first"}
    with pytest.raises(
        InputError, match=r"units\.plant\.hold: 'first' needs sources that step as often; pid is slower$"
    ):
        ready(write(loop))
    loop["units"]["pid"]["hold"] = "first"
    loop["units"]["plant"]["hold"] = "zero"
    assert ready(write(loop)).parts[2].hold == "first"


# ---- one graph -----------------------------------------------------------------------------------------------------
def test_the_loop_as_one_graph(loop: Any, write: Any) -> None:
    s = ready(write(loop))
    graph = to_graph(s)
    assert [n.name for n in graph.nodes] == ["plant_hysteresis", "plant_g0", "reference_reference", "pid_pid"]
    assert [(i.name, i.to, i.start) for i in graph.inputs] == [("pid_u_ff", ("pid_pid.u_ff",), 0.125)]
    assert [o.name for o in graph.outputs][:2] == ["plant_y", "plant_v"]
    assert set(graph.wires) >= {("plant_hysteresis.y", "plant_g0.u"), ("pid_pid.u", "plant_hysteresis.u")}
    some, outside = fuse(s, (0, 2))
    assert outside == [(2, s.parts[2].inputs.index("y_d")), (2, s.parts[2].inputs.index("u_ff"))]
    assert [i.name for i in some.inputs] == ["pid_y_d", "pid_u_ff"]


def test_what_a_unit_reads_of_itself_stays_inside_unless_told(write: Any) -> None:
    delay = {"block": "delay", "dims": {"n": 2}}
    data = {
        "name": "s", "step": 0.1, "stop": 1.0, "order": ["d"], "units": {"d": delay}, "connections": {"d.u": "d.y"},
        "metrics": {"p": {"kind": "peak", "signal": "d.y"}},
    }  # fmt: skip
    s = ready(write(data))
    assert fuse(s, (0,))[1] == []
    assert fuse(s, (0,), own=True)[1] == [(0, 0)]


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


def test_units_of_other_rates_or_holds_are_no_graph(loop: Any, write: Any) -> None:
    loop["ripple"] = 2
    s = ready(write(loop))
    with pytest.raises(
        InputError, match=r"^loop/nominal: units of different rates do not fit into one graph: \{'plant': 2"
    ):
        to_graph(s)
    loop["ripple"] = 1
    for more in ({"substeps": 2}, {"hold": "first"}):
        loop["units"]["plant"] = {k: v for k, v in loop["units"]["plant"].items() if k == "graph"} | more
        with pytest.raises(
            InputError, match=r"^loop/nominal: plant has substeps or hold = 'first': one graph has one step$"
        ):
            to_graph(ready(write(loop)))


def test_neighbours_step_as_one_block(loop: Any, write: Any) -> None:
    """The command is late for the plant, which has dynamics between them: one segment of all units."""
    assert segments(ready(write(loop)), False) == [(0, 1, 2)]
    assert segments(ready(write(loop)), True) == [(0, 1), (2,)]  # a PID is sampled: its steps are not cut
    for more in ({"substeps": 2}, {"hold": "first"}):
        loop["units"]["reference"] |= more
        assert segments(ready(write(loop)), False) == [(0,), (1,), (2,)]
        loop["units"]["reference"] = {k: v for k, v in loop["units"]["reference"].items() if k not in more}
    loop["units"]["pid"]["every"] = 2
    assert segments(ready(write(loop)), False) == [(0, 1), (2,)]
    del loop["units"]["pid"]["every"]
    loop["record"] = ["reference.r", "plant.y", "plant.v"]
    loop["metrics"]["v"] = {"kind": "peak", "signal": "plant.v"}  # now the late command is fed through
    assert segments(ready(write(loop)), False) == [(0, 1), (2,)]


def test_a_shipped_scenario_stands_in_for_a_missing_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shipped = shipped_scenarios()
    assert (shipped / "pid").is_dir()
    assert here_or_shipped("scenarios/pid") == shipped / "pid"
    for path in ("scenarios/none_of_that_name", "other/pid", "pid"):
        assert here_or_shipped(path) == Path(path)
    (tmp_path / "scenarios" / "pid").mkdir(parents=True)
    assert here_or_shipped("scenarios/pid") == Path("scenarios/pid")
