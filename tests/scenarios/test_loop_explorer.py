"""Which units of loops a page lets a reader move, over which range, behind which inverse."""

from __future__ import annotations

from typing import Any

from engines import ready

from hystfmu.report.explorer import Explored
from hystfmu.scenario import Cases
from hystfmu.scenario.engine.simulation import simulate
from hystfmu.scenario.report import loops as module
from hystfmu.scenario.system.spec import shipped_scenarios
from hystfmu.scenario.system.system import System, build


def cases(name: str, *wanted: str) -> list[System]:
    return [build(c) for c in Cases(shipped_scenarios() / name).cases if c.name in wanted]


def shown(systems: list[System]) -> list[Explored]:
    found = module.loop_explorer(systems)
    assert found is not None
    assert found.explorer is not None
    return list(found.explorer.models)


def test_the_range_is_that_of_the_run_and_the_inverse_that_of_the_loop() -> None:
    (system,) = cases("pid", "sine_10")
    (plant,) = shown([system])
    u = simulate(system, "native")["delay.y"]
    assert (plant.lo, plant.hi) == (u.min(), u.max())
    units = {p.name: p.own for p in system.parts}
    assert plant.name == "plant"
    assert plant.graph.file == units["plant"].to_bytes()
    assert plant.inverse is not None
    assert plant.inverse.file == units["inverse"].to_bytes()
    assert plant.sliders[0].name == "d"


def test_a_plant_with_other_blocks_is_a_model_of_its_own_one_with_other_values_is_not() -> None:
    systems = cases("pid", "sine_10", "up_400_10", "bouc_wen_sine_10")
    assert [m.name for m in shown(systems)] == ["plant", "plant of pid/bouc_wen_sine_10"]


def test_axes_carry_the_units_of_measure_of_the_loop() -> None:
    found = module.loop_explorer(cases("stage/open_loop", "scan_100"))
    assert found is not None
    assert found.explorer is not None
    assert (found.explorer.u_label, found.explorer.y_label) == ("input in V", "output in um")
    (plant,) = found.explorer.models  # through converter and delay
    assert plant.inverse is not None


def test_an_inverse_that_reads_more_than_the_wanted_output_is_not_in_front() -> None:
    (plant,) = shown(cases("adaptive", "nominal_10"))
    assert plant.inverse is None


def test_loops_without_hysteresis_and_unstable_ones_have_none(loop: Any, write: Any) -> None:
    (plant,) = shown([ready(write(loop))])
    assert plant.inverse is None
    loop["units"]["pid"]["values"]["Kp"] = 1e9
    assert module.loop_explorer([ready(write(loop))]) is None
    loop["units"]["pid"]["values"]["Kp"] = 1.0
    loop["units"]["plant"]["graph"]["blocks"][0] |= {"type": "scaling", "dims": {"n": 1}, "values": {"gain": [0.5]}}
    assert module.loop_explorer([ready(write(loop))]) is None
