"""Processor time of a study, compared with a simulation loop that is written by hand with fmpy.

The simulated loop has a P controller and a first-order plant, and makes 10 000 steps of 1 ms. The time by hand contains
only the steps. The time of the study contains everything, from reading the study file to writing the result table.
"""

import os
import time
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import tomli_w

import hystfmu as hy
from hystfmu.base import Array, InputError
from hystfmu.fmu.write.export import export_fmu
from hystfmu.scenario import build
from hystfmu.scenario.system.case import Cases
from hystfmu.scenario.system.system import System
from papers.table import Row, Stated

ROW = Stated(__name__)

STEPS, H, LAG, GAIN = 10_000, 1e-3, 0.1, 2.0
REPEATS = 3
FASTER, TWO_CORES = 100.0, 1.8
LOOP: dict[str, Any] = {
    "name": "loop",
    "step": H,
    "stop": STEPS * H,
    "order": ["plant", "controller"],
    "units": {
        "plant": {
            "block": "transfer_function",
            "dims": {"na": 1, "nb": 0},
            "values": {"b": [1.0], "a": [LAG, 1.0], "hold": "zoh"},
        },
        "controller": {"block": "sum", "values": {"k": [GAIN, -GAIN]}, "inputs": {"u_1": 1.0}},
    },
    "connections": {"plant.u": "controller.y", "controller.u_2": "plant.y"},
    "metrics": {"peak": {"kind": "peak", "signal": "plant.y"}},
}


def rows(n: int) -> list[Row]:
    """Return table rows with the speed of a study of n runs.

    The study on one core is compared with the loop by hand, and with the same study on two cores.
    """
    with TemporaryDirectory() as folder:
        return _rows(Path(folder), n)


def _rows(folder: Path, n: int) -> list[Row]:
    (folder / "loop").mkdir()
    (folder / "loop" / "scenario.toml").write_text(tomli_w.dumps(LOOP))
    study: dict[str, Any] = {"name": "speed", "scenario": "../loop", "method": "sobol", "n": n}
    study["parameters"] = {"controller.k": {"scale": [0.5, 2.0]}, "plant.b": {"scale": [0.5, 2.0]}}
    path = folder / "study" / "study.toml"
    path.parent.mkdir()
    path.write_text(tomli_w.dumps(study))
    cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]
    counts = [1, 2][: len(cores)]
    hy.study(path, folder / "first", workers=1)  # this first run includes the imports

    taken: dict[int, tuple[float, float]] = {}
    for c in counts:
        timed = [_study(path, folder / f"out_{c}_{k}", cores[:c]) for k in range(REPEATS)]
        taken[c] = min(t[0] for t in timed), min(t[1] for t in timed)
    what = f"{n} variations of a loop of {STEPS} steps"
    units = unpacked(build(Cases(folder / "loop").cases[0]), folder)
    hand = min(by_hand(units)[0] for _ in range(REPEATS)) * n
    one = ROW("by_hand", ours=hand / taken[1][1], target=FASTER, what=what, hand=hand, study=taken[1][1])
    found = [one]
    if len(counts) > 1:
        load = os.getloadavg()[0]
        two = ROW(
            "two_cores", ours=taken[1][0] / taken[2][0], target=TWO_CORES, what=what, load=load, cores=os.cpu_count()
        )
        found.append(two)
    return found


def _study(path: Path, folder: Path, cores: list[int]) -> tuple[float, float]:
    """Run a study on the given cores, and return the elapsed time (s) and the processor time (s).

    `path` is the study file, and `folder` receives the results.
    """
    if hasattr(os, "sched_setaffinity"):
        before_cores = os.sched_getaffinity(0)
        os.sched_setaffinity(0, cores)
    try:
        begin, before = time.perf_counter(), _used()
        outcome = hy.study(path, folder, workers=len(cores))
        if outcome.failed:
            raise InputError(f"The study must run. Got {len(outcome.failed)} failed runs.")
        return time.perf_counter() - begin, _used() - before
    finally:
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(0, before_cores)


def _used() -> float:
    """Return the processor time (s) of this process and of its child processes that have ended."""
    t = os.times()
    return t.user + t.system + t.children_user + t.children_system


def unpacked(system: System, folder: Path) -> dict[str, tuple[str, Any]]:
    """Export the units of a system as FMUs into a folder, unpack them, and return their folders and model descriptions.

    The keys are the names of the units. Each value is a pair of the unpacked folder and the model description of fmpy.
    """
    import fmpy  # imported here, because the import takes a second

    found = {}
    for part in system.parts:
        where = fmpy.extract(str(export_fmu(part.own, folder / f"{part.name}.fmu", fmi=2)))
        found[part.name] = where, fmpy.read_model_description(where, validate=False)
    return found


def by_hand(units: Mapping[str, tuple[str, Any]], n: int = STEPS) -> tuple[float, Array]:
    """Simulate the loop step by step with fmpy, as users usually write it.

    Parameters
    ----------
    units : mapping
        Folder and model description of ``plant`` and ``controller``, from `unpacked`.
    n : int
        Number of steps.

    Returns
    -------
    seconds : float
        Processor time of the steps (s), without loading the FMUs.
    y : array, shape (n + 1,)
        Output of the plant.
    """
    from fmpy.fmi2 import FMU2Slave

    slaves, references = {}, {}
    for name, (where, d) in units.items():
        references[name] = {v.name: v.valueReference for v in d.modelVariables}
        model = d.coSimulation.modelIdentifier
        slave = FMU2Slave(guid=d.guid, modelIdentifier=model, unzipDirectory=where, instanceName=name)
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slaves[name] = slave
    plant, controller = slaves["plant"], slaves["controller"]
    plant_u, plant_y = [references["plant"]["u"]], [references["plant"]["y"]]
    r, feedback, command = ([references["controller"][x]] for x in ("u_1", "u_2", "y"))
    controller.setReal(r, [1.0])
    plant.exitInitializationMode()
    controller.exitInitializationMode()
    (u,), y = controller.getReal(command), plant.getReal(plant_y)
    begin = time.process_time()
    for i in range(n):
        plant.setReal(plant_u, [u])
        plant.doStep(i * H, H)
        y += plant.getReal(plant_y)
        controller.setReal(feedback, [y[-1]])
        controller.doStep(i * H, H)
        (u,) = controller.getReal(command)
    seconds = time.process_time() - begin
    plant.freeInstance()
    controller.freeInstance()
    return seconds, np.array(y)
