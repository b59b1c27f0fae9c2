"""FMUs by fmpy in any mixture of versions, the native engine and fused graphs give the same bits."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from engines import ready
from fmpy.fmi2 import FMU2Slave

import hystfmu as hy
from hystfmu.fmu.write.export import export_fmu
from hystfmu.scenario import simulate, to_graph
from hystfmu.scenario.outcome.trace import Stopped

KINDS = ("fmu2", "fmu3")


def multirate(loop: dict[str, Any]) -> dict[str, Any]:
    """The loop with a fine plant, sensor noise, and a slow outer unit."""
    loop["ripple"] = 5
    loop["order"] = ["plant", "reference", "noise", "sensor", "slow", "pid"]
    loop["units"]["plant"]["fine"] = True
    loop["units"]["reference"]["fine"] = True
    loop["units"]["noise"] = {"block": "noise", "values": {"sigma": 1e-3}}
    loop["units"]["sensor"] = {"block": "sum"}
    loop["units"]["slow"] = {"block": "sum", "dims": {"n": 1}, "values": {"k": [0.1]}, "every": 3}
    loop["units"]["pid"]["inputs"] = {}
    loop["connections"] |= {
        "sensor.u_1": "plant.y",
        "sensor.u_2": "noise.w",
        "pid.y": "sensor.y",
        "slow.u": "reference.r",
        "pid.u_ff": "slow.y",
    }
    return loop


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_unit_gives_the_bits_of_the_fused_core(loop: Any, write: Any, kind: str) -> None:
    data = multirate(loop)
    for unit in data["units"].values():
        unit["as"] = kind
    system = ready(write(data))
    assert simulate(system).values.tobytes() == simulate(system, "native").values.tobytes()


def test_a_mixture_gives_the_same_bits(loop: Any, write: Any) -> None:
    data = multirate(loop)
    for k, unit in enumerate(data["units"].values()):
        unit["as"] = KINDS[k % 2]
    system = ready(write(data))
    mixed, native = simulate(system), simulate(system, "native")
    assert mixed.values.tobytes() == native.values.tobytes()
    assert np.ptp(mixed["plant.y"]) > 1  # something happened


def test_the_loop_as_one_graph_and_one_fmu_gives_the_same_bits(loop: Any, write: Any, tmp_path: Path) -> None:
    system = ready(write(loop))
    trace = simulate(system, "native")
    graph = to_graph(system)
    n = system.n_steps + 1
    inside = graph.run(np.full((n, 1), 0.125), system.h)
    assert inside.tobytes() == trace.values.tobytes()

    archive = export_fmu(graph, tmp_path / "loop.fmu", fmi=2)
    folder = fmpy.extract(str(archive), str(tmp_path / "unpacked"))
    description = fmpy.read_model_description(folder)
    outputs = [v.valueReference for v in description.modelVariables if v.causality == "output"]
    fmu = FMU2Slave(
        guid=description.guid,
        modelIdentifier=description.coSimulation.modelIdentifier,
        unzipDirectory=folder,
        instanceName="loop",
    )
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()  # the constant input is the start value: nothing to set
    rows = [fmu.getReal(outputs)]
    for k in range(system.n_steps):
        fmu.doStep(k * system.h, system.h)
        rows.append(fmu.getReal(outputs))
    fmu.freeInstance()
    assert np.array(rows).tobytes() == trace.values.tobytes()


def test_units_of_different_rates_do_not_fit_into_one_graph(loop: Any, write: Any) -> None:
    system = ready(write(multirate(loop)))
    with pytest.raises(ValueError, match="different rates"):
        to_graph(system)


def test_the_slow_unit_changes_every_third_step_only(loop: Any, write: Any) -> None:
    trace = simulate(ready(write(multirate(loop))), "native")
    changed = np.flatnonzero(np.diff(trace["slow.y"])) + 1
    assert set(changed % (5 * 3)) == {0}
    assert np.array_equal(trace["slow.y"][15::15], 0.1 * trace["reference.r"][15::15])
    held = np.flatnonzero(np.diff(trace["pid.u"])) + 1
    assert set(held % 5) == {0}


def test_the_plant_between_samples_is_the_plant_at_the_fine_step(loop: Any, write: Any) -> None:
    """The exact discretisation of G0: the same samples whether it runs once or ten times between them."""
    coarse = simulate(ready(write(loop)), "native")
    loop["ripple"] = 10
    loop["units"]["plant"]["fine"] = True
    fine = simulate(ready(write(loop)), "native")
    assert len(fine.t) == 10 * (len(coarse.t) - 1) + 1
    assert np.abs(fine["plant.y"][::10] - coarse["plant.y"]).max() < 1e-12


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return folder


def test_nothing_is_left_in_the_temporary_folder(loop: Any, write: Any, temporary: Path) -> None:
    hy.run([write(loop)])
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize("kind", ["fmu2", "fmu3"])
def test_a_run_that_overflows_is_a_failure_and_not_bad_input(
    loop: Any, write: Any, temporary: Path, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    loop["units"]["large"] = {"block": "sum", "dims": {"n": 1}, "values": {"k": [1e308]}}
    loop["units"]["reference"]["values"]["amplitude"] = 1e6
    loop["units"]["pid"] |= {"inputs": {}, "as": kind}
    loop["order"] = ["plant", "reference", "large", "pid"]
    loop["connections"] |= {"large.u": "reference.r", "pid.u_ff": "large.y"}
    system = ready(write(loop))
    for engine in ("fmpy", "native"):
        with pytest.raises(Stopped, match=r"refuses|not finite"):
            simulate(system, engine)  # type: ignore[arg-type]
    (result,) = hy.run([write(loop)])
    assert not result.passed
    (line,) = result.failures()
    assert line.startswith("loop/nominal: stopped: pid refuses the step from t = 0 s: ")
    assert "u_ff" in line  # the words of the FMU
    assert capfd.readouterr() == ("", "")
    assert list(temporary.iterdir()) == []
